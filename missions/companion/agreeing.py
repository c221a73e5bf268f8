"""Two detectors that err in different ways, as one: what one alone sees counts half."""

from collections.abc import Sequence

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection, Detector

DECIMALS = 3
"""Of scores."""


class Agreeing:
    """The finds of the first detector; their scores are the mean of its own and of the second's for the same place.

    The same is what has the same label and a box that touches; of several the best counts, of none 0.
    """

    def __init__(self, first: Detector, second: Detector) -> None:
        self._first, self._second = first, second

    @property
    def labels(self) -> tuple[str, ...]:
        """See Detector."""
        return self._first.labels

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """See Detector."""
        others = self._second.detect(image, gsd_m)
        return [one._replace(score=_shared(one, others)) for one in self._first.detect(image, gsd_m)]


def _shared(one: Detection, others: Sequence[Detection]) -> float:
    best = max((other.score for other in others if other.label == one.label and _touches(one, other)), default=0.0)
    return round(0.5 * (one.score + best), DECIMALS)


def _touches(a: Detection, b: Detection) -> bool:
    return 2.0 * abs(a.x - b.x) < a.w + b.w and 2.0 * abs(a.y - b.y) < a.h + b.h
