"""One axis of a trajectory: velocity reached with limited acceleration and jerk, in the least time.

Behaves as PX4's `VelocitySmoothing` (src/lib/motion_planning, v1.18): from the present state to a velocity setpoint in
three phases of jerk +J, 0, -J lasting T1, T2, T3, planned anew at every call. Several axes are made to end together by
stretching the shorter ones. It does not plan to a position: `position_smoothing.py` chooses the velocities that do.
"""

import math
from typing import Final

EPSILON: Final = 1.2e-7
"""Single-precision epsilon, the size below which PX4 takes a number for zero."""
LEAST_JERK: Final = 1e-3
"""m/s³; with none at all nothing could be planned."""


class VelocitySmoothing:
    """State (position, velocity, acceleration, jerk) and plan of one axis; metres or radians, seconds."""

    __slots__ = (
        "_a0",
        "_direction",
        "_t1",
        "_t2",
        "_t3",
        "_time_s",
        "_v0",
        "_x0",
        "acceleration",
        "jerk",
        "max_acceleration",
        "max_jerk",
        "max_velocity",
        "position",
        "velocity",
        "velocity_setpoint",
    )

    def __init__(self, max_velocity: float = math.inf) -> None:
        self.max_jerk = 8.0
        self.max_acceleration = 3.0
        self.max_velocity = max_velocity
        self.reset(0.0, 0.0, 0.0)

    def reset(self, position: float, velocity: float, acceleration: float) -> None:
        """Go on from this state, with nothing planned: as one that PX4 makes anew."""
        self.force_state(position, velocity, acceleration)
        self.velocity_setpoint = velocity
        self._direction = 0.0
        self._t1 = self._t2 = self._t3 = self._time_s = 0.0

    def force_state(self, position: float, velocity: float, acceleration: float) -> None:
        """Be elsewhere and move otherwise, with the plan as it is (VelocitySmoothing::reset)."""
        self.position = self._x0 = position
        self.velocity = self._v0 = velocity
        self.acceleration = self._a0 = acceleration
        self.jerk = 0.0

    def force_position(self, position: float) -> None:
        """Be elsewhere, with the plan as it is."""
        self.position = self._x0 = position

    def force_velocity(self, velocity: float) -> None:
        """Be faster or slower from the next plan on."""
        self.velocity = self._v0 = velocity

    @property
    def total_time_s(self) -> float:
        """Duration of the plan."""
        return self._t1 + self._t2 + self._t3

    def update_trajectory(self, dt_s: float) -> None:
        """Move `dt_s` along the plan."""
        self._time_s = remaining = self._time_s + dt_s
        x, v, a, j = self._x0, self._v0, self._a0, 0.0
        if self._direction:
            jerk = self._direction * self.max_jerk
            t = min(remaining, self._t1)
            if t > 0.0:
                x += t * (v + t * (0.5 * a + t * jerk / 6.0))
                v += t * (a + 0.5 * jerk * t)
                a += jerk * t
                j = jerk
                remaining -= t
            if remaining > 0.0 and self._t2 > 0.0:
                t = min(remaining, self._t2)
                x += t * (v + 0.5 * a * t)
                v += a * t
                j = 0.0
                remaining -= t
            if remaining > 0.0 and self._t3 > 0.0:
                t = min(remaining, self._t3)
                x += t * (v + t * (0.5 * a - t * jerk / 6.0))
                v += t * (a - 0.5 * jerk * t)
                a -= jerk * t
                j = -jerk
                remaining -= t
            if remaining > 0.0:
                x += v * remaining
                a = j = 0.0
        else:
            # Nothing is planned, so that there is no acceleration either, but for the first step after a reset.
            x += remaining * (v + 0.5 * a * remaining)
            v += a * remaining
        self.position, self.velocity, self.acceleration, self.jerk = x, v, a, j

    def update_durations(self, velocity_setpoint: float) -> None:
        """Plan from the present state to a velocity (with no acceleration), within the limits, in the least time."""
        limit = self.max_velocity
        target = self.velocity_setpoint = max(-limit, min(limit, velocity_setpoint))
        self._time_s = 0.0
        self._x0, v0, a0 = self.position, self.velocity, self.acceleration
        self._v0, self._a0 = v0, a0
        max_jerk = self.max_jerk = max(self.max_jerk, LEAST_JERK)
        # Velocity at which the acceleration would have been taken away as fast as it can be.
        coasting = v0 + 0.5 * a0 * abs(a0) / max_jerk
        missing = target - coasting
        if missing > EPSILON:
            direction = 1.0
        elif missing < -EPSILON:
            direction = -1.0
        elif a0:
            direction = math.copysign(1.0, a0)
        else:
            self._direction = self._t1 = self._t2 = self._t3 = 0.0
            return
        self._direction = direction
        jerk = direction * max_jerk
        delta_v = target - v0
        t1 = _t1_least(a0, delta_v, jerk, self.max_acceleration)
        t3 = max(a0 / jerk + t1, 0.0)
        peak = a0 + jerk * t1
        t2 = 0.0
        if abs(peak) > EPSILON:
            t2 = (-0.5 * t1 * t1 * jerk - t1 * t3 * jerk - t1 * a0 + 0.5 * t3 * t3 * jerk - t3 * a0 + delta_v) / peak
        self._t1, self._t2, self._t3 = t1, max(t2, 0.0), t3

    def stretch_durations(self, total_s: float) -> None:
        """Reach the same velocity setpoint in a longer time than the plan needs."""
        jerk = self._direction * self.max_jerk
        if not jerk:
            return
        a0 = self._a0
        t1 = _t1_within(total_s, a0, self.velocity_setpoint - self._v0, jerk, self.max_acceleration)
        t3 = max(a0 / jerk + t1, 0.0)
        self._t1, self._t3 = t1, t3
        self._t2 = max(total_s - t1 - t3, 0.0)


