"""Offboard: the mode can be chosen on the ground, and armed only while setpoints come in."""

from typing import Any

import pytest

ARM_DISARM = 400
OFFBOARD, HOLD = (6, 0), (4, 3)
LEVEL = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.covers("SET_ATTITUDE_TARGET", source="https://docs.px4.io/main/en/flight_modes/offboard.html")
@pytest.mark.covers("SET_ATTITUDE_TARGET", source="PX4 parameter COM_OF_LOSS_T: how long a setpoint counts")
def test_arming_wants_setpoints(station: Any) -> None:
    station.set_mode(*OFFBOARD)
    try:
        assert station.command(ARM_DISARM, 1) == 1
        # Attitude without thrust: it may be armed with this, and stays where it is.
        level = (0, station.system, 1, 0, LEVEL, 0.0, 0.0, 0.0, 0.0)
        assert station.arm_while(lambda: station.mav.set_attitude_target_send(*level)) == 0
    finally:
        station.disarm()
        station.set_mode(*HOLD)
