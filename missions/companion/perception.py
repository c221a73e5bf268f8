"""How a mission's program sees, as options: its detector, which classes it looks for, how often, and what confirms one.

- `detector`: a name that the program knows, a network's .onnx file (`yolo.py`), or MODULE:FACTORY of a detector of
  one's own, called without arguments.
- `selection`: classes and their weights, {fire: 1.0, debris: 0.8}, or a JSON file of them. Scores are multiplied by the
  weight, and a class that is not named is not looked for. Without it every class counts in full.
- `look_rate_hz`: at most so many frames a second go to the detector; 0: every one.
- `confirmations`, `confirm_score`, `report_score`, `hit_share`, `gate_m`, `merge_m`: those of `Confirming`
  (`confirmation.py`).
"""

import importlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Detection, Detector
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.yolo import ModelError, OnnxDetector


class Perception(NamedTuple):
    """What a program sees with."""

    detector: Detector
    confirming: Confirming
    look_rate_hz: float = 0.0
    """0: every frame."""


class Selected:
    """A detector that looks for some classes only, and believes in each as much as it is told."""

    def __init__(self, detector: Detector, weights: Mapping[str, float]) -> None:
        """`weights` by label; a label that is not there is not looked for."""
        self._detector, self._weights = detector, weights

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels that are looked for."""
        return tuple(label for label in self._detector.labels if self._weights.get(label, 0.0) > 0.0)

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """As `Detector`; best score first."""
        found = [
            one._replace(score=min(1.0, one.score * self._weights[one.label]))
            for one in self._detector.detect(image, gsd_m)
            if self._weights.get(one.label, 0.0) > 0.0
        ]
        return sorted(found, key=lambda one: -one.score)


def perception_of(
    given: Options, detectors: Mapping[str, Callable[[], Detector]], confirming: Confirming
) -> Perception:
    """From options. `detectors`: those the program knows, its default first. Raises ValueError."""
    detector = _detector(given.text("detector", next(iter(detectors))), detectors)
    weights = _weights(given, detector)
    wanted = confirming._replace(
        confirmations=given.whole("confirmations", confirming.confirmations, 1, 100),
        confirm_score=given.number("confirm_score", confirming.confirm_score, 0.0, 1.0),
        report_score=given.number("report_score", confirming.report_score, 0.0, 1.0),
        hit_share=given.number("hit_share", confirming.hit_share, 0.0, 1.0),
        gate_m=given.number("gate_m", confirming.gate_m, 0.1, 100.0),
        merge_m=given.number("merge_m", confirming.merge_m, 0.0, 100.0),
    )
    rate_hz = given.number("look_rate_hz", 0.0, 0.0, 60.0)
    return Perception(detector if weights is None else Selected(detector, weights), wanted, rate_hz)


def _detector(name: str, detectors: Mapping[str, Callable[[], Detector]]) -> Detector:
    """By a name that is known, a network's file, or MODULE:FACTORY."""
    if name in detectors:
        return detectors[name]()
    if name.endswith(".onnx"):
        try:
            return OnnxDetector(name)
        except ModelError as error:
            raise ValueError(f"option detector: {error}") from None
    module, colon, factory = name.partition(":")
    allowed = f"allowed: {', '.join(detectors)}, FILE.onnx, or MODULE:FACTORY of a detector of your own"
    if not colon:
        raise ValueError(f"option detector: {name!r}; {allowed}")
    try:
        made: Detector = getattr(importlib.import_module(module), factory)()
        made.labels, made.detect  # noqa: B018  # what is no detector is told here, not in flight
    except Exception as error:  # whatever a foreign module does when it is imported
        raise ValueError(f"option detector: {name!r}: {type(error).__name__}: {error}; {allowed}") from error
    return made


def _weights(given: Options, detector: Detector) -> dict[str, float] | None:
    """The selection, None if there is none."""
    chosen = given.mapping("selection")
    if chosen is None:
        return None
    if isinstance(chosen, str):
        try:
            chosen = json.loads(Path(chosen).read_text())
        except (OSError, ValueError) as error:
            raise ValueError(f"option selection: {chosen!r}: can't be read as a JSON file: {error}") from None
    if not isinstance(chosen, Mapping):
        raise ValueError(f"option selection: {chosen!r}; allowed: a mapping of classes to weights")
    for label, weight in chosen.items():
        if label not in detector.labels:
            raise ValueError(
                f"option selection: {label!r}: no class of this detector; it knows {', '.join(detector.labels)}"
            )
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0.0 <= weight <= 10.0:
            raise ValueError(f"option selection: {label}: {weight!r}; allowed: a weight from 0 to 10")
    return {label: float(weight) for label, weight in chosen.items()}
