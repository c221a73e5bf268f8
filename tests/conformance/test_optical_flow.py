"""OPTICAL_FLOW_RAD is taken in silence."""

from typing import Any

import pytest


@pytest.mark.covers("OPTICAL_FLOW_RAD", source="https://mavlink.io/en/messages/common.html#OPTICAL_FLOW_RAD")
@pytest.mark.covers("PARAM_VALUE", source="PX4 src/modules/sensors/sensors.cpp: the first flow starts a module")
def test_flow_is_taken_in_silence_and_its_parameters_are_in_the_list_from_then_on(station: Any) -> None:
    station.mav.optical_flow_rad_send(0, 0, 50_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0, -1.0)
    assert station.receive("COMMAND_ACK", 0.5) is None
    assert station.is_listed("SENS_FLOW_ROT")
