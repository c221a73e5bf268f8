"""What other cameras do to a picture and to the boxes in it: the robustness rows of `evaluate`."""

from collections.abc import Callable, Mapping
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt

from tools.detector.augment import PAD, Image, Sample, about_regions, cut, noisy, pixels_of, squeezed

Change = Callable[[Sample], Sample]
SHARE, GAMMAS, JPEG, BLUR_PX, NOISE = 0.15, (0.7, 1.4), 40, 1.5, 8.0
ZOOM, K1 = 1.15, -0.05
"""Of the other lens: its focal length over ours, and its distortion (OpenCV's k1)."""
BORDER_POINTS = 9
"""Of a box's side, that are carried through a lens."""


def changes() -> Mapping[str, Change]:
    """By what a table calls them."""
    rng = np.random.default_rng(5)
    plain: dict[str, Callable[[Image], Image]] = {
        f"warm +{SHARE:.0%}": partial(balanced, red=1.0 + SHARE),
        f"cold -{SHARE:.0%}": partial(balanced, red=1.0 - SHARE),
        **{f"gamma {gamma}": partial(curved, gamma=gamma) for gamma in GAMMAS},
        f"JPEG {JPEG}": lambda image: squeezed(image, JPEG),
        f"blur {BLUR_PX} px": lambda image: np.asarray(cv2.GaussianBlur(image, (0, 0), BLUR_PX), np.uint8),
        f"noise {NOISE:.0f}": lambda image: noisy(image, NOISE, rng),
    }
    return {**{name: partial(_alone, change) for name, change in plain.items()}, "other lens": through_another_lens}


def _alone(change: Callable[[Image], Image], one: Sample) -> Sample:
    """The picture changes, and nothing moves."""
    return one._replace(image=change(one.image))


def balanced(image: Image, red: float) -> Image:
    """Red by a factor, blue by its inverse."""
    return np.clip(image * np.array((1 / red, 1.0, red)), 0, 255).round().astype(np.uint8)


def curved(image: Image, gamma: float) -> Image:
    """Each figure to a power."""
    table = (np.arange(256) / 255.0) ** gamma * 255.0
    return np.asarray(cv2.LUT(image, table.round().astype(np.uint8)), np.uint8)


def through_another_lens(one: Sample) -> Sample:
    """As a camera in the same place sees it whose lens is longer and bends straight lines.

    The picture is taken for one of 90 degrees across, as all of the data sets are.
    """
    height, width = one.image.shape[:2]
    ours, theirs = (_matrix(0.5 * zoom * width, width, height) for zoom in (1.0, ZOOM))
    lens = np.array((K1, 0.0, 0.0, 0.0))
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    seen = np.stack((x, y), axis=-1).reshape(-1, 1, 2)
    at = cv2.undistortPoints(seen, theirs, lens, P=ours).reshape(height, width, 2).astype(np.float32)
    image = cv2.remap(one.image, at, None, cv2.INTER_LINEAR, borderValue=PAD)
    moved = one.rows.copy()
    for row in moved:
        row[1:5] = _carried(row[1:5], ours, theirs, lens)
    rows = cut(moved, 0, 0, width, height)
    if one.regions is None:
        return Sample(np.asarray(image, np.uint8), rows)
    regions = np.asarray(cv2.remap(one.regions, at, None, cv2.INTER_NEAREST), np.uint8)
    before = ZOOM * ZOOM * pixels_of(one.regions, len(rows))
    return Sample(np.asarray(image, np.uint8), about_regions(rows, one.rows[:, 5], regions, before), regions)


def _matrix(focal_px: float, width: int, height: int) -> npt.NDArray[np.float64]:
    return np.array(((focal_px, 0.0, 0.5 * width - 0.5), (0.0, focal_px, 0.5 * height - 0.5), (0.0, 0.0, 1.0)))


def _carried(
    box: npt.NDArray[np.float32],
    ours: npt.NDArray[np.float64],
    theirs: npt.NDArray[np.float64],
    lens: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """The box of a box's border."""
    left, top, right, bottom = (float(side) for side in box)
    across, down = np.linspace(left, right, BORDER_POINTS), np.linspace(top, bottom, BORDER_POINTS)
    border = np.concatenate([np.stack((across, np.full(BORDER_POINTS, y)), 1) for y in (top, bottom)]
                            + [np.stack((np.full(BORDER_POINTS, x), down), 1) for x in (left, right)])  # fmt: skip
    ahead = np.concatenate(((border - ours[:2, 2]) / ours[0, 0], np.ones((len(border), 1))), axis=1)
    there, _ = cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), theirs, lens)
    return np.concatenate((there.reshape(-1, 2).min(axis=0), there.reshape(-1, 2).max(axis=0)))
