"""OPTICAL_FLOW_RAD is taken in silence."""

from typing import Any

import pytest


@pytest.mark.covers("OPTICAL_FLOW_RAD", source="https://mavlink.io/en/messages/common.html#OPTICAL_FLOW_RAD")
def test_flow_is_taken_in_silence(station: Any) -> None:
    station.mav.optical_flow_rad_send(0, 0, 50_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0, -1.0)
    assert station.receive("COMMAND_ACK", 0.5) is None
