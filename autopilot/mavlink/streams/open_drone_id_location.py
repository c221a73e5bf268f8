"""OPEN_DRONE_ID_LOCATION: the aircraft, for remote identification (PX4: streams/OPEN_DRONE_ID_LOCATION.hpp)."""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION
STATUS_GROUND = 1
STATUS_AIRBORNE = 2
UNKNOWN_DIRECTION = 36100
UNKNOWN_ALTITUDE = -1000.0
ACCURACY_LIMITS_HORIZONTAL_M = ((1.0, 12), (3.0, 11), (10.0, 10), (30.0, 9))
ACCURACY_LIMITS_VERTICAL_M = ((1.0, 6), (3.0, 5), (10.0, 4), (25.0, 3))
SPEED_ACCURACY_UNDER_1_M_S = 3
TIMESTAMP_ACCURACY_UNDER_0_2_S = 2
SECONDS_PER_HOUR = 3600


def accuracy(error_m: float, limits: tuple[tuple[float, int], ...]) -> int:
    """The MAV_ODID_*_ACC class of an error; 0 is unknown."""
    return next((number for limit, number in limits if error_m < limit), 0)


def fields(now_us: int, context: Context) -> Fields:
    """1e-7 deg, m, cm/s, cdeg; broadcast (targets 0)."""
    topics = context.topics
    gps, local = topics.sensor_gps, topics.vehicle_local_position
    latitude = longitude = 0
    altitude_m, direction = UNKNOWN_ALTITUDE, UNKNOWN_DIRECTION
    if gps.fix_type >= 3:
        latitude, longitude = round(gps.latitude_deg * 1e7), round(gps.longitude_deg * 1e7)
        altitude_m = gps.altitude_msl_m
        direction = int(math.degrees(math.atan2(gps.vel_e_m_s, gps.vel_n_m_s)) % 360.0 * 100.0)
    home = topics.home_position
    height_m = -(local.z - home.z) if home.valid else UNKNOWN_ALTITUDE
    baro_m = topics.sensor_baro.baro_alt_m
    now_s = (context.boot_unix_us + now_us) * 1e-6
    return (
        latitude,
        longitude,
        baro_m if baro_m == baro_m else UNKNOWN_ALTITUDE,
        altitude_m,
        height_m,
        now_s % SECONDS_PER_HOUR,
        direction,
        min(int(math.hypot(local.vx, local.vy) * 100.0), 25425),
        max(min(int(-local.vz * 100.0), 6200), -6200),
        0,
        0,
        *(0,) * 20,
        STATUS_GROUND if topics.vehicle_land_detected.landed else STATUS_AIRBORNE,
        0,
        accuracy(gps.eph, ACCURACY_LIMITS_HORIZONTAL_M),
        accuracy(gps.epv, ACCURACY_LIMITS_VERTICAL_M),
        0,
        SPEED_ACCURACY_UNDER_1_M_S,
        TIMESTAMP_ACCURACY_UNDER_0_2_S,
    )
