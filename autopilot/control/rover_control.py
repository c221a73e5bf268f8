"""Controllers that PX4's rovers share (src/lib/rover_control, src/lib/slew_rate and src/lib/pid, v1.18).

Each keeps what it has come to. They know nothing of topics or parameters. A rate of 0 or less is no limit.
"""

import math

from sitl_emu.autopilot.control.rover_parameters import EPSILON
from sitl_emu.core.geodesy import wrap_pi


class Pid:
    """Proportional and integral gain on an error, within limits (PID.cpp).

    The integral stays within -1..1 and does not grow where the output is at its limit.
    """

    __slots__ = ("integral",)

    def __init__(self) -> None:
        self.integral = 0.0

    def update(self, error: float, gain_p: float, gain_i: float, limit: float, dt_s: float) -> float:
        """Output for an error."""
        output = gain_p * error + self.integral
        limited = clamp(output, -limit, limit)
        winds_up = (output - limited > EPSILON and error > 0.0) or (output - limited < -EPSILON and error < 0.0)
        if not winds_up:
            self.integral = clamp(self.integral + gain_i * error * dt_s, -1.0, 1.0)
        return limited


class Slew:
    """A value that goes to where it shall be at a limited rate (SlewRate.hpp)."""

    __slots__ = ("value",)

    def __init__(self) -> None:
        self.value = 0.0

    def towards(self, wanted: float, rate: float, actual: float, dt_s: float) -> float:
        """One step at a rate per second; at once without a rate, or where `actual` is nearer to `wanted` already."""
        if rate > EPSILON:
            self.value += clamp(wanted - self.value, -rate * dt_s, rate * dt_s)
            if abs(self.value - actual) <= abs(wanted - actual):
                return self.value
        self.value = wanted
        return wanted


class SpeedControl:
    """Forward speed to throttle: slew rate, feed-forward by the speed at full throttle, PID (speedControl)."""

    def __init__(self) -> None:
        self.setpoint = Slew()
        self.pid = Pid()

    def reset(self) -> None:
        """Begin anew from standing still."""
        self.setpoint.value = self.pid.integral = 0.0

    def update(
        self,
        wanted: float,
        speed: float,
        limits: tuple[float, float],
        full_throttle_speed: float,
        gains: tuple[float, float],
        dt_s: float,
    ) -> float:
        """Throttle of -1..1 for a wanted and a measured speed in m/s.

        `limits`: acceleration and deceleration; `gains`: of the PID.
        """
        rate = limits[0] if abs(wanted) >= abs(speed) else limits[1]
        setpoint = self.setpoint.towards(wanted, rate, speed, dt_s)
        throttle = clamp(setpoint / full_throttle_speed, -1.0, 1.0) if full_throttle_speed > EPSILON else 0.0
        if abs(setpoint) > EPSILON:
            throttle += self.pid.update(setpoint - speed, *gains, 1.0, dt_s)
        else:
            self.pid.integral = 0.0
        return clamp(throttle, -1.0, 1.0)


class HeadingControl:
    """Heading to yaw rate: slew rate around the circle, then proportional (attitudeControl)."""

    def __init__(self) -> None:
        self.setpoint = 0.0

    def update(self, wanted: float, yaw: float, slew_rate: float, gain: float, limit: float, dt_s: float) -> float:
        """Yaw rate in rad/s for a wanted heading in rad."""
        setpoint = wanted = wrap_pi(wanted)
        if slew_rate > EPSILON:
            setpoint = self.setpoint + clamp(wrap_pi(wanted - self.setpoint), -slew_rate * dt_s, slew_rate * dt_s)
            if abs(wrap_pi(setpoint - yaw)) > abs(wrap_pi(wanted - yaw)):
                setpoint = wanted
        self.setpoint = setpoint
        return clamp(gain * wrap_pi(setpoint - yaw), -limit, limit)


def corner_angle(before: tuple[float, float], corner: tuple[float, float], after: tuple[float, float]) -> float:
    """Angle between two legs, π for straight on, NaN where a leg has no length (calcWaypointTransitionAngle)."""
    in_n, in_e = before[0] - corner[0], before[1] - corner[1]
    out_n, out_e = after[0] - corner[0], after[1] - corner[1]
    into, out = math.hypot(in_n, in_e), math.hypot(out_n, out_e)
    if not (into >= EPSILON and out >= EPSILON):
        return math.nan
    return math.acos(clamp((in_n * out_n + in_e * out_e) / (into * out), -1.0, 1.0))


def reduced_speed(full_throttle_speed: float, error_rad: float, reduction: float) -> float:
    """What RO_SPEED_RED leaves of the speed at full throttle: all for no error, `reduction` less for half a turn."""
    share = clamp(reduction * clamp(error_rad / math.pi, 0.0, 1.0), 0.0, 1.0)
    return full_throttle_speed * (1.0 - share)


def arrival_speed(
    angle_rad: float, full_throttle_speed: float, reduction: float, least_speed: float, cruising_speed: float
) -> float:
    """Speed for a corner with this angle between the legs (π: straight on; NaN: it ends there), by RO_SPEED_RED."""
    if math.isnan(angle_rad):
        return 0.0
    if reduction <= EPSILON:
        return cruising_speed
    return clamp(reduced_speed(full_throttle_speed, math.pi - angle_rad, reduction), least_speed, cruising_speed)


def speed_limited_by_course(
    wanted: float, course_error_rad: float, full_throttle_speed: float, reduction: float, least_speed: float
) -> float:
    """The wanted speed, reduced while the vehicle does not head where it is to go (RO_SPEED_RED)."""
    if reduction <= EPSILON:
        return wanted
    reduced = reduced_speed(full_throttle_speed, abs(wrap_pi(course_error_rad)), reduction)
    limit = clamp(reduced, least_speed, full_throttle_speed)
    return clamp(wanted, -limit, limit)


def clamp(value: float, least: float, most: float) -> float:
    """PX4's math::constrain: the lower bound goes first, even where it is above the upper one."""
    return least if value < least else most if value > most else value
