"""Controllers that PX4's rovers share (src/lib/rover_control, v1.18): slew rate, PID, speed to throttle, when to brake.

Pure functions but for the two that integrate. They know nothing of topics or parameters.
"""

import math

from autopilot.modes.trajectory_constraints import max_speed_from_distance
from sitl_emu.core.geodesy import wrap_pi


class Pid:
    """Proportional and integral gain on an error; the integral stays within -1..1."""

    __slots__ = ("gain_i", "gain_p", "integral")

    def __init__(self) -> None:
        self.gain_p = self.gain_i = self.integral = 0.0

    def update(self, error: float, dt_s: float) -> float:
        """Output for an error, in units of gain x error."""
        output = self.gain_p * error + self.integral
        self.integral = max(-1.0, min(1.0, self.integral + self.gain_i * error * dt_s))
        return output


class SpeedControl:
    """Forward speed to throttle of -1..1: slew rate, feed-forward by the speed at full throttle, PID."""

    def __init__(self) -> None:
        self.acceleration = self.deceleration = self.full_throttle_speed = 0.0
        self.pid = Pid()
        self.setpoint = 0.0

    def reset(self, speed: float) -> None:
        """Begin at this speed."""
        self.setpoint, self.pid.integral = speed, 0.0

    def update(self, wanted: float, speed: float, dt_s: float) -> float:
        """Throttle for a wanted and a measured speed in m/s."""
        limit = self.acceleration if abs(wanted) >= abs(speed) else self.deceleration
        setpoint = slew(self.setpoint, wanted, limit, dt_s)
        if abs(setpoint - speed) > abs(wanted - speed):
            setpoint = wanted  # the vehicle is nearer to what is wanted than to where the slew rate has come
        self.setpoint = setpoint
        throttle = setpoint / self.full_throttle_speed if self.full_throttle_speed > 0.0 else 0.0
        if setpoint:
            throttle += self.pid.update(setpoint - speed, dt_s)
        else:
            self.pid.integral = 0.0
        return max(-1.0, min(1.0, throttle))


def slew(value: float, wanted: float, rate: float, dt_s: float) -> float:
    """The value moved towards the wanted one at a rate per second; at once where there is no rate (0 or less)."""
    if rate <= 0.0:
        return wanted
    step = rate * dt_s
    return value + max(-step, min(step, wanted - value))


def least_cornering_speed(wheel_base_m: float, yaw_rate_limit: float, max_steering_rad: float) -> float:
    """Speed below which the largest steering angle does not reach the largest yaw rate: RO_SPEED_RED goes no lower."""
    return wheel_base_m * yaw_rate_limit / math.tan(max_steering_rad)


def arrival_speed(
    angle_rad: float, full_throttle_speed: float, reduction: float, least_speed: float, cruising_speed: float
) -> float:
    """Speed for a corner with this angle between the legs (π: straight on; NaN: it ends there), RO_SPEED_RED."""
    if math.isnan(angle_rad):
        return 0.0
    if reduction <= 0.0:
        return cruising_speed
    return constrained(_reduced(full_throttle_speed, math.pi - angle_rad, reduction), least_speed, cruising_speed)


def speed_limited_by_course(
    wanted: float, course_error_rad: float, full_throttle_speed: float, reduction: float, least_speed: float
) -> float:
    """The wanted speed, reduced while the vehicle does not head where it is to go (RO_SPEED_RED)."""
    if reduction <= 0.0:
        return wanted
    reduced = _reduced(full_throttle_speed, abs(wrap_pi(course_error_rad)), reduction)
    limit = constrained(reduced, least_speed, full_throttle_speed)
    return max(-limit, min(limit, wanted))


def constrained(value: float, least: float, most: float) -> float:
    """PX4's math::constrain: the lower bound goes first, even where it is above the upper one."""
    return least if value < least else min(value, most)


def _reduced(speed: float, error_rad: float, reduction: float) -> float:
    return speed * max(0.0, 1.0 - reduction * error_rad / math.pi)


def approach_speed(distance_m: float, arrival: float, jerk: float, deceleration: float) -> float:
    """Speed at a distance from a place that is to be reached with `arrival`; no limit without jerk or deceleration."""
    if jerk <= 0.0 or deceleration <= 0.0:
        return math.inf
    return max_speed_from_distance(jerk, deceleration, max(distance_m, 0.0), arrival)


def corner_angle(before: tuple[float, float], corner: tuple[float, float], after: tuple[float, float]) -> float:
    """Angle between two legs, π for straight on, NaN where a leg has no length."""
    in_n, in_e = before[0] - corner[0], before[1] - corner[1]
    out_n, out_e = after[0] - corner[0], after[1] - corner[1]
    size = math.hypot(in_n, in_e) * math.hypot(out_n, out_e)
    if not size > 1e-7:
        return math.nan
    return math.acos(max(-1.0, min(1.0, (in_n * out_n + in_e * out_e) / size)))
