"""Aircraft nearby, as a receiver for their transponders (ADS-B) tells a vehicle.

Source: https://mavlink.io/en/messages/common.html#ADSB_VEHICLE. PX4 avoids them as NAV_TRAFF_AVOID says, and tells them
on.
"""

import math

from sitl_emu.core import dialect as mavlink

GEOMETRIC = 1
"""ADSB_ALTITUDE_TYPE: altitude above mean sea level by GPS, not by pressure."""
COORDINATES, ALTITUDE, HEADING, VELOCITY, CALLSIGN = 1, 2, 4, 8, 16
"""ADSB_FLAGS: what is valid."""
VALID = COORDINATES | ALTITUDE | HEADING | VELOCITY | CALLSIGN
LIGHT_AIRCRAFT = 1
"""ADSB_EMITTER_TYPE."""


def adsb_vehicle(
    icao_address: int,
    callsign: str,
    lat_deg: float,
    lon_deg: float,
    alt_amsl_m: float,
    v_north: float = 0.0,
    v_east: float = 0.0,
    v_up: float = 0.0,
    seconds_old: int = 0,
) -> mavlink.MAVLink_message:
    """One aircraft; velocities in m/s, `icao_address` of 24 bits."""
    heading_deg = math.degrees(math.atan2(v_east, v_north)) % 360.0
    return mavlink.MAVLink_adsb_vehicle_message(
        icao_address,
        round(lat_deg * 1e7),
        round(lon_deg * 1e7),
        GEOMETRIC,
        round(alt_amsl_m * 1e3),
        round(heading_deg * 100.0),
        round(math.hypot(v_north, v_east) * 100.0),
        round(v_up * 100.0),
        callsign.encode("ascii", "replace")[:8],
        LIGHT_AIRCRAFT,
        seconds_old,
        VALID,
        0,
    )
