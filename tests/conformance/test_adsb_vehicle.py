"""ADSB_VEHICLE: an aircraft that somebody tells of is told again by the autopilot, on the same link, too."""

from typing import Any

import pytest

ALL_VALID = 0x3F
FAR_AWAY = {"lat": -300000000, "lon": 1000000000}
"""Where no autopilot under test flies."""

pytestmark = pytest.mark.covers("ADSB_VEHICLE", source="https://mavlink.io/en/messages/common.html#ADSB_VEHICLE")


def test_an_aircraft_is_told_again(station: Any) -> None:
    station.mav.adsb_vehicle_send(
        0x4B1234, **FAR_AWAY, altitude_type=1, altitude=600_000, heading=9000, hor_velocity=5000, ver_velocity=-250,
        callsign=b"HBABC", emitter_type=3, tslc=2, flags=ALL_VALID, squawk=7000,
    )  # fmt: skip
    heard = station.receive("ADSB_VEHICLE")
    assert heard is not None
    assert heard.get_srcSystem() == station.system
    assert (heard.ICAO_address, heard.callsign, heard.squawk, heard.flags) == (0x4B1234, "HBABC", 7000, ALL_VALID)
    assert (heard.emitter_type, heard.tslc, heard.altitude_type) == (3, 2, 1)
    assert (heard.lat, heard.lon) == (pytest.approx(FAR_AWAY["lat"], abs=1), pytest.approx(FAR_AWAY["lon"], abs=1))
    assert (heard.altitude, heard.heading) == (pytest.approx(600_000, abs=1), pytest.approx(9000, abs=1))
    assert (heard.hor_velocity, heard.ver_velocity) == (5000, -250)
