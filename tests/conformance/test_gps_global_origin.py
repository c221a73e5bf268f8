"""SET_GPS_GLOBAL_ORIGIN is answered by GPS_GLOBAL_ORIGIN, and moves the local frame only."""

from typing import Any

import pytest


@pytest.mark.covers(
    "SET_GPS_GLOBAL_ORIGIN",
    "GPS_GLOBAL_ORIGIN",
    source="https://mavlink.io/en/messages/common.html#SET_GPS_GLOBAL_ORIGIN",
)
def test_the_origin_is_told(station: Any) -> None:
    station.mav.command_long_send(station.system, 1, 512, 0, 49, *(0.0,) * 6)
    before = station.receive("GPS_GLOBAL_ORIGIN")
    station.mav.set_gps_global_origin_send(station.system, before.latitude, before.longitude, before.altitude)
    after = station.receive("GPS_GLOBAL_ORIGIN")
    assert (after.latitude, after.longitude) == (before.latitude, before.longitude)
