"""HIL_ACTUATOR_CONTROLS.time_usec: when outputs were made. A rover rolls on without new ones (sih.cpp, read_motors)."""

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.core.simulator_api import HilSensor

TICK_US, TICKS = 4000, 50
STANDING = (0.0, 0.0, -9.81, 0.0, 0.0, 0.0, 0.2, 0.0, 0.4, 955.0, 0.0, 0.0, 15.0)


@pytest.mark.parametrize(("model", "made"), [("iris", True), ("sihsim_rover_ackermann", False)])
def test_a_disarmed_rover_makes_no_outputs_and_a_multicopter_does(model: str, made: bool) -> None:
    autopilot = Autopilot(vehicles.load(model).airframe, 0)
    times = [
        autopilot.step([HilSensor(tick * TICK_US, *STANDING, 0b1101111111111, 0)]).time_usec
        for tick in range(1, TICKS + 1)
    ]
    assert (times[-1] == TICKS * TICK_US, len(set(times[TICKS // 2 :])) > 1) == (made, made)
