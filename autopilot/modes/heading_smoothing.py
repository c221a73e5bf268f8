"""Heading that turns with limited rate and acceleration (PX4's `HeadingSmoothing`, MPC_YAWRAUTO_MAX, _ACC).

A `VelocitySmoothing` whose "velocity" is the heading: its acceleration limit is the rate's, its jerk limit the
acceleration's.
"""

import math

from sitl_emu.autopilot.modes.velocity_smoothing import LEAST_JERK, VelocitySmoothing
from sitl_emu.core.geodesy import wrap_pi


class HeadingSmoothing:
    """Smoothed `heading` (rad, -π..π) and `rate` (rad/s)."""

    def __init__(self) -> None:
        self._smoothing = VelocitySmoothing(max_velocity=math.tau)

    @property
    def heading(self) -> float:
        """Where to look now."""
        return self._smoothing.velocity

    @property
    def rate(self) -> float:
        """How fast the heading changes."""
        return self._smoothing.acceleration

    def set_limits(self, rate_rad_s: float, acceleration_rad_s2: float) -> None:
        """Limits of the turn."""
        self._smoothing.max_acceleration = rate_rad_s
        self._smoothing.max_jerk = max(acceleration_rad_s2, LEAST_JERK)

    def reset(self, heading: float, rate: float = 0.0) -> None:
        """Go on from this heading and rate."""
        self._smoothing.reset(0.0, wrap_pi(heading), rate)

    def turned(self, delta_heading: float) -> None:
        """The estimator's heading has jumped by so much; it goes on to turn as it did."""
        self._smoothing.force_velocity(wrap_pi(self.heading + delta_heading))

    def rest(self, dt_s: float) -> None:
        """One step towards wherever it can stop first."""
        rate = self.rate
        self.update(self.heading + 0.5 * rate * abs(rate) / self._smoothing.max_jerk, dt_s)

    def update(self, heading_setpoint: float, dt_s: float) -> None:
        """One step towards a heading, the short way round."""
        smoothing, heading = self._smoothing, self.heading
        smoothing.update_durations(heading + wrap_pi(heading_setpoint - heading))
        smoothing.update_trajectory(dt_s)
        smoothing.velocity = wrap_pi(smoothing.velocity)
