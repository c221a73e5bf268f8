"""HIGH_LATENCY2: the vehicle in one small message, for slow links (PX4: streams/HIGH_LATENCY2.hpp).

On request: PX4's SITL has no link of the mode that streams it (MAVLINK_MODE_IRIDIUM).
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.custom_mode import custom_mode_of
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields, vfr_hud
from sitl_emu.core import attitude
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2
SPEED_SCALE: Final = 5.0
CLIMB_SCALE: Final = 10.0
ERROR_SCALE: Final = 10.0
HEADING_SCALE: Final = 0.5
"""Units of the message: 1/5 m/s, dm/s, dm, 2 degrees."""
UNKNOWN_TEMPERATURE = UNUSED = -128
UINT8_MAX: Final = 255
INT16_MAX: Final = 32767
LOW: Final = 1
"""battery_status.warning."""
MAIN_AND_SUB_SHIFT: Final = 16
"""custom_mode here is the upper half of the HEARTBEAT's: main mode below, sub mode above."""
FAILURES = (
    (mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, mavlink.HL_FAILURE_FLAG_ABSOLUTE_PRESSURE),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL, mavlink.HL_FAILURE_FLAG_3D_ACCEL),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.HL_FAILURE_FLAG_3D_GYRO),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG, mavlink.HL_FAILURE_FLAG_3D_MAG),
)
"""What is enabled and not healthy, and how it is told here."""


def fields(now_us: int, context: Context) -> Fields:
    """What is not known has the message's value for that. Accuracies are the receiver's, the climb has no sign, and the
    target's height and distance are a fixed wing's alone (0), as in PX4.
    """
    topics = context.topics
    position, battery = topics.vehicle_global_position, topics.battery_status
    hud = vfr_hud.fields(now_us, context)
    ground_speed, climb, heading, throttle = (0.0, 0.0, 0, 0) if hud is None else (hud[1], hud[3], hud[4], hud[5])
    target_yaw = attitude.heading(topics.vehicle_attitude_setpoint.q_d)
    wind = topics.wind
    wind_speed = math.hypot(wind.windspeed_north, wind.windspeed_east)
    wind_heading = math.degrees(math.atan2(wind.windspeed_east, wind.windspeed_north)) % 360.0
    items = topics.mission_result
    return (
        now_us // 1000 & 0xFFFFFFFF,
        _limited(position.lat * 1e7, -(1 << 31), (1 << 31) - 1),
        _limited(position.lon * 1e7, -(1 << 31), (1 << 31) - 1),
        custom_mode_of(topics.vehicle_status.nav_state) >> MAIN_AND_SUB_SHIFT,
        _limited(position.alt, -INT16_MAX, INT16_MAX),
        0,
        0,
        items.seq_current if items.seq_total else 65535,
        _failure_flags(context),
        context.mav_type,
        mavlink.MAV_AUTOPILOT_PX4,
        int(heading * HEADING_SCALE),
        _limited(math.degrees(target_yaw) % 360.0 * HEADING_SCALE, 0, UINT8_MAX),
        throttle,
        0,
        0,
        _limited(ground_speed * SPEED_SCALE, 0, UINT8_MAX),
        _limited(wind_speed * SPEED_SCALE, 0, UINT8_MAX),
        _limited(wind_heading * HEADING_SCALE, 0, UINT8_MAX),
        _limited(topics.sensor_gps.eph * ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        _limited(topics.sensor_gps.epv * ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        UNKNOWN_TEMPERATURE,
        _limited(abs(climb) * CLIMB_SCALE, -128, 127),
        _limited(battery.remaining * 100.0, 0, 100, -1) if battery.connected else -1,
        UNUSED,
        UNUSED,
        UNUSED,
    )


def _failure_flags(context: Context) -> int:
    """HL_FAILURE_FLAG of all that is not well; sticks and offboard that nobody uses are lost as well, as in PX4."""
    topics = context.topics
    report, failsafe, status = topics.health_report, topics.failsafe_flags, topics.estimator_status
    failing = report.enabled & ~report.health
    flags: int = sum(told for bit, told in FAILURES if failing & bit)
    unfit_gps = status.gps_check_fail_flags > 0
    for is_so, flag in (
        (topics.battery_status.warning > LOW, mavlink.HL_FAILURE_FLAG_BATTERY),
        (unfit_gps, mavlink.HL_FAILURE_FLAG_GPS),
        (unfit_gps or status.filter_fault_flags > 0, mavlink.HL_FAILURE_FLAG_ESTIMATOR),
        (topics.geofence_result.breached, mavlink.HL_FAILURE_FLAG_GEOFENCE),
        (failsafe.manual_control_signal_lost, mavlink.HL_FAILURE_FLAG_RC_RECEIVER),
        (failsafe.offboard_control_signal_lost, mavlink.HL_FAILURE_FLAG_OFFBOARD_LINK),
        (failsafe.mission_failure, mavlink.HL_FAILURE_FLAG_MISSION),
        (failsafe.fd_motor_failure, mavlink.HL_FAILURE_FLAG_ENGINE),
    ):
        flags |= flag if is_so else 0
    return flags


def _limited(value: float, lowest: int, highest: int, unknown: int = 0) -> int:
    """Rounded and held within the field; `unknown` for what is not finite."""
    return max(lowest, min(highest, round(value))) if math.isfinite(value) else unknown
