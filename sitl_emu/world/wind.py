"""Wind: the velocity of the air over ground, NED; a mean and gusts.

Gusts are Gauss-Markov processes per axis, the scalar form of the Dryden spectrum: correlation time L/V with the
length scale of MIL-F-8785C near the ground, standard deviation as given (vertical: half of it). The same everywhere in
the world at a time, so all vehicles of one world may share one `Wind`; `at(time_us)` steps it by whole TICKs of
simulated time and so does not depend on who asks how often.
Directions: `north_m_s` is where the air moves to, not where the wind comes from. (PX4's SIH_WIND_N has the other sign:
SIH adds it to the vehicle's velocity, so that +4 is air that moves south; `VehicleSimulator.sih_wind_n` follows PX4.)
"""

import math

from sitl_emu.world.noise import GaussMarkov, normals

TICK_US = 20_000
LENGTH_SCALE_M = 60.0


class Wind:
    """Mean wind with gusts; (0, 0, 0) at once when both are zero."""

    def __init__(self, north_m_s: float = 0.0, east_m_s: float = 0.0, gust_m_s: float = 0.0, seed: int = 0) -> None:
        """`gust_m_s`: standard deviation of the horizontal gusts, per axis."""
        self._mean = (north_m_s, east_m_s)
        self.calm = north_m_s == east_m_s == gust_m_s == 0.0
        time_s = LENGTH_SCALE_M / max(math.hypot(north_m_s, east_m_s), 3.0)
        dt_s = TICK_US * 1e-6
        sigmas = {"north": gust_m_s, "east": gust_m_s, "down": 0.5 * gust_m_s}
        self._gusts = [GaussMarkov(sigma, time_s, dt_s, normals(seed, "wind", axis)) for axis, sigma in sigmas.items()]
        self._next_us = 0
        self._now = (north_m_s, east_m_s, 0.0)

    def at(self, time_us: int) -> tuple[float, float, float]:
        """Velocity of the air (north, east, down; m/s) at a time, which must not go backwards."""
        while time_us >= self._next_us:
            self._next_us += TICK_US
            north, east, down = (gust.step() for gust in self._gusts)
            self._now = (self._mean[0] + north, self._mean[1] + east, down)
        return self._now
