"""What of a mapped height is ground: slopes, hills and hollows, and no car, roof or corner that was confused."""

import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.missions.companion.terrain.ground import about, ground, ground_on_hills, spread

RESOLUTION_M = 1.0


def sloping(rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """40 m of ground that rises by 0.1, half of it mapped."""
    return np.where(rng.random((40, 40)) < 0.5, 0.1 * np.arange(40.0) + rng.normal(scale=0.1, size=(40, 40)), np.nan)


def test_sloping_ground_is_ground() -> None:
    means = sloping(np.random.default_rng(7))
    assert np.array_equal(ground(means, RESOLUTION_M), means, equal_nan=True)


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.3])
def test_a_hill_is_ground_and_the_house_on_it_is_not(slope: float) -> None:
    rng = np.random.default_rng(7)
    hill = np.where(rng.random((60, 60)) < 0.3, 10.0 * slope * np.sin(np.arange(60.0) / 10.0), np.nan)
    means = hill + rng.normal(scale=0.1, size=hill.shape)
    house = np.zeros(means.shape, bool)
    house[14:28, 20:34] = True  # on the slope's upper half
    means[house] += 5.0
    found = ground_on_hills(means, RESOLUTION_M)
    known = np.isfinite(means)
    assert np.isnan(found[house]).all()
    assert np.isfinite(found[known & ~house]).mean() > 0.97
    if slope > 0.15:
        assert np.isfinite(ground(means, RESOLUTION_M)[known & ~house]).mean() < 0.9, "which is why"
    heights, _ = about(found, np.zeros(found.shape), RESOLUTION_M)
    shown = np.isfinite(heights)
    true = np.broadcast_to(10.0 * slope * np.sin(np.arange(60.0) / 10.0), heights.shape)
    assert np.sqrt(np.mean((heights - true)[shown & ~house] ** 2)) < 0.2


@pytest.mark.parametrize("low", [[(20, 20)], [(20, 20), (20, 21)]])
def test_what_lies_alone_below_all_about_it_is_no_ground_and_that_beside_it_is(low: list[tuple[int, int]]) -> None:
    means = sloping(np.random.default_rng(7))
    for row, column in low:
        means[row, column] -= 4.0
    found = ground(means, RESOLUTION_M)
    assert all(np.isnan(found[at]) for at in low)
    assert np.isfinite(found).sum() == np.isfinite(means).sum() - len(low)


@pytest.mark.parametrize(("size_m", "height_m"), [(4, 1.5), (30, 6.0)])
def test_a_car_and_a_house_are_no_ground(size_m: int, height_m: float) -> None:
    means = sloping(np.random.default_rng(7))
    stands = np.zeros(means.shape, bool)
    stands[4 : 4 + size_m, 4 : 4 + size_m] = True
    means[stands] += height_m
    found = ground(means, RESOLUTION_M)
    assert np.isnan(found[stands]).all()
    assert np.array_equal(found[~stands], means[~stands], equal_nan=True)


def test_a_roof_far_from_any_ground_that_was_seen_is_none() -> None:
    means = np.where(np.random.default_rng(7).random((60, 60)) < 0.5, 0.0, np.nan)
    means[:, 20:] = np.nan
    means[30:36, 50:54] = 14.0  # 30 m away
    assert np.isnan(ground(means, RESOLUTION_M)[:, 20:]).all()
    assert np.isnan(ground_on_hills(means, RESOLUTION_M)[:, 20:]).all()
    means[30:36, 50:54] = 4.0
    assert np.isfinite(ground(means, RESOLUTION_M)[30:36, 50:54]).all(), "as high as ground may be there"


def test_ground_that_lies_low_together_is_ground() -> None:
    """A hole of 3 m across."""
    means = sloping(np.random.default_rng(7))
    means[20:23, 20:23] = -2.0
    assert np.isfinite(ground(means, RESOLUTION_M)[20:23, 20:23]).all()


def test_roofs_are_no_ground() -> None:
    heights = np.full((60, 60), np.nan)
    rng = np.random.default_rng(1)
    rows, columns = rng.integers(0, 60, (2, 500))
    heights[rows, columns] = 0.05 * columns + rng.normal(0.0, 0.2, 500)  # a slope of 1 in 20
    roof = (slice(20, 30), slice(20, 36))
    heights[roof] = np.where(np.isfinite(heights[roof]), 9.0, np.nan)
    heights[22, 21:35] = 9.0
    left = ground(heights, RESOLUTION_M)
    assert np.isfinite(heights[roof]).any() and not np.isfinite(left[roof]).any()
    outside = np.isfinite(heights)
    outside[roof] = False
    kept = outside & np.isfinite(left)
    assert np.isfinite(left[outside]).mean() > 0.98 and np.array_equal(left[kept], heights[kept])


def test_what_lies_alone_or_alone_below_all_about_it_is_no_ground() -> None:
    heights = np.full((60, 60), np.nan)
    heights[5:20, 5:20] = 1.0
    heights[12, 12] = -6.0  # a corner that was confused with another
    heights[45, 45:47] = -8.0  # two of them, far from all else
    heights[40:43, 10] = 1.5  # three that agree
    left = ground(heights, RESOLUTION_M)
    assert np.isnan(left[12, 12]) and np.isnan(left[45, 45:47]).all()
    known = np.isfinite(heights) & (heights > 0.0)
    assert np.array_equal(left[known], heights[known])


def test_heights_spread_between_what_is_known_and_no_farther() -> None:
    means = np.full((60, 60), np.nan)
    means[10, 10], means[10, 14] = 2.0, 4.0
    heights = spread(means, RESOLUTION_M)
    assert heights[10, 10] == 2.0 and 2.0 < heights[10, 12] < 4.0
    assert np.isnan(heights[55, 55]) and np.isfinite(heights[6:15, 6:19]).all()


def test_the_kept_map_ends_near_what_was_measured() -> None:
    means, sigmas = np.full((40, 40), np.nan), np.full((40, 40), np.nan)
    means[10, 10], means[10, 13], sigmas[10, 10], sigmas[10, 13] = 2.0, 4.0, 0.1, 0.1
    heights, spread_m = about(means, sigmas, RESOLUTION_M)
    assert heights[10, 8] == pytest.approx(2.0, abs=0.1) and 2.4 < heights[10, 11] < 3.0
    assert spread_m[10, 11] > 0.8 > 0.3 > spread_m[10, 8]
    assert np.isnan(heights[10, 6]) and np.isnan(heights[30, 30])
