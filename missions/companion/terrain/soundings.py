"""Heights of the ground, measured one by one: by a lidar's beam, or by rays that cross at a feature.

Metres north and east of the caller's origin, heights upwards from it. A sounding keeps apart what differs from one to
the next (noise, which averages out) and what neighbours share (the receiver's and the sensor's own lasting error, which
does not), as `geolocation.Covariance` does.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera_model import Point, Quaternion, body_to_ned
from sitl_emu.missions.companion.geolocation import HOME_HEIGHT_SIGMA_M, RAY_SIGMA_RAD, Covariance

WINDOW = 7
"""Neighbours that a sounding is judged by; ours. At 50 Hz and 5 m/s they span 0.6 m of ground."""
SPIKE_SIGMAS = 3.0
"""Hampel's usual gate, in standard deviations that the median of absolute deviations stands for."""
MAD_TO_SIGMA = 1.4826
"""Of a normal distribution: 1 / Φ⁻¹(3/4)."""
APART_US = 500_000
"""Ours: soundings further apart in time are no neighbours."""
STEEPEST_BEAM = math.cos(math.radians(45.0))
"""Ours: a beam that leans more tells a place too badly."""


class Sounding(NamedTuple):
    """A height of the ground at a place, and how well it is known."""

    time_us: int
    north_m: float
    east_m: float
    height_m: float
    sigma_m: float
    """Of the height: what differs from sounding to sounding."""
    eph_m: float
    """One sigma of the distance on the map by which the place may be off, as a receiver states it."""
    epv_m: float
    """Of the height: what lasts."""


class Beam(NamedTuple):
    """A lidar that looks down the body's axis: where it sits (forward, right, down), and its data sheet."""

    forward_m: float
    right_m: float
    down_m: float
    min_m: float
    max_m: float
    noise_m: float
    noise_share: float
    """Of the range, added to `noise_m`."""
    accuracy_m: float
    accuracy_share: float
    """Of the range; the greater of the two is the error that lasts."""


TF_LUNA = Beam(0.0, 0.0, 0.0, 0.2, 8.0, 0.005, 0.0025, 0.06, 0.02)
"""Benewake's manual SJ-PM-TF-Luna, as in vehicles/responder: ±6 cm up to 3 m, ±2 % above."""


def of_range(
    beam: Beam, time_us: int, range_m: float, position_ned_m: Point, q: Quaternion, eph_m: float, epv_m: float
) -> Sounding | None:
    """What a range tells, with the vehicle's place and attitude (body FRD to NED) at its moment.

    `eph_m`, `epv_m`: one sigma of that place. None for a range that the sensor can't measure, and for a beam that leans
    by more than 45 degrees.
    """
    body = body_to_ned(q)
    drop = float(body[2, 2])
    if not beam.min_m <= range_m <= beam.max_m or drop < STEEPEST_BEAM:
        return None
    offset = (beam.forward_m, beam.right_m, beam.down_m + range_m)
    north, east, down = (np.asarray(position_ned_m) + body @ np.asarray(offset)).tolist()
    lean = math.sqrt(max(0.0, 1.0 - drop * drop))
    noise = math.hypot((beam.noise_m + beam.noise_share * range_m) * drop, range_m * lean * RAY_SIGMA_RAD)
    lasting = math.hypot(epv_m, max(beam.accuracy_m, beam.accuracy_share * range_m) * drop)
    return Sounding(time_us, north, east, -down, noise, math.hypot(eph_m, range_m * drop * RAY_SIGMA_RAD), lasting)


def of_feature(
    time_us: int, point: Point, rays: Covariance, eph_m: float, epv_m: float, home_height_m: float = 0.0
) -> Sounding | None:
    """What rays that cross at a feature on the ground tell (`geolocation.Intersection`: its point and covariance).

    `eph_m`, `epv_m`: of the vehicle's place while it was seen. The height that every crossing begins with, home's, is
    taken out again: it is no measurement. None as long as the rays alone tell the height worse than that does.
    """
    north, east, down = point
    prior = 1.0 / HOME_HEIGHT_SIGMA_M**2
    weight = 1.0 / rays.dd - prior
    if weight < prior:
        return None
    height = (-down / rays.dd - home_height_m * prior) / weight
    return Sounding(
        time_us, north, east, height, 1.0 / math.sqrt(weight), math.hypot(eph_m, rays.horizontal_sigma_m), epv_m
    )


def believed(soundings: Sequence[Sounding], lowest_m: float = -math.inf, highest_m: float = math.inf) -> list[Sounding]:
    """The soundings of one sensor, in the order of their times, without those that can't be.

    That is: a height beyond the limits; one that lies further from the median of its neighbours than
    `SPIKE_SIGMAS` of what their median absolute deviation stands for, and of its own noise (Hampel's filter, which
    keeps steps: the side that a sounding lies on has the majority about it); and one that has no neighbours.
    """
    kept = [one for one in soundings if lowest_m <= one.height_m <= highest_m]
    return [one for group in _neighbours(kept) if len(group) >= 3 for one in _without_spikes(group)]


def _neighbours(soundings: Sequence[Sounding]) -> Iterator[list[Sounding]]:
    group: list[Sounding] = []
    for one in soundings:
        if group and one.time_us - group[-1].time_us > APART_US:
            yield group
            group = []
        group.append(one)
    yield group


def _without_spikes(group: Sequence[Sounding]) -> list[Sounding]:
    heights = np.array([one.height_m for one in group])
    noise = np.array([one.sigma_m for one in group])
    window = min(WINDOW, len(group))
    views: npt.NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(heights, window)
    medians = np.median(views, axis=1)
    spreads = MAD_TO_SIGMA * np.median(np.abs(views - medians[:, None]), axis=1)
    # at either end the window is that of the nearest one that has a whole one
    at = np.clip(np.arange(len(group)) - window // 2, 0, len(views) - 1)
    keep = np.abs(heights - medians[at]) <= SPIKE_SIGMAS * np.maximum(spreads[at], noise)
    return [one for one, good in zip(group, keep, strict=True) if good]
