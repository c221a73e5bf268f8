"""What a rover's controllers ask of each other and have come to, for logs (writer: rover_ackermann, at 100 Hz).

A speed is along the body, backwards negative; headings and bearings are from north.
"""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN


class RoverPositionSetpoint(NamedTuple):
    """Where to drive, along the line from where: metres north and east, m/s."""

    timestamp: int = 0
    position_ned: tuple[float, float] = (NAN, NAN)
    start_ned: tuple[float, float] = (NAN, NAN)
    """NaN for here."""
    cruising_speed: float = NAN
    """NaN for RO_SPEED_LIM."""
    arrival_speed: float = NAN


class PurePursuitStatus(NamedTuple):
    """How a line is followed: metres, rad."""

    timestamp: int = 0
    lookahead_distance: float = NAN
    target_bearing: float = NAN
    crosstrack_error: float = NAN
    """Positive right of the line."""
    distance_to_waypoint: float = NAN
    bearing_to_waypoint: float = NAN


class RoverSpeedSetpoint(NamedTuple):
    """m/s."""

    timestamp: int = 0
    speed_body_x: float = NAN


class RoverSpeedStatus(NamedTuple):
    """m/s; the setpoint as far as the acceleration's limit lets it; what the PID has added up, of the throttle."""

    timestamp: int = 0
    measured_speed_body_x: float = NAN
    adjusted_speed_body_x_setpoint: float = NAN
    pid_throttle_body_x_integral: float = NAN


class RoverAttitudeSetpoint(NamedTuple):
    """rad."""

    timestamp: int = 0
    yaw_setpoint: float = NAN


class RoverAttitudeStatus(NamedTuple):
    """rad; the setpoint as far as the yaw rate's limit lets it."""

    timestamp: int = 0
    measured_yaw: float = NAN
    adjusted_yaw_setpoint: float = NAN


class RoverRateSetpoint(NamedTuple):
    """rad/s."""

    timestamp: int = 0
    yaw_rate_setpoint: float = NAN


class RoverRateStatus(NamedTuple):
    """rad/s; the setpoint as far as it can be steered; what the PID has added up, rad of steering."""

    timestamp: int = 0
    measured_yaw_rate: float = NAN
    adjusted_yaw_rate_setpoint: float = NAN
    pid_yaw_rate_integral: float = NAN


class RoverSteeringSetpoint(NamedTuple):
    """-1 to 1, right."""

    timestamp: int = 0
    normalized_steering_setpoint: float = NAN


class RoverThrottleSetpoint(NamedTuple):
    """-1 to 1."""

    timestamp: int = 0
    throttle_body_x: float = NAN
    throttle_body_y: float = NAN
    """0 of the sticks, NaN of the speed's controller: an Ackermann rover has none."""
