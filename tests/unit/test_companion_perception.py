"""How a program sees, by its options: detectors by name or from anywhere, classes by weight, rate, confirmations."""

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.telemetry import Telemetry
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel
from sitl_emu.missions.companion.confirmation import SURVEYING, Confirmation
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Known, Perception, perception_of
from sitl_emu.missions.companion.spotter import Origin, Spotter
from tests.unit.companion_px4 import on_the_wire

PICTURE = np.zeros((4, 4, 3), np.uint8)


class Fires:
    """Sees a fire, debris and water in every picture."""

    labels = ("fire", "debris", "water")

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        scores = zip(self.labels, (0.9, 0.8, 0.7), strict=True)
        return [Detection(label, score, 1.0, 1.0, 2.0, 2.0) for label, score in scores]


def perceived(**options: Any) -> Perception:
    given = Options(options)
    perception = perception_of(given, {"fires": Known(Fires, SURVEYING)})
    given.end()
    return perception


def found(perception: Perception) -> list[tuple[str, float]]:
    return [(one.label, round(one.score, 6)) for one in perception.detector.detect(PICTURE)]


def test_without_options_everything_is_as_the_program_has_it() -> None:
    perception = perceived()
    assert perception.confirming == SURVEYING and perception.look_rate_hz == 10.0
    assert found(perception) == [("fire", 0.9), ("debris", 0.8), ("water", 0.7)]


def test_a_selection_looks_for_some_classes_and_weighs_them(tmp_path: Path) -> None:
    file = tmp_path / "selection.json"
    file.write_text(json.dumps({"water": 1.2, "fire": 0.5, "debris": 0}))
    for selection in ({"water": 1.2, "fire": 0.5}, str(file)):
        perception = perceived(selection=selection)
        assert found(perception) == [("water", 0.84), ("fire", 0.45)]
        assert perception.detector.labels == ("fire", "water")


def test_a_selection_may_have_thresholds() -> None:
    assert found(perceived(selection={"fire": {"weight": 0.5, "threshold": 0.45}, "water": 1})) == [
        ("water", 0.7), ("fire", 0.45)
    ]  # fmt: skip
    assert found(perceived(selection={"fire": {"threshold": 0.95}, "water": 1})) == [("water", 0.7)]


def test_confirmations_gates_and_rate_are_settings() -> None:
    perception = perceived(confirmations=5.0, gate_m=3, look_rate_hz=2)
    assert perception.confirming == SURVEYING._replace(confirmations=5, gate_m=3.0)
    assert perception.look_rate_hz == 2.0


def test_a_detector_of_ones_own_is_found_by_module_and_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_detector.py").write_text(
        "class Blind:\n    labels = ('nothing',)\n    def detect(self, image, gsd_m=None):\n        return []\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert found(perceived(detector="my_detector:Blind")) == []
    sys.modules.pop("my_detector")


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        (
            {"detector": "fire"},
            "option detector: 'fire'; allowed: fires, disaster, field, FILE.onnx, or MODULE:FACTORY of a detector",
        ),
        ({"detector": "no_such:Thing"}, "option detector: 'no_such:Thing': ModuleNotFoundError"),
        ({"detector": "json:JSONDecoder"}, "'json:JSONDecoder': AttributeError: .* has no attribute 'labels'"),
        (
            {"selection": {"fier": 1}},
            "option selection: 'fier': no class of this detector; it knows fire, debris, water",
        ),
        ({"selection": {"fire": -1}}, "option selection: fire: -1; allowed: a weight from 0 to 10"),
        ({"selection": {"fire": {"wieght": 1}}}, "option selection: fire: 'wieght'; allowed: weight and threshold"),
        ({"selection": {"fire": {"threshold": 2}}}, "option selection: fire: 2; allowed: a threshold from 0 to 1"),
        ({"selection": {"fire": 0}}, "looks for nothing; give a class a weight above 0"),
        ({"selection": "nowhere.json"}, "option selection: 'nowhere.json': can't be read as a JSON file"),
        ({"selection": 3}, "option selection: 3; allowed: a mapping"),
        ({"confirmations": 2.5}, "option confirmations: 2.5; allowed: a whole number from 1 to 100"),
        ({"gate_m": "wide"}, "option gate_m: 'wide'; allowed: a number from 0.1 to 100"),
        ({"look_rate": 2}, "option look_rate: unknown; allowed: detector, selection, look_rate_hz, confirmations"),
    ],
)
def test_a_wrong_option_is_told_in_one_line(options: dict[str, Any], wanted: str) -> None:
    with pytest.raises(ValueError, match=wanted) as told:
        perceived(**options)
    assert "\n" not in str(told.value)


def test_a_look_rate_leaves_out_frames_evenly() -> None:
    telemetry = Telemetry(1)
    home = (40.47, -86.99, 215.0)
    spotter = Spotter(telemetry, CameraModel(), NADIR, Origin(*home), Confirmation(CameraModel(), 0.0), 5.0)
    wanted = []
    for frame in range(30):  # 15 frames a second, for two seconds
        frame_us = frame * 66_667
        place = (round(home[0] * 1e7), round(home[1] * 1e7), 230_000, 15_000, 0, 0, 0, 0)
        for msg in (
            mavlink.MAVLink_heartbeat_message(13, 12, 157, 0, 4, 3),
            mavlink.MAVLink_global_position_int_message(frame_us // 1000, *place),
            mavlink.MAVLink_attitude_quaternion_message(frame_us // 1000, 1, 0, 0, 0, 0, 0, 0),
        ):
            telemetry.on_message(frame_us, on_the_wire(msg, 1, 1))
        if spotter.wants(frame_us) is not None:
            wanted.append(frame)
    assert len(wanted) == 10
    assert {later - earlier for earlier, later in pairwise(wanted)} <= {2, 3, 4}
