"""GPS_RAW_INT: what the receiver says (PX4: streams/GPS_RAW_INT.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_GPS_RAW_INT
HDOP_CENTI: Final = 70
VDOP_CENTI: Final = 110
VELOCITY_ACCURACY_MM_S: Final = 400
"""What PX4's simulated receiver states (SIH: hdop 0.7, vdop 1.1, s_variance 0.4 m/s)."""
NO_FIX_DOP_CENTI: Final = 10_000
NO_FIX_VELOCITY_ACCURACY_MM_S: Final = 100_000
"""And without a fix."""
FIX_3D: Final = 3
UNKNOWN: Final = 65535
UNKNOWN_SATELLITES: Final = 255
SILENT_US: Final = 1_000_000
"""A receiver that has said nothing for so long is gone."""


def stamp(now_us: int, context: Context) -> int:
    """Once per fix; and, when there are no more, once in a second that there are none."""
    fix_us = context.topics.sensor_gps.timestamp
    return fix_us + (now_us - fix_us) // SILENT_US * SILENT_US


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, mm AMSL, cm/s, cdeg, mm; heights over the ellipsoid and AMSL are not told apart."""
    gps = context.topics.sensor_gps
    if gps.timestamp == 0:
        return None
    if now_us - gps.timestamp >= SILENT_US:
        return (0, 0, 0, 0, *(UNKNOWN,) * 4, mavlink.GPS_FIX_TYPE_NO_GPS, UNKNOWN_SATELLITES, *(0,) * 6)
    dops, velocity_accuracy = (HDOP_CENTI, VDOP_CENTI), VELOCITY_ACCURACY_MM_S
    if gps.fix_type < FIX_3D:
        dops, velocity_accuracy = (NO_FIX_DOP_CENTI,) * 2, NO_FIX_VELOCITY_ACCURACY_MM_S
    north, east = gps.vel_n_m_s, gps.vel_e_m_s
    altitude_mm = rounded(gps.altitude_msl_m * 1000.0)
    return (
        gps.timestamp,
        rounded(gps.latitude_deg * 1e7),
        rounded(gps.longitude_deg * 1e7),
        altitude_mm,
        *dops,
        min(truncated(math.hypot(north, east) * 100.0), UNKNOWN),
        truncated(math.degrees(math.atan2(east, north)) % 360.0 * 100.0),
        gps.fix_type,
        gps.satellites_used,
        altitude_mm,
        _mm(gps.eph),
        _mm(gps.epv),
        velocity_accuracy,
        0,
        0,
    )


def _mm(accuracy_m: float) -> int:
    """0 where a simulator does not tell its receiver's accuracy."""
    return rounded(accuracy_m * 1000.0) if math.isfinite(accuracy_m) else 0
