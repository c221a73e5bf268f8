"""ADSB_VEHICLE: an aircraft that somebody tells of is told again by the autopilot, on the same link, too."""

from typing import Any

import pytest

ALL_VALID = 0x3F
TRAFFIC, TRAFFIC_RESOLVED = 27014176, 21567501
"""Events navigator_traffic and navigator_traffic_resolved."""
EVENT, HEADER_BYTES, ARGUMENTS_AT = "UNKNOWN_410", 10, 13
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


@pytest.mark.covers("EVENT", source="https://docs.px4.io/v1.18/en/peripherals/adsb_flarm")
def test_an_aircraft_that_comes_too_close_is_told_as_an_event(station: Any) -> None:
    place = station.receive("GLOBAL_POSITION_INT")

    def fly_by(lat: int, lon: int) -> None:
        station.mav.adsb_vehicle_send(
            0x4B5678, lat, lon, altitude_type=1, altitude=place.alt, heading=0, hor_velocity=10_000, ver_velocity=0,
            callsign=b"HBDEF", emitter_type=3, tslc=1, flags=ALL_VALID, squawk=7000,
        )  # fmt: skip

    fly_by(place.lat, place.lon)
    assert event_arguments(station, TRAFFIC, 4) == (0x4B5678).to_bytes(4, "little")
    fly_by(**FAR_AWAY)
    assert event_arguments(station, TRAFFIC_RESOLVED, 4) == (0x4B5678).to_bytes(4, "little")


def event_arguments(station: Any, event_id: int, size: int) -> bytes:
    """Of the next event of an id; pymavlink's packaged dialects do not know EVENT."""
    while (event := station.receive(EVENT)) is not None:
        frame = bytes(event.get_msgbuf())
        payload = frame[HEADER_BYTES : HEADER_BYTES + frame[1]].ljust(ARGUMENTS_AT + size, b"\0")
        if int.from_bytes(payload[:4], "little") == event_id:
            return payload[ARGUMENTS_AT : ARGUMENTS_AT + size]
    raise AssertionError(f"no event {event_id}")
