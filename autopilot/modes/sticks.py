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
Horizontal = tuple[float, float]


def expo_deadzone(value: float, dead_zone: float) -> float:
    """A stick of -1..1 with a dead zone around its centre and less effect near it."""
    size = abs(value)
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


class StickYaw:
    """Yaw stick to yaw rate; the heading is held when it is let go.

    Of PX4's it leaves out that a held heading goes along while the estimator turns its own (`unaided_heading`).
    """

    def __init__(self) -> None:
        self.max_rate = math.inf
        self.yawspeed_constraint = math.inf
        """A limit besides."""
        self.time_constant_s = 0.0
        self.yaw = math.nan
        self.yawspeed = 0.0

    def reset(self) -> None:
        """Hold the heading that it has at the next update."""
        self.yaw, self.yawspeed = math.nan, 0.0

    def turned(self, delta_heading: float) -> None:
        """The estimator's heading has jumped by so much."""
        self.yaw = wrap_pi(self.yaw + delta_heading)

    def update(self, stick: float, heading: float, dt_s: float) -> None:
        """`yaw` (NaN while turning) and `yawspeed` for a stick of -1..1."""
        wanted = stick * min(self.max_rate, self.yawspeed_constraint)
        self.yawspeed += (wanted - self.yawspeed) * dt_s / (max(self.time_constant_s, 0.0) + dt_s)
        if abs(self.yawspeed) > RATE_EPSILON:
            self.yaw = math.nan
        elif math.isnan(self.yaw):
            self.yaw, self.yawspeed = heading, 0.0
