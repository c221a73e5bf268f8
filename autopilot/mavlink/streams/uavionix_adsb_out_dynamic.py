"""UAVIONIX_ADSB_OUT_DYNAMIC: what a transponder is to say of the flight (PX4: streams/UAVIONIX_ADSB_OUT_DYNAMIC.hpp).

ADSB_SQUAWK and ADSB_EMERGC, and what the receiver and the barometer say. The receiver of a simulation tells no date.
"""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, product, rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_UAVIONIX_ADSB_OUT_DYNAMIC
NO_DATE: Final = 0xFFFFFFFF
ON_GROUND: Final = 8
"""UAVIONIX_ADSB_OUT_DYNAMIC_STATE_ON_GROUND: until it is armed."""


def fields(now_us: int, context: Context) -> Fields:
    """Whenever it is asked for; zeros of what said nothing. The pressure, in mbar, stands where a height belongs."""
    topics, parameters = context.topics, context.parameters
    gps = topics.sensor_gps
    return (
        NO_DATE,
        _told(gps.latitude_deg, 1e7),
        _told(gps.longitude_deg, 1e7),
        _told(gps.altitude_msl_m, 1e3),
        _hundredth(topics.vehicle_air_data.baro_pressure_pa),
        _cut(gps.eph, 1000.0),
        _cut(gps.epv, 100.0),
        _cut(gps.s_variance_m_s, 1000.0),
        _cut(gps.vel_d_m_s, -100.0),
        _cut(gps.vel_n_m_s, 100.0),
        _cut(gps.vel_e_m_s, 100.0),
        0 if topics.vehicle_status.armed else ON_GROUND,
        int(parameters["ADSB_SQUAWK"]),
        gps.fix_type,
        gps.satellites_used,
        int(parameters["ADSB_EMERGC"]),
    )


def _told(value: float, factor: float) -> int:
    return rounded(value * factor) if math.isfinite(value) else 0


def _cut(value: float, factor: float) -> int:
    return truncated(product(value, factor)) if math.isfinite(value) else 0


def _hundredth(value: float) -> int:
    return truncated(float32(value) / 100.0) if math.isfinite(value) else 0
