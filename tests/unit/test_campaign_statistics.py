"""Shares, means, their intervals, and differences of pairs."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sitl_emu.run.campaign import statistics
from sitl_emu.run.campaign.statistics import Interval


def test_wilsons_interval_is_that_of_the_books() -> None:
    """18 of 20: p̂ = 0.9, z = 1.96 in Wilson (1927): (0.9 + z²/40 ± z·√(0.09/20 + z²/1600)) / (1 + z²/20)."""
    z = 1.959964
    middle, half = 0.9 + z * z / 40, z * math.sqrt(0.9 * 0.1 / 20 + z * z / 1600)
    found = statistics.share(18, 20).interval
    assert found == pytest.approx(
        Interval((middle - half) / (1 + z * z / 20), (middle + half) / (1 + z * z / 20)), abs=1e-6
    )
    assert statistics.share(0, 0).interval is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=12))
@example([0.0, 0.0, 2.8578390890245013e-213])
def test_whatever_the_values_the_mean_lies_between_least_and_greatest_and_the_interval_too(values: list[float]) -> None:
    mean = statistics.mean_of(values)
    slack = 1e-9 * max(map(abs, values)) + 1e-12
    assert mean.least - slack <= mean.mean <= mean.greatest + slack
    if mean.interval is not None:
        assert mean.least - slack <= mean.interval.low <= mean.interval.high <= mean.greatest + slack


@given(st.integers(1, 200).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of))))
def test_a_share_lies_in_its_interval_and_that_in_0_to_1(given_share: tuple[int, int]) -> None:
    count, of = given_share
    interval = statistics.share(count, of).interval
    assert interval is not None
    assert -1e-12 <= interval.low <= count / of <= interval.high <= 1.0 + 1e-12


def test_a_means_interval_holds_the_truth_19_times_in_20() -> None:
    chance, held = np.random.default_rng(7), 0
    for _ in range(60):
        interval = statistics.mean_of(list(chance.normal(3.0, 2.0, 30))).interval
        assert interval is not None
        held += interval.low <= 3.0 <= interval.high
    # 57 expected; below 50 once in 2000 (binomial, 0.95)
    assert 50 <= held <= 60


def test_the_same_values_give_the_same_interval_and_too_few_or_equal_ones_none() -> None:
    values = [1.0, 4.0, 2.0, 8.0, 5.0]
    assert statistics.mean_of(values) == statistics.mean_of(values)
    mean = statistics.mean_of(values)
    assert (mean.runs, mean.mean, mean.median, mean.least, mean.greatest) == (5, 4.0, 4.0, 1.0, 8.0)
    assert statistics.mean_of([1.0, 2.0]).interval is None
    assert statistics.mean_of([3.0] * 9).interval is None
    assert statistics.mean_of([2.0, 0.1 * 20, 1.7 + 0.3, 2.3 - 0.3]).interval is None, "but for arithmetic"
    with pytest.raises(ValueError, match="nothing"):
        statistics.mean_of([])


def test_a_difference_is_one_of_pairs() -> None:
    """World and noise of a seed are in both arms, and leave the interval."""
    one = {seed: 100.0 * seed for seed in range(10)}
    other = {seed: 100.0 * seed + 1.0 + 0.1 * (seed % 3) for seed in range(2, 14)}
    found = statistics.difference(one, other)
    assert found is not None and found.runs == 8 and found.interval is not None
    assert 1.0 <= found.interval.low <= found.mean <= found.interval.high <= 1.2
    assert statistics.difference(one, {}) is None


def test_figures_are_numbers_that_are_not_all_the_same() -> None:
    rows = [
        {"seed": 1, "arm": "a", "rmse_m": 0.5, "targets": 4, "found": True, "word": "x", "unknown": None},
        {"seed": 2, "arm": "a", "rmse_m": None, "targets": 4, "found": False, "word": "y", "unknown": None},
        {"seed": 3, "arm": "a", "rmse_m": 0.7, "targets": 4, "found": False, "word": "y", "more": 1},
    ]
    assert statistics.figures_of(rows, leave=("seed", "arm")) == ["rmse_m", "found"]
    assert statistics.values_of(rows, "rmse_m") == {1: 0.5, 3: 0.7}
