"""Whose video a run sends, and what is said where there is none."""

from pathlib import Path

import pytest
import yaml

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import VideoState
from sitl_emu.run import preflight, wiring
from sitl_emu.run.carried import Carried
from sitl_emu.run.scenario import Scenario, load
from sitl_emu.run.trouble import Trouble

INSTANCE = 214
OUTSIDE = {"command": ["px4"]}


def scenario(folder: Path, **vehicle: object) -> Scenario:
    path = folder / "own.yaml"
    uas = {"name": "uas", "model": "iris"} | vehicle
    path.write_text(yaml.safe_dump({"name": "own", "world": "flat", "vehicles": [uas]}))
    return load(path)


@pytest.mark.parametrize(
    ("vehicle", "sends"),
    [
        ({"camera": {}}, True),
        ({}, False),
        ({"camera": {}, "model": "sihsim_hex"}, False),
        ({"camera": {}, "autopilot": OUTSIDE}, False),
        ({"camera": {}, "autopilot": OUTSIDE | {"components": True}}, True),
    ],
)
def test_video_is_sent_of_a_camera_that_is_drawn_and_can_speak_of_it(
    tmp_path: Path, vehicle: dict[str, object], sends: bool
) -> None:
    asked = scenario(tmp_path, **vehicle)
    assert wiring.has_video(asked.vehicles[0]) == sends
    if sends:
        preflight.check_video(asked)
    else:
        with pytest.raises(Trouble, match=r"--video: no vehicle of own has a camera; give one of them `camera: {}`"):
            preflight.check_video(asked)


@pytest.mark.parametrize("video", [True, False])
def test_beside_an_autopilot_from_outside_video_runs_from_the_first_tick(video: bool) -> None:
    carried = Carried(vehicles.load("iris"), INSTANCE, None, video=video)
    try:
        said = [message for tick in range(5) for message in carried.step(4000 * tick, [])]
    finally:
        carried._sockets.close()
    assert said == [VideoState(True)] * video
    assert ports.video(INSTANCE) == 5600 + INSTANCE
