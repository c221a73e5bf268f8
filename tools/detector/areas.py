"""Areas by the pixels that show them: what a part of a picture should say, and how good it is.

A part is PART_PX by PART_PX pixels of the network's input. Its share of a class is how much of it shows that class.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.detector import Areas
from sitl_emu.missions.companion.yolo import Found
from tools.detector.augment import UNKNOWN, Image, shown_by
from tools.detector.data import Split

Shares = npt.NDArray[np.float32]
PART_PX = 8
"""The finest stride of the network."""
HALF = 0.5
"""Share from which a part counts as of a class."""


class AreaScore(NamedTuple):
    """Of a class, over the parts of all pictures of a split whose regions are known."""

    iou: float
    precision: float
    recall: float
    others: float
    """The share of parts that are not of the class and were taken for it."""


def shares_of(shown: Image | None, classes: int, size: tuple[int, int]) -> Shares:
    """(classes + 1, height / PART_PX, width / PART_PX): each class's share, and how much of a part is known.

    `shown`: as `augment.Changed` has it. `size`: height and width of the picture.
    """
    rows, columns = size[0] // PART_PX, size[1] // PART_PX
    shares = np.zeros((classes + 1, rows, columns), np.float32)
    if shown is None:
        return shares
    for label in range(classes):
        shares[label] = _mean(shown == label + 1, columns, rows)
    shares[classes] = 1.0 - _mean(shown == UNKNOWN, columns, rows)
    return shares


def _mean(mask: npt.NDArray[np.bool_], columns: int, rows: int) -> Shares:
    return np.asarray(cv2.resize(mask.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA), np.float32)


def of_boxes(found: Found, at: float, classes: int, size: tuple[int, int]) -> Shares:
    """(classes, height / PART_PX, width / PART_PX): 1 where a part's middle lies in a box of a score from `at` on."""
    rows, columns = size[0] // PART_PX, size[1] // PART_PX
    shares = np.zeros((classes, rows, columns), np.float32)
    y, x = ((np.arange(count) + 0.5) * PART_PX for count in (rows, columns))
    for (left, top, right, bottom), value, label in zip(found.boxes, found.scores, found.labels, strict=True):
        if value >= at:
            shares[label][np.ix_((y >= top) & (y < bottom), (x >= left) & (x < right))] = 1.0
    return shares


def in_parts(areas: Areas, size: tuple[int, int]) -> Shares:
    """The same of a detector's areas, in parts of a picture of that height and width."""
    y, x = np.meshgrid(*((np.arange(side // PART_PX) + 0.5) * PART_PX for side in size), indexing="ij")
    return np.stack([areas.at(label, x, y) for label in areas.labels])


def scored(found: Sequence[Shares], split: Split) -> list[AreaScore]:
    """Of the shares (classes, rows, columns) that were found in each picture of a split; none where none were."""
    classes = len(split.labels)
    both, there, taken, parts = np.zeros(classes), np.zeros(classes), np.zeros(classes), 0
    for shares, regions, rows, image in zip(found, split.regions, split.rows, split.images, strict=False):
        if regions is None:
            continue
        true = shares_of(shown_by(regions, rows), classes, image.shape[:2])
        known = true[classes] > 1.0 - HALF
        is_there, is_taken = (true[:classes] >= HALF) & known, (shares >= HALF) & known
        both += (is_there & is_taken).sum(axis=(1, 2))
        there += is_there.sum(axis=(1, 2))
        taken += is_taken.sum(axis=(1, 2))
        parts += int(known.sum())
    if not parts:
        return []
    return [
        AreaScore(*(float(a / max(b, 1)) for a, b in (
            (both[k], there[k] + taken[k] - both[k]), (both[k], taken[k]), (both[k], there[k]),
            (taken[k] - both[k], parts - there[k]),
        )))
        for k in range(classes)
    ]  # fmt: skip
