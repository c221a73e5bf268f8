"""A rover's controllers (topics/rover.py, and position_controller_status of topics/control.py)."""

import math

from sitl_emu.autopilot.logger.packing import by_name, zeros
from sitl_emu.autopilot.topics import (
    PositionControllerStatus,
    PurePursuitStatus,
    RoverAttitudeSetpoint,
    RoverAttitudeStatus,
    RoverPositionSetpoint,
    RoverRateSetpoint,
    RoverRateStatus,
    RoverSpeedSetpoint,
    RoverSpeedStatus,
    RoverSteeringSetpoint,
    RoverThrottleSetpoint,
)

MECANUM_ALONE = dict.fromkeys(
    ("measured_speed_body_y", "adjusted_speed_body_y_setpoint", "pid_throttle_body_y_integral"), math.nan
)
"""Fields that an Ackermann rover has no number for."""

position_controller_status = by_name(
    "position_controller_status",
    PositionControllerStatus,
    zeros("nav_roll", "nav_pitch", "nav_bearing", "target_bearing", "xtrack_error", "wp_dist", "type"),
)
OWN_NAMES = {
    topic: by_name(topic, kind, extra)
    for topic, kind, extra in (
        ("pure_pursuit_status", PurePursuitStatus, None),
        ("rover_attitude_setpoint", RoverAttitudeSetpoint, None),
        ("rover_attitude_status", RoverAttitudeStatus, None),
        ("rover_position_setpoint", RoverPositionSetpoint, {"yaw": math.nan}),
        ("rover_rate_setpoint", RoverRateSetpoint, None),
        ("rover_rate_status", RoverRateStatus, None),
        ("rover_speed_setpoint", RoverSpeedSetpoint, zeros("speed_body_y")),
        ("rover_speed_status", RoverSpeedStatus, MECANUM_ALONE),
        ("rover_steering_setpoint", RoverSteeringSetpoint, None),
        ("rover_throttle_setpoint", RoverThrottleSetpoint, None),
    )
}
"""Those that are logged under their own names, 10 times a second."""
