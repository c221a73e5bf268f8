"""Sticks as the flight modes take them (PX4 v1.18's Sticks, StickYaw): dead zone, curve, heading frame, yaw hold."""

import math

from sitl_emu.autopilot.topics import ManualControlSetpoint
from sitl_emu.core.geodesy import wrap_pi

EXPONENTIAL = 0.6
"""Share of the cube in the curve of a stick."""
RATE_EPSILON = 1.2e-7


def expo_deadzone(value: float, dead_zone: float) -> float:
    """A stick of -1..1 with a dead zone around its centre and less effect near it."""
    size = abs(value)
    if size <= dead_zone:
        return 0.0
    moved = math.copysign((size - dead_zone) / (1.0 - dead_zone), value)
    return (1.0 - EXPONENTIAL) * moved + EXPONENTIAL * moved * moved * moved


def heading_frame(forward: float, right: float, heading: float) -> tuple[float, float]:
    """(north, east) of a stick deflection of at most length 1, seen from the vehicle's heading."""
    length = math.sqrt(forward * forward + right * right)
    if length > 1.0:
        forward, right = forward / length, right / length
    cosine, sine = math.cos(heading), math.sin(heading)
    return cosine * forward - sine * right, sine * forward + cosine * right


def centred(sticks: ManualControlSetpoint) -> ManualControlSetpoint:
    """The sticks, at their centre while there are none."""
    return sticks if sticks.valid else ManualControlSetpoint()


class StickYaw:
    """Yaw stick to yaw rate; the heading is held when it is let go."""

    def __init__(self) -> None:
        self.max_rate = 0.0
        self.time_constant_s = 0.0
        self.yaw = math.nan
        self.yawspeed = 0.0

    def reset(self, yaw: float) -> None:
        """Hold this heading."""
        self.yaw, self.yawspeed = wrap_pi(yaw), 0.0

    def update(self, stick: float, heading: float, dt_s: float) -> None:
        """`yaw` (NaN while turning) and `yawspeed` for a stick of -1..1."""
        wanted = stick * self.max_rate
        self.yawspeed += (wanted - self.yawspeed) * dt_s / (max(self.time_constant_s, 0.0) + dt_s)
        if abs(self.yawspeed) > RATE_EPSILON:
            self.yaw = math.nan
        elif math.isnan(self.yaw):
            self.yaw, self.yawspeed = heading, 0.0
