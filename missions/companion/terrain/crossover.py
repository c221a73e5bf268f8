"""How far the vehicle's own height has drifted, from places that were sounded more than once.

A barometer drifts by decimetres in minutes, and with it all heights that a flight tells. Where lines overlap, a place
is sounded at two times, and the difference is that of the drifts: what satellite altimetry and airborne lidar adjust
their tracks by. The drift is a line from knot to knot, begins with 0, and is held by the walk that a barometer is
expected to make. Soundings that do not fit to their place's others (a car has left, a roof and the street below it)
count for nothing: Tukey's biweight (A. E. Beaton and J. W. Tukey, The fitting of power series, 1974), begun from the
places' medians. Weights that only bound what such a sounding moves (Huber's) do not do: in a town so many lie on one
side that the drift was told 0.5 m wrong.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.terrain.soundings import Sounding

Floats = npt.NDArray[np.float64]
PLACE_M = 2.0
"""Soundings in one cell of this side are of one place."""
RELIEF_M = 0.3
"""One sigma of heights within it; ours."""
KNOT_S = 10.0
WALK_M = 0.03
"""One sigma of the drift after a second, growing with time's root: 6 Pa that are lost in 600 s (a barometer of the
class of the MS5611, vehicles/responder) are 0.35 Pa in a second, 0.03 m."""
TUKEY = 4.685
"""In sigmas: what is farther off counts for nothing (95 % as good as least squares where all is normal)."""
LEAST_TRUST = 1e-3
ROUNDS = 10
ZERO = 1e-3
"""One sigma, m, of the drift at the beginning."""


class Drift(NamedTuple):
    """Of the vehicle's height, upwards."""

    times_s: Floats
    """From the first sounding on;"""
    offsets_m: Floats
    """and between them evenly."""
    began_us: int

    def at_m(self, times_us: npt.NDArray[np.int64]) -> Floats:
        """At times; before the first and after the last as there."""
        return np.asarray(np.interp((times_us - self.began_us) / 1e6, self.times_s, self.offsets_m))


NONE = Drift(np.zeros(1), np.zeros(1), 0)


def drift_of(soundings: Sequence[Sounding]) -> Drift:
    """The most likely drift; NONE of too few soundings."""
    if len(soundings) < 2:
        return NONE
    data = np.array([one[1:5] for one in soundings], np.float64)
    times_us = np.array([one.time_us for one in soundings], np.int64)
    began_us = int(times_us.min())
    times_s = (times_us - began_us) / 1e6
    knots_s = np.arange(0.0, times_s.max() + KNOT_S, KNOT_S)
    hat = _hat(times_s, knots_s)
    _, place = np.unique(np.floor(data[:, :2] / PLACE_M), axis=0, return_inverse=True)
    place = place.reshape(-1)
    noise = 1.0 / (data[:, 3] ** 2 + RELIEF_M**2)
    walk = np.diff(np.eye(len(knots_s)), axis=0) / (WALK_M * np.sqrt(KNOT_S))
    prior = walk.T @ walk
    prior[0, 0] += 1.0 / ZERO**2
    offsets = np.zeros(len(knots_s))
    off = data[:, 2] - _medians(data[:, 2], place)[place]
    for _ in range(ROUNDS):
        weights = noise * _trust(off * np.sqrt(noise))
        across = _about_means(hat, place, weights)
        heights = _about_means(data[:, 2:3], place, weights)[:, 0]
        normal = across.T @ (weights[:, None] * across) + prior
        offsets = np.linalg.solve(normal, across.T @ (weights * heights))
        off = heights - across @ offsets
    return Drift(knots_s, offsets, began_us)


def _trust(off_sigmas: Floats) -> Floats:
    """Tukey's biweight."""
    return np.asarray(np.maximum(1.0 - (off_sigmas / TUKEY) ** 2, LEAST_TRUST) ** 2)


def _medians(values: Floats, place: npt.NDArray[np.intp]) -> Floats:
    """Of each place."""
    order = np.lexsort((values, place))
    ends = np.cumsum(np.bincount(place))
    counts = np.diff(ends, prepend=0)
    low, high = ends - counts + (counts - 1) // 2, ends - counts + counts // 2
    return np.asarray((values[order][low] + values[order][high]) / 2.0)


def without(soundings: Sequence[Sounding], drift: Drift) -> list[Sounding]:
    """The soundings as they would be without a drift."""
    offsets = drift.at_m(np.array([one.time_us for one in soundings], np.int64))
    return [
        one._replace(height_m=one.height_m - offset) for one, offset in zip(soundings, offsets.tolist(), strict=True)
    ]


def _hat(times_s: Floats, knots_s: Floats) -> Floats:
    """(times, knots): how much of each knot's offset is a time's."""
    at = np.clip(times_s / KNOT_S, 0.0, len(knots_s) - 1.0)
    below = np.minimum(np.floor(at).astype(np.intp), len(knots_s) - 2)
    rows, hat = np.arange(len(times_s)), np.zeros((len(times_s), len(knots_s)))
    hat[rows, below], hat[rows, below + 1] = 1.0 - (at - below), at - below
    return hat


def _about_means(values: Floats, place: npt.NDArray[np.intp], weights: Floats) -> Floats:
    """(n, k) values less the weighted mean of their place: a place's own height, which nobody knows, is gone."""
    total = np.zeros((int(place.max()) + 1, values.shape[1]))
    np.add.at(total, place, weights[:, None] * values)
    mean = total / np.bincount(place, weights)[:, None]
    return np.asarray(values - mean[place])
