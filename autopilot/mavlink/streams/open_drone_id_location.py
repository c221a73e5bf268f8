"""OPEN_DRONE_ID_LOCATION: the aircraft, for remote identification (PX4: streams/OPEN_DRONE_ID_LOCATION.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION
GROUND: Final = 1
AIRBORNE: Final = 2
EMERGENCY: Final = 3
"""MAV_ODID_STATUS."""
FIX_2D: Final = 2
FIX_3D: Final = 3
UNKNOWN_DIRECTION: Final = 36100
UNKNOWN_SPEED_HORIZONTAL: Final = 25500
UNKNOWN_SPEED_VERTICAL: Final = 6300
FASTEST_HORIZONTAL_CM_S: Final = 25425
FASTEST_VERTICAL_CM_S: Final = 6200
UNKNOWN_ALTITUDE: Final = -1000.0
UNKNOWN_TIME: Final = 65535.0
UNKNOWN_TIME_ACCURACY: Final = 0
"""PX4's simulated receiver knows no date (SensorGpsSim::Run: time_utc_usec 0)."""
ACCURACY_LIMITS_HORIZONTAL_M = ((1.0, 12), (3.0, 11), (10.0, 10), (30.0, 9))
ACCURACY_LIMITS_VERTICAL_M = ((1.0, 6), (3.0, 5), (10.0, 4), (25.0, 3), (45.0, 2), (150.0, 1))
SPEED_ACCURACY_UNDER_1_M_S: Final = 3
"""PX4's simulated receiver states 0.4 m/s, and 100 m/s without a fix, which is unknown (0)."""
FORGOTTEN_US: Final = 10_000_000
"""What a receiver said is told for so long."""


def accuracy(error_m: float, limits: tuple[tuple[float, int], ...]) -> int:
    """The MAV_ODID_*_ACC class of an error; 0 is unknown."""
    return next((number for limit, number in limits if error_m < limit), 0)


def fields(now_us: int, context: Context) -> Fields:
    """1e-7 deg, m, cm/s, cdeg (whole degrees); motion is the receiver's; broadcast (targets 0)."""
    topics = context.topics
    gps, local, home = topics.sensor_gps, topics.vehicle_local_position, topics.home_position
    latitude = longitude = horizontal = vertical = speed_accuracy = 0
    altitude_m, direction = UNKNOWN_ALTITUDE, UNKNOWN_DIRECTION
    speed, climb = UNKNOWN_SPEED_HORIZONTAL, UNKNOWN_SPEED_VERTICAL
    if gps.timestamp and now_us - gps.timestamp < FORGOTTEN_US:
        north, east, down = gps.vel_n_m_s, gps.vel_e_m_s, gps.vel_d_m_s
        direction = min(rounded(math.degrees(math.atan2(east, north)) % 360.0) * 100, 35999)
        speed = min(truncated(math.hypot(north, east) * 100.0), FASTEST_HORIZONTAL_CM_S)
        climb = max(-FASTEST_VERTICAL_CM_S, min(FASTEST_VERTICAL_CM_S, rounded(-down * 100.0)))
        if gps.fix_type >= FIX_2D:
            latitude, longitude = rounded(gps.latitude_deg * 1e7), rounded(gps.longitude_deg * 1e7)
            horizontal = accuracy(gps.eph, ACCURACY_LIMITS_HORIZONTAL_M)
            vertical = accuracy(gps.epv, ACCURACY_LIMITS_VERTICAL_M)
        if gps.fix_type >= FIX_3D:
            altitude_m = float(rounded(gps.altitude_msl_m))
            speed_accuracy = SPEED_ACCURACY_UNDER_1_M_S
    knows_height = home.valid and local.z_valid and local.z_global
    height_m = local.ref_alt - local.z - home.alt if knows_height else UNKNOWN_ALTITUDE
    air = topics.vehicle_air_data
    baro_m = air.baro_alt_meter if air.timestamp and now_us - air.timestamp < FORGOTTEN_US else 0.0
    return (
        latitude,
        longitude,
        baro_m,
        altitude_m,
        height_m,
        UNKNOWN_TIME,
        direction,
        speed,
        climb,
        0,
        0,
        *(0,) * 20,
        _status(context),
        0,
        horizontal,
        vertical,
        0,
        speed_accuracy,
        UNKNOWN_TIME_ACCURACY,
    )


def _status(context: Context) -> int:
    status = context.topics.vehicle_status
    if status.failsafe and status.armed:
        return EMERGENCY
    return GROUND if context.topics.vehicle_land_detected.landed else AIRBORNE
