"""Seeded noise: one generator per source, derived from the run's seed and the names of vehicle and sensor.

Numbers are drawn in blocks from numpy's PCG64 and handed out one by one, which costs about 0.05 µs each.
"""

import hashlib
import math
from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

BLOCK: Final = 1024


def generator(seed: int, *names: str) -> np.random.Generator:
    """Generator of one source, such as (7, "uas", "gps"); other names give independent ones."""
    digest = hashlib.sha256("/".join((str(seed), *names)).encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "big"))


def normals(seed: int, *names: str) -> Callable[[], float]:
    """A function that returns the next standard normal number of a source."""
    return _blocks(generator(seed, *names)).__next__


def _blocks(random: np.random.Generator) -> Iterator[float]:
    while True:
        yield from random.standard_normal(BLOCK).tolist()


class GaussMarkov:
    """First-order Gauss-Markov process: exponentially correlated with `time_s`, standard deviation `sigma`.

    Starts in its stationary distribution; `step` advances by the fixed `dt_s`.
    """

    __slots__ = ("_draw", "_keep", "_kick", "value")

    def __init__(self, sigma: float, time_s: float, dt_s: float, draw: Callable[[], float]) -> None:
        self._keep = math.exp(-dt_s / time_s)
        self._kick = sigma * math.sqrt(1.0 - self._keep * self._keep)
        self._draw = draw
        self.value = sigma * draw()

    def step(self) -> float:
        """The next value."""
        self.value = self._keep * self.value + self._kick * self._draw()
        return self.value
