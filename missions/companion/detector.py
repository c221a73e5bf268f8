"""What finds things in pictures, as a companion knows it: `Detector`, and what it finds, `Detection`.

A mission brings its own detector, or takes one by name from its options.
"""

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera import Image


class Detection(NamedTuple):
    """One find. Centre and size of its box in pixels of the picture; score 0..1 is a probability, as honest as the
    training."""

    label: str
    score: float
    x: float
    y: float
    w: float
    h: float


class Areas(NamedTuple):
    """How much of each part of a picture shows each of some classes; says more of a lake than its box does."""

    labels: tuple[str, ...]
    shares: npt.NDArray[np.float32]
    """(labels, rows, columns), 0 to 1."""
    part_px: float
    """Side of a part, in pixels of the picture;"""
    left_px: float
    """and where the first ones begin."""
    top_px: float

    def at(self, label: str, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
        """The shares of a label at pixels of the picture, between the middles of parts; 0 of a label not known."""
        if label not in self.labels:
            return np.zeros(np.shape(x), np.float32)
        share = self.shares[self.labels.index(label)]
        row, column = (y - self.top_px) / self.part_px - 0.5, (x - self.left_px) / self.part_px - 0.5
        low_row, low_column = np.floor(row).astype(np.intp), np.floor(column).astype(np.intp)
        down, right = (row - low_row).astype(np.float32), (column - low_column).astype(np.float32)
        found = np.zeros(np.shape(x), np.float32)
        for i, j, weight in (
            (0, 0, (1 - down) * (1 - right)),
            (0, 1, (1 - down) * right),
            (1, 0, down * (1 - right)),
            (1, 1, down * right),
        ):
            rows = np.clip(low_row + i, 0, share.shape[0] - 1)
            columns = np.clip(low_column + j, 0, share.shape[1] - 1)
            found += weight * share[rows, columns]
        return found


class Detections(list[Detection]):
    """What was found in a picture; with `areas`, from a detector that knows them."""

    def __init__(self, detections: Iterable[Detection] = (), areas: Areas | None = None) -> None:
        super().__init__(detections)
        self.areas = areas


class Detector(Protocol):
    """Whatever finds things in pictures. `labels` are those it may give."""

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels of its detections."""
        ...

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """Finds in a BGR picture (height, width, 3); `Detections` where it knows areas.

        `gsd_m`: metres a pixel on the optical axis, if known.
        """
        ...
