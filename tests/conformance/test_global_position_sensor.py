"""GLOBAL_POSITION_SENSOR: a place that some source tells is told again by the autopilot, with the source's number."""

from typing import Any

import pytest


@pytest.mark.covers(
    "GLOBAL_POSITION_SENSOR", source="https://mavlink.io/en/messages/common.html#GLOBAL_POSITION_SENSOR"
)
def test_a_place_is_told_again(station: Any) -> None:
    station.mav.global_position_sensor_send(
        station.system, 1, 42, 0, 0, 2, 0, 473977420, 85455940, 490.0, 490.0, 5.0, 5.0
    )
    heard = station.receive("GLOBAL_POSITION_SENSOR")
    assert (heard.get_srcSystem(), heard.id, heard.alt) == (station.system, 42, 490.0)
