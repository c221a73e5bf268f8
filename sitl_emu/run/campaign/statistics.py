"""What the runs of an arm say together: shares and means with their 95 % intervals, and differences between arms.

A share's interval is Wilson's, a mean's is bootstrapped (BCa), both by scipy. Arms fly the same seeds, so that a
difference is one of pairs: world and noise are the same in both, and leave the interval. The bootstrap's own chance is
seeded: the same runs give the same tables.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
FEWEST = 3
"""Values of which an interval is made; of fewer there is none."""
RESAMPLES = 5000
ROUNDING, NOTHING = 1e-9, 1e-100
"""Of the greatest value: what differs by less is the same, but for arithmetic. A spread whose cubes vanish is none."""
SEED = 1
Row = Mapping[str, Any]


class Interval(NamedTuple):
    """From where to where, at 95 %."""

    low: float
    high: float


class Share(NamedTuple):
    """So many of so many."""

    having: int
    of: int
    interval: Interval | None
    """None of nothing."""


class Mean(NamedTuple):
    """A figure over the runs that have it."""

    runs: int
    mean: float
    interval: Interval | None
    """None of too few values, or where all are the same."""
    median: float
    least: float
    greatest: float


def share(count: int, of: int) -> Share:
    """With Wilson's interval."""
    if not of:
        return Share(count, of, None)
    low, high = stats.binomtest(count, of).proportion_ci(CONFIDENCE, method="wilson")
    return Share(count, of, Interval(float(low), float(high)))


def mean_of(values: Sequence[float]) -> Mean:
    """With a bootstrapped interval. Raises ValueError for no values."""
    if not values:
        raise ValueError("the mean of nothing")
    return Mean(
        len(values),
        float(np.mean(values)),
        _interval(values),
        float(np.median(values)),
        float(min(values)),
        float(max(values)),
    )


def difference(one: Mapping[int, float], other: Mapping[int, float]) -> Mean | None:
    """How much greater a figure is in the other arm, by the seeds that both have; None where these are none."""
    pairs = [other[seed] - one[seed] for seed in sorted(one.keys() & other.keys())]
    return mean_of(pairs) if pairs else None


def figures_of(rows: Sequence[Row], leave: Sequence[str]) -> list[str]:
    """The columns that are figures: numbers or yes and no, which are not the same in all rows."""
    names = dict.fromkeys(name for row in rows for name in row if name not in leave)
    found = list[str]()
    for name in names:
        there = [row[name] for row in rows if row.get(name) is not None]
        if there and all(_is_number(value) for value in there) and len(set(there)) > 1:
            found.append(name)
    return found


def values_of(rows: Sequence[Row], name: str) -> dict[int, float]:
    """A figure by seed, where it is known."""
    return {row["seed"]: float(row[name]) for row in rows if row.get(name) is not None}


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int | float) and math.isfinite(value)


def _interval(values: Sequence[float]) -> Interval | None:
    if len(values) < FEWEST or max(values) - min(values) <= max(ROUNDING * max(map(abs, values)), NOTHING):
        return None
    found = stats.bootstrap(
        (np.asarray(values, float),),
        np.mean,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        method="BCa",
        rng=np.random.default_rng(SEED),
    ).confidence_interval
    return Interval(float(found.low), float(found.high))
