"""Sticks as the flight modes take them (PX4 v1.18's Sticks, StickTiltXY, StickYaw): dead zone, curve, frame, yaw."""

import math
from typing import Final

from sitl_emu.autopilot.topics import ManualControlSetpoint
from sitl_emu.core.geodesy import wrap_pi

EXPONENTIAL: Final = 0.6
"""Share of the cube in the curve of a stick."""
RATE_EPSILON: Final = 1.2e-7
GRAVITY: Final = 9.80665
LEAST_TILT, MOST_TILT = 0.02, 3.0
"""Tangents within which MPC_MAN_TILT_MAX counts."""
CONVERGES_RAD: Final = math.radians(1.0)
CONVERGES_S: Final = 1.0
"""StickYaw.hpp: _kYawErrorChangeThreshold and _kYawErrorTimeConstant."""
Horizontal = tuple[float, float]


MOST_DEAD: Final = 0.99
"""Of a stick's way, whatever MAN_DEADZONE says (math::deadzone)."""


def expo_deadzone(value: float, dead_zone: float) -> float:
    """A stick of -1..1 with a dead zone around its centre and less effect near it."""
    size, dead_zone = abs(value), min(dead_zone, MOST_DEAD)
    if size <= dead_zone:
        return 0.0
    moved = math.copysign((size - dead_zone) / (1.0 - dead_zone), value)
    return (1.0 - EXPONENTIAL) * moved + EXPONENTIAL * moved * moved * moved


def within_unit_length(forward: float, right: float) -> Horizontal:
    """A deflection of at most length 1."""
    length = math.sqrt(forward * forward + right * right)
    return (forward / length, right / length) if length > 1.0 else (forward, right)


def north_east(forward: float, right: float, heading: float) -> Horizontal:
    """(north, east) of what is seen from a heading."""
    cosine, sine = math.cos(heading), math.sin(heading)
    return cosine * forward - sine * right, sine * forward + cosine * right


def low_passed(value: Horizontal, to: Horizontal, time_constant_s: float, dt_s: float) -> Horizontal:
    """One step of a filter (AlphaFilter); none without a time constant."""
    share = dt_s / (max(time_constant_s, 0.0) + dt_s)
    return value[0] + (to[0] - value[0]) * share, value[1] + (to[1] - value[1]) * share


def centred(sticks: ManualControlSetpoint) -> ManualControlSetpoint:
    """The sticks, at their centre while there are none."""
    return sticks if sticks.valid else ManualControlSetpoint()


def acceleration_at(tilt_max_deg: float) -> float:
    """Horizontal acceleration, m/s², at a full stick (MPC_MAN_TILT_MAX)."""
    tangent = math.tan(math.radians(max(0.0, min(89.0, tilt_max_deg))))
    return max(LEAST_TILT, min(MOST_TILT, tangent)) * GRAVITY


class TurningEstimate:
    """Whether it is the estimator that turns the heading, and not the vehicle (StickYaw::updateYawCorrection).

    What the gyroscopes alone make of the heading (unaided_heading) drifts slowly from the estimate. Where the two part
    quickly, it is the estimate that is on its way to another heading: `turned_rad` tells how far it has come.
    """

    def __init__(self) -> None:
        self.turned_rad = 0.0
        self._usual = self._before = 0.0
        """The difference of the two headings: low-passed, and as it was before the estimate turned."""
        self._is_turning = self._was_unknown = False

    def reset(self, heading: float, unaided: float) -> None:
        """Whatever the difference is, it is the usual one."""
        if math.isfinite(unaided):
            self._usual = wrap_pi(heading - unaided)

    def jumped(self, delta_heading: float) -> None:
        """The estimate has jumped, and that was told."""
        self._usual, self._before = wrap_pi(self._usual + delta_heading), wrap_pi(self._before + delta_heading)

    def update(self, heading: float, unaided: float, dt_s: float) -> bool:
        """One step; true where a heading is to be held anew, as the estimate has come to its end."""
        if not math.isfinite(unaided):
            self._was_unknown = True
            return False
        difference = wrap_pi(heading - unaided)
        if self._was_unknown:
            self._usual = self._before = difference
            self._is_turning = self._was_unknown = False
            self.turned_rad = 0.0
            return True
        excess = wrap_pi(difference - self._usual)
        self._usual += (difference - self._usual) * dt_s / (CONVERGES_S + dt_s)
        was_turning, self._is_turning = self._is_turning, abs(excess) > CONVERGES_RAD
        if not self._is_turning:
            self._before = difference
        self.turned_rad = wrap_pi(difference - self._before)
        return was_turning and not self._is_turning


class StickYaw:
    """Yaw stick to yaw rate; the heading is held when it is let go.

    While the estimator turns its own, the one that is held goes along, and the vehicle stays as it is.
    """

    def __init__(self) -> None:
        self.max_rate = math.inf
        self.yawspeed_constraint = math.inf
        """A limit besides."""
        self.time_constant_s = 0.0
        self.yaw = math.nan
        self.yawspeed = 0.0
        self._estimate = TurningEstimate()

    def reset(self, heading: float = math.nan, unaided: float = math.nan) -> None:
        """Hold the heading that it has at the next update."""
        self.yaw, self.yawspeed = math.nan, 0.0
        self._estimate.reset(heading, unaided)

    def turned(self, delta_heading: float) -> None:
        """The estimator's heading has jumped by so much."""
        self.yaw = wrap_pi(self.yaw + delta_heading)
        self._estimate.jumped(delta_heading)

    def update(self, stick: float, heading: float, dt_s: float, unaided: float = math.nan) -> None:
        """`yaw` (NaN while turning) and `yawspeed` for a stick of -1..1; `unaided`: heading by the gyroscopes alone."""
        turned_before = self._estimate.turned_rad
        if self._estimate.update(heading, unaided, dt_s):
            self.yaw = math.nan
        wanted = stick * min(self.max_rate, self.yawspeed_constraint)
        self.yawspeed += (wanted - self.yawspeed) * dt_s / (max(self.time_constant_s, 0.0) + dt_s)
        if abs(self.yawspeed) > RATE_EPSILON:
            self.yaw = math.nan
        elif math.isnan(self.yaw):
            self.yaw, self.yawspeed = heading, 0.0
        elif self._estimate.turned_rad != turned_before:
            self.yaw = wrap_pi(self.yaw + self._estimate.turned_rad - turned_before)
