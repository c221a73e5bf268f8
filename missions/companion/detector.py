"""What finds things in pictures, as a companion knows it: `Detector`, and what it finds, `Detection`.

A mission brings its own detector, or takes one by name from its options.
"""

from typing import NamedTuple, Protocol

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


class Detector(Protocol):
    """Whatever finds things in pictures. `labels` are those it may give."""

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels of its detections."""
        ...

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """Finds in a BGR picture (height, width, 3). `gsd_m`: metres a pixel on the optical axis, if known."""
        ...
