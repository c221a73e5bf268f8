"""Masks as COCO has them: polygons along the pixels' edges, and run lengths."""

import cv2
import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]


def polygons(mask: Mask) -> list[list[float]]:
    """Outlines [x0, y0, x1, y1, ...] of a mask (height, width), one for each part; holes count as filled.

    Corners lie on pixels' corners: the picture's left upper corner is (0, 0), and a single pixel is a square of side 1.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return []
    top, left = int(rows[0]), int(columns[0])
    part = mask[top : rows[-1] + 1, left : columns[-1] + 1].astype(np.uint8)
    # At twice the size the two sides of a pixel are two pixels: half of a contour's figures, rounded up, is its edge
    twice = np.repeat(np.repeat(part, 2, axis=0), 2, axis=1)
    contours, _ = cv2.findContours(twice, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    made = []
    for contour in contours:
        corners = _corners((contour[:, 0] + 1) // 2)
        made.append((corners + np.array((left, top))).astype(float).ravel().tolist())
    return made


def _corners(points: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Of a closed way in steps of one or none: only where it turns."""
    points = points[(points != np.roll(points, 1, axis=0)).any(axis=1)]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    return np.asarray(points[(before != after).any(axis=1)])


def run_lengths(mask: Mask) -> dict[str, list[int]]:
    """COCO's uncompressed RLE: column by column, how many pixels are off, then on, then off ..."""
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    ends = np.concatenate(([0], changes, [flat.size]))
    counts = np.diff(ends).tolist()
    return {"counts": [0, *counts] if flat[0] else counts, "size": list(mask.shape)}