def time_synchronization(axes: tuple[VelocitySmoothing, ...]) -> None:
    """Stretch the plans of all axes to the duration of the longest."""
    longest = max(axes, key=lambda axis: axis.total_time_s)
    total_s = longest.total_time_s
    if total_s > EPSILON:
        for axis in axes:
            if axis is not longest:
                axis.stretch_durations(total_s)


def _t1_least(a0: float, delta_v: float, jerk: float, max_acceleration: float) -> float:
    """Duration of the first phase when the whole is to last as short as it can."""
    delta = 2.0 * a0 * a0 + 4.0 * jerk * delta_v
    if delta < 0.0:
        return 0.0
    root = 0.5 * math.sqrt(delta)
    t1 = (root - a0) / jerk
    if t1 < 0.0 or a0 / jerk + t1 < 0.0:
        t1 = (-root - a0) / jerk
        if t1 < 0.0 or a0 / jerk + t1 < 0.0:
            t1 = 0.0
    return max(_saturated(t1, a0, jerk, max_acceleration), 0.0)


def _t1_within(total_s: float, a0: float, delta_v: float, jerk: float, max_acceleration: float) -> float:
    """Duration of the first phase when the whole is to last `total_s`."""
    reach = total_s * jerk
    delta = reach * reach + 2.0 * reach * a0 - a0 * a0 - 4.0 * jerk * delta_v
    if delta < 0.0:
        return 0.0
    root = math.sqrt(delta)
    plus = max((reach - a0 - root) / (2.0 * jerk), 0.0)
    minus = max((reach - a0 + root) / (2.0 * jerk), 0.0)
    t1 = 0.0
    if plus + max(a0 / jerk + plus, 0.0) > total_s:
        t1 = minus
    elif minus + max(a0 / jerk + minus, 0.0) > total_s:
        t1 = plus
    return _saturated(t1, a0, jerk, max_acceleration)


def _saturated(t1: float, a0: float, jerk: float, max_acceleration: float) -> float:
    """A first phase no longer than the acceleration limit allows; negative when it is exceeded already."""
    peak = a0 + jerk * t1
    if peak > max_acceleration:
        return (max_acceleration - a0) / jerk
    if peak < -max_acceleration:
        return (-max_acceleration - a0) / jerk
    return t1
