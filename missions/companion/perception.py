"""How a mission's program sees, as options: its detector, which classes it looks for, how often, and what confirms one.

- `detector`: a name that the program knows, a network that comes with the package (`networks/`) or an .onnx file of
  one's own (`yolo.py`), or MODULE:FACTORY of a detector of one's own, called without arguments.
- `selection`: classes and their weights, {fire: 1.0, debris: 0.8}, a JSON file of them, or mftp:///PATH, such a file on
  the autopilot's card (`selection.py`). Without it every class counts in full.
- `look_rate_hz`: at most so many frames a second go to the detector, 10 unless told; 0: every one.
- `confirmations`, `confirm_score`, `report_score`, `hit_share`, `least_width_m`, `gate_m`, `merge_m`, `within_deg`:
  those of `Confirming` (`confirmation.py`).
"""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Detector
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.selection import MFTP, Selected, read, selection_of
from sitl_emu.missions.companion.yolo import ModelError, OnnxDetector

LOOK_RATE_HZ = 10.0
"""As the disaster-response paper's network looks on its Raspberry Pi 5."""


class Known(NamedTuple):
    """A detector that a program knows by name."""

    make: Callable[[], Detector]
    confirming: Confirming
    """What confirms a target that it finds."""


class Perception(NamedTuple):
    """What a program sees with."""

    detector: Detector
    confirming: Confirming
    look_rate_hz: float = LOOK_RATE_HZ
    """0: every frame."""
    selection_path: str | None = None
    """Of a selection file on the autopilot, which has yet to be fetched (`steps.select`)."""

    @property
    def known(self) -> tuple[str, ...]:
        """All labels of its detector, also of what is not looked for now."""
        return self.detector.known if isinstance(self.detector, Selected) else self.detector.labels


def looking_of(given: Options, known: Mapping[str, Known]) -> Perception:
    """Detector, selection and rate from options, for a program that confirms in its own way. Raises ValueError.

    `known`: detectors that the program knows, its default first.
    """
    default = next(iter(known))
    name = given.text("detector", default)
    detector, selection_path = _selected(given, _detector(name, known))
    confirming = known[name if name in known else default].confirming
    rate_hz = given.number("look_rate_hz", LOOK_RATE_HZ, 0.0, 60.0)
    return Perception(detector, confirming, rate_hz, selection_path)


def perception_of(given: Options, known: Mapping[str, Known]) -> Perception:
    """The same with what confirms a target (`confirmation.Confirming`)."""
    perception = looking_of(given, known)
    confirming = perception.confirming
    wanted = confirming._replace(
        confirmations=given.whole("confirmations", confirming.confirmations, 1, 100),
        confirm_score=given.number("confirm_score", confirming.confirm_score, 0.0, 1.0),
        report_score=given.number("report_score", confirming.report_score, 0.0, 1.0),
        hit_share=given.number("hit_share", confirming.hit_share, 0.0, 1.0),
        least_width_m=given.number("least_width_m", confirming.least_width_m, 0.0, 100.0),
        gate_m=given.number("gate_m", confirming.gate_m, 0.1, 100.0),
        merge_m=given.number("merge_m", confirming.merge_m, 0.0, 100.0),
        within_deg=given.number("within_deg", confirming.within_deg, 1.0, 90.0),
    )
    return perception._replace(confirming=wanted)


def _detector(name: str, known: Mapping[str, Known]) -> Detector:
    """By a name that is known, a network's, its file, or MODULE:FACTORY."""
    if name in known:
        return known[name].make()
    if name in networks.names() or name.endswith(networks.SUFFIX):
        try:
            return OnnxDetector(networks.path_of(name))
        except ModelError as error:
            raise ValueError(f"option detector: {error}") from None
    module, colon, factory = name.partition(":")
    names = ", ".join(dict.fromkeys((*known, *networks.names())))
    allowed = f"allowed: {names}, FILE.onnx, or MODULE:FACTORY of a detector of your own"
    if not colon:
        raise ValueError(f"option detector: {name!r}; {allowed}")
    try:
        made: Detector = getattr(importlib.import_module(module), factory)()
        made.labels, made.detect  # noqa: B018  # what is no detector is told here, not in flight
    except Exception as error:  # whatever a foreign module does when it is imported
        raise ValueError(f"option detector: {name!r}: {type(error).__name__}: {error}; {allowed}") from error
    return made


def _selected(given: Options, detector: Detector) -> tuple[Detector, str | None]:
    """The detector with its selection, if one is given, and the path of one that lies on the autopilot."""
    chosen = given.mapping("selection")
    if chosen is None:
        return detector, None
    if isinstance(chosen, str) and chosen.startswith(MFTP):
        return Selected(detector, {}), chosen.removeprefix(MFTP)
    try:
        made = read(Path(chosen), detector.labels) if isinstance(chosen, str) else selection_of(chosen, detector.labels)
    except ValueError as error:
        raise ValueError(f"option selection: {error}") from None
    return Selected(detector, made), None
