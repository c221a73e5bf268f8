"""Figures of several aircraft, by the truth: how near they came to one another, and what was served more than once."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations

from sitl_emu.missions.scoring import EventLine, Track


def separation_m(tracks: Mapping[str, Track]) -> float | None:
    """The least distance between two vehicles at any time that both have a row of; None for one alone."""
    places = [
        {time_s: (track.north_m[i], track.east_m[i], track.up_m[i]) for i, time_s in enumerate(track.time_s)}
        for _, track in sorted(tracks.items())
    ]
    apart = (
        math.dist(one[time_s], other[time_s])
        for one, other in combinations(places, 2)
        for time_s in one.keys() & other.keys()
    )
    return min(apart, default=None)


def served_twice(targets: Sequence[int | None]) -> int:
    """Parcels beyond the first of each target; `targets`: which one each parcel lies at, None: at none."""
    return sum(count - 1 for target, count in Counter(targets).items() if target is not None)


def coverage_s(events: Sequence[EventLine]) -> float | None:
    """From the first arming to the last line's end; None where no line was flown."""
    armed = [event["time_s"] for event in events if event["event"] == "armed"]
    lines = [event["time_s"] for event in events if event["event"] == "line_scanned"]
    return float(max(lines) - min(armed)) if armed and lines else None
