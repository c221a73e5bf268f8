"""Corners of a picture, followed from frame to frame: what crosses where a camera's rays meet the ground.

Corners after Shi and Tomasi (Good features to track, 1994), followed by the pyramidal Lucas-Kanade tracker (Bouguet,
2000), both OpenCV's; a corner that is not found again within `BACK_PX` when it is followed back is let go (forward-
backward error: Kalal, Mikolajczyk and Matas, 2010).
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

MOST = 300
"""Followed at a time; ours."""
QUALITY = 0.01
APART_PX = 14.0
BACK_PX = 0.7
WINDOW_PX, LEVELS = 15, 3
"""Of the tracker: it follows 15 pixels a frame and more."""

Gray = npt.NDArray[np.uint8]


class Feature(NamedTuple):
    """A corner in a frame; one number is one corner, as long as it is followed."""

    number: int
    x: float
    y: float


class FeatureTracker:
    """Follows corners through a camera's frames; to be handed them in their order."""

    def __init__(self) -> None:
        self._before: Gray | None = None
        self._points = np.zeros((0, 1, 2), np.float32)
        self._numbers: list[int] = []
        self._last = 0

    def follow(self, gray: Gray) -> list[Feature]:
        """The corners of the next frame: those that are still there, and new ones where there is room."""
        if self._before is not None and self._before.shape == gray.shape and len(self._points):
            self._keep(gray)
        if len(self._points) < MOST // 2:
            self._seek(gray)
        self._before = gray
        return [
            Feature(number, float(x), float(y))
            for number, ((x, y),) in zip(self._numbers, self._points.tolist(), strict=True)
        ]

    def _keep(self, gray: Gray) -> None:
        size: dict[str, Any] = {"winSize": (WINDOW_PX, WINDOW_PX), "maxLevel": LEVELS}
        there, found, _ = cv2.calcOpticalFlowPyrLK(self._before, gray, self._points, None, **size)
        back, again, _ = cv2.calcOpticalFlowPyrLK(gray, self._before, there, None, **size)
        off = np.abs(back - self._points).reshape(-1, 2).max(axis=1)
        height, width = gray.shape
        x, y = there.reshape(-1, 2).T
        good = (found.ravel() == 1) & (again.ravel() == 1) & (off < BACK_PX)
        good &= (x >= 0) & (x < width) & (y >= 0) & (y < height)
        self._points = there[good]
        self._numbers = [number for number, kept in zip(self._numbers, good.tolist(), strict=True) if kept]

    def _seek(self, gray: Gray) -> None:
        free = np.full(gray.shape, 255, np.uint8)
        for x, y in self._points.reshape(-1, 2).tolist():
            cv2.circle(free, (round(x), round(y)), round(APART_PX), 0, -1)
        found = cv2.goodFeaturesToTrack(gray, MOST - len(self._points), QUALITY, APART_PX, mask=free)
        if found is not None:
            self._points = np.concatenate((self._points, np.asarray(found, np.float32)))
            self._numbers += range(self._last + 1, self._last + 1 + len(found))
            self._last += len(found)
