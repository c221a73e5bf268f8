"""A smooth way up or down by a stick: PX4's ManualVelocitySmoothingZ (src/lib/motion_planning, v1.18).

Where the stick is centred and the vehicle has come to rest, its height is held; `position` is NaN until then.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON, VelocitySmoothing
from sitl_emu.autopilot.topics import NAN

AT_REST_M_S: Final = 0.1
AT_REST_M_S2: Final = 0.2


class ClimbLimits(NamedTuple):
    """m/s, m/s² and m/s³."""

    speed_up: float
    speed_down: float
    acceleration_up: float
    acceleration_down: float
    jerk: float


class ClimbSmoothing:
    """Of one vehicle; metres and seconds, down."""

    def __init__(self) -> None:
        self._trajectory = VelocitySmoothing()
        self.position = NAN
        """Where it is held; NaN while it moves."""

    def go_on(self, position: float, velocity: float, acceleration: float) -> None:
        """From there, with the plan as it is: on the ground, where this comes at every update, it still moves a step
        along it (ManualVelocitySmoothingZ::reset)."""
        self._trajectory.force_state(position, velocity, acceleration)
        self.position = NAN

    @property
    def velocity(self) -> float:
        """Setpoint."""
        return self._trajectory.velocity

    @property
    def acceleration(self) -> float:
        """Setpoint."""
        return self._trajectory.acceleration

    def force_position(self, position: float) -> None:
        """Be elsewhere; a held height is that, then."""
        self._trajectory.force_position(position)
        if self.position == self.position:
            self.position = position

    def force_velocity(self, velocity: float) -> None:
        """Be faster or slower."""
        self._trajectory.force_velocity(velocity)

    def update(self, dt_s: float, velocity: float, position: float, feedback: float, limits: ClimbLimits) -> None:
        """One step towards a velocity. `position`: the vehicle's; `feedback`: the velocity that its position
        controller asked for last, with which it goes on when a height is held no more."""
        way = self._trajectory
        way.max_jerk = limits.jerk
        way.update_trajectory(dt_s)
        upwards = velocity < 0.0
        way.max_acceleration = limits.acceleration_up if upwards else limits.acceleration_down
        way.max_velocity = limits.speed_up if upwards else limits.speed_down
        if abs(velocity) <= EPSILON and abs(way.velocity) < AT_REST_M_S and abs(way.acceleration) < AT_REST_M_S2:
            self.position = way.position
        else:
            if self.position == self.position:
                self.position = NAN
                if math.isfinite(feedback):
                    way.force_velocity(feedback)
            way.force_position(position)
        way.update_durations(velocity)
