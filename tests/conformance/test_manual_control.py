"""MANUAL_CONTROL: with sticks Position mode can be armed, without them it can't."""

from typing import Any

import pytest

ARM_DISARM = 400
POSITION, HOLD = (3, 0), (4, 3)


@pytest.mark.covers("MANUAL_CONTROL", source="https://mavlink.io/en/services/manual_control.html")
@pytest.mark.covers("MANUAL_CONTROL", source="PX4 parameter COM_RC_IN_MODE: a joystick counts")
def test_sticks_make_position_mode_armable(station: Any) -> None:
    station.set_mode(*POSITION)
    try:
        assert station.command(ARM_DISARM, 1) == 1
        assert station.arm_while(lambda: station.mav.manual_control_send(station.system, 0, 0, 500, 0, 0)) == 0
    finally:
        station.disarm()
        station.set_mode(*HOLD)
