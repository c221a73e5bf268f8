"""HIGH_LATENCY2: the vehicle in one small message, for slow links (PX4: streams/HIGH_LATENCY2.hpp).

On request: PX4's SITL has no link of the mode that streams it (MAVLINK_MODE_IRIDIUM).
"""

import math

from autopilot.commander.custom_mode import custom_mode_of
from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields, vfr_hud
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import bearing_rad, distance_m

ID = mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2
SPEED_SCALE, CLIMB_SCALE, ERROR_SCALE, DISTANCE_SCALE, HEADING_SCALE = 5.0, 10.0, 10.0, 0.1, 0.5
"""Units of the message: 1/5 m/s, dm/s, dm, dam, 2 degrees."""
UNKNOWN_TEMPERATURE = UNUSED = -128
UINT8_MAX, INT16_MAX = 255, 32767
MAIN_AND_SUB_SHIFT = 16
"""custom_mode here is the upper half of the HEARTBEAT's: main mode below, sub mode above."""
FAILURES = (
    (mavlink.MAV_SYS_STATUS_SENSOR_GPS, mavlink.HL_FAILURE_FLAG_GPS),
    (mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, mavlink.HL_FAILURE_FLAG_ABSOLUTE_PRESSURE),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL, mavlink.HL_FAILURE_FLAG_3D_ACCEL),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.HL_FAILURE_FLAG_3D_GYRO),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG, mavlink.HL_FAILURE_FLAG_3D_MAG),
    (mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER, mavlink.HL_FAILURE_FLAG_RC_RECEIVER),
)
"""What is enabled and not healthy, and how it is told here."""


def fields(now_us: int, context: Context) -> Fields:
    """What is not known has the message's value for that."""
    topics = context.topics
    position, local, battery = topics.vehicle_global_position, topics.vehicle_local_position, topics.battery_status
    hud = vfr_hud.fields(now_us, context)
    ground_speed, climb, heading, throttle = (0.0, 0.0, 0, 0) if hud is None else (hud[1], hud[3], hud[4], hud[5])
    current = topics.position_setpoint_triplet.current
    target_altitude, target_distance, target_heading = 0, 0, 0
    if current.valid and math.isfinite(current.lat) and math.isfinite(position.lat):
        target_altitude = _limited(current.alt, -INT16_MAX, INT16_MAX)
        away_m = distance_m(position.lat, position.lon, current.lat, current.lon)
        target_distance = _limited(away_m * DISTANCE_SCALE, 0, 65535)
        bearing = bearing_rad(position.lat, position.lon, current.lat, current.lon)
        target_heading = int(math.degrees(bearing) % 360.0 * HEADING_SCALE)
    wind = topics.wind
    wind_speed = math.hypot(wind.windspeed_north, wind.windspeed_east)
    wind_heading = math.degrees(math.atan2(wind.windspeed_east, wind.windspeed_north)) % 360.0
    report = topics.health_report
    failing = report.enabled & ~report.health
    flags = sum(told for bit, told in FAILURES if failing & bit)
    items = topics.mission_result
    return (
        now_us // 1000 & 0xFFFFFFFF,
        _limited(position.lat * 1e7, -(1 << 31), (1 << 31) - 1),
        _limited(position.lon * 1e7, -(1 << 31), (1 << 31) - 1),
        custom_mode_of(topics.vehicle_status.nav_state) >> MAIN_AND_SUB_SHIFT,
        _limited(position.alt, -INT16_MAX, INT16_MAX),
        target_altitude,
        target_distance,
        items.seq_current if items.seq_total else 65535,
        flags,
        context.mav_type,
        mavlink.MAV_AUTOPILOT_PX4,
        int(heading * HEADING_SCALE),
        target_heading,
        throttle,
        0,
        0,
        _limited(ground_speed * SPEED_SCALE, 0, UINT8_MAX),
        _limited(wind_speed * SPEED_SCALE, 0, UINT8_MAX),
        _limited(wind_heading * HEADING_SCALE, 0, UINT8_MAX),
        _limited(local.eph * ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        _limited(local.epv * ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        UNKNOWN_TEMPERATURE,
        _limited(climb * CLIMB_SCALE, -128, 127),
        _limited(battery.remaining * 100.0, 0, 100, -1) if battery.connected else -1,
        UNUSED,
        UNUSED,
        UNUSED,
    )


def _limited(value: float, lowest: int, highest: int, unknown: int = 0) -> int:
    """Rounded and held within the field; `unknown` for what is not finite."""
    return max(lowest, min(highest, round(value))) if math.isfinite(value) else unknown
