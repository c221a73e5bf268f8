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
    "pure_pursuit_status": by_name("pure_pursuit_status", PurePursuitStatus),
    "rover_attitude_setpoint": by_name("rover_attitude_setpoint", RoverAttitudeSetpoint),
    "rover_attitude_status": by_name("rover_attitude_status", RoverAttitudeStatus),
    "rover_position_setpoint": by_name("rover_position_setpoint", RoverPositionSetpoint, {"yaw": math.nan}),
    "rover_rate_setpoint": by_name("rover_rate_setpoint", RoverRateSetpoint),
    "rover_rate_status": by_name("rover_rate_status", RoverRateStatus),
    "rover_speed_setpoint": by_name("rover_speed_setpoint", RoverSpeedSetpoint, zeros("speed_body_y")),
    "rover_speed_status": by_name("rover_speed_status", RoverSpeedStatus, MECANUM_ALONE),
    "rover_steering_setpoint": by_name("rover_steering_setpoint", RoverSteeringSetpoint),
    "rover_throttle_setpoint": by_name("rover_throttle_setpoint", RoverThrottleSetpoint),
}
"""Those that are logged under their own names, 10 times a second."""
