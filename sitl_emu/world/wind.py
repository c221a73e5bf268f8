"""Wind: the velocity of the air over ground, NED; a mean and gusts.

Gusts are Gauss-Markov processes per axis, the scalar form of the Dryden spectrum: correlation time L/V with the
length scale of MIL-F-8785C near the ground, standard deviation as given (vertical: half of it). The gusts are the same
everywhere in the world at a time, so all vehicles of one world may share one `Wind`; `at` steps it by whole TICKs of
simulated time and so does not depend on who asks how often. The mean may grow with height (a power law), and change.
Directions: `north_m_s` is where the air moves to, not where the wind comes from. (PX4's SIH_WIND_N has the other sign:
SIH adds it to the vehicle's velocity, so that +4 is air that moves south; `VehicleSimulator.sih_wind_n` follows PX4.)
"""

import itertools
import math
from collections.abc import Sequence
from typing import Final

from sitl_emu.world.noise import GaussMarkov, normals

TICK_US: Final = 20_000
LENGTH_SCALE_M: Final = 60.0


LEAST_HEIGHT_M: Final = 0.1
"""Below it the mean wind is as at it: a power law would have none at the ground."""


class Wind:
    """Mean wind with gusts; (0, 0, 0) at once when there is none at any time."""

    def __init__(
        self,
        north_m_s: float = 0.0,
        east_m_s: float = 0.0,
        gust_m_s: float = 0.0,
        seed: int = 0,
        profile: tuple[float, float] = (0.0, 10.0),
        changes: tuple[tuple[int, float, float], ...] = (),
    ) -> None:
        """`gust_m_s`: standard deviation of the horizontal gusts, per axis.

        `profile`: exponent of the power law, and the height (m) at which the mean is as given. `changes`: (time_us,
        north_m_s, east_m_s) by time; the mean goes evenly from one to the next.
        """
        self._changes = ((0, north_m_s, east_m_s), *changes)
        self._mean = (north_m_s, east_m_s)
        self._exponent, self._reference_m = profile
        self.grows_with_height = self._exponent > 0.0
        fastest = max(math.hypot(north, east) for _, north, east in self._changes)
        self.calm = fastest == gust_m_s == 0.0
        time_s = LENGTH_SCALE_M / max(fastest, 3.0)
        dt_s = TICK_US * 1e-6
        sigmas = {"north": gust_m_s, "east": gust_m_s, "down": 0.5 * gust_m_s}
        self._gusts = [GaussMarkov(sigma, time_s, dt_s, normals(seed, "wind", axis)) for axis, sigma in sigmas.items()]
        self._gust = (0.0, 0.0, 0.0)
        self._next_us = 0

    def at(self, time_us: int, height_m: float = 10.0) -> tuple[float, float, float]:
        """Velocity of the air (north, east, down; m/s) at a height over ground; times must not go backwards."""
        while time_us >= self._next_us:
            if len(self._changes) > 1:
                self._mean = mean_at(self._changes, self._next_us)
            self._next_us += TICK_US
            north, east, down = (gust.step() for gust in self._gusts)
            self._gust = (north, east, down)
        share = 1.0
        if self._exponent:
            share = (max(height_m, LEAST_HEIGHT_M) / self._reference_m) ** self._exponent
        (north, east), (gust_n, gust_e, gust_d) = self._mean, self._gust
        return share * north + gust_n, share * east + gust_e, gust_d


def mean_at(changes: Sequence[tuple[float, float, float]], time: float) -> tuple[float, float]:
    """The mean (north, east; m/s) at a time, of (time, north, east) by time, all times of one unit, the first 0."""
    for (start, n0, e0), (end, n1, e1) in itertools.pairwise(changes):
        if time < end:
            share = (time - start) / (end - start)
            return n0 + share * (n1 - n0), e0 + share * (e1 - e0)
    return changes[-1][1:]
