"""The ground as it is measured in flight: soundings and which to believe, the map of them, and how to fly over it."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.geolocation import Intersection, Ray
from sitl_emu.missions.companion.terrain import files
from sitl_emu.missions.companion.terrain.following import Following, next_altitude
from sitl_emu.missions.companion.terrain.soundings import TF_LUNA, Sounding, believed, of_feature, of_range
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap
from sitl_emu.world import height_files
from sitl_emu.world.description import Origin, Terrain
from tests.typed import present

BOUNDS = Bounds(-10.0, 0.0, 20.0, 40.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)


def at(north: float, east: float, height: float, sigma: float = 0.1, eph: float = 0.0, epv: float = 0.0) -> Sounding:
    return Sounding(0, north, east, height, sigma, eph, epv)


PLACES = st.tuples(st.integers(-96, 176), st.integers(-16, 336)).map(lambda eighths: (eighths[0] / 8, eighths[1] / 8))
"""Some lie outside; eighths, so that which cell they lie in is no matter of rounding."""
SOUNDINGS = st.lists(
    st.builds(
        lambda place, height, sigma, eph, epv: at(place[0], place[1], height, sigma, eph, epv),
        PLACES, st.floats(-5.0, 30.0), st.floats(0.01, 1.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0),
    ),
    max_size=30,
)  # fmt: skip


def mapped(soundings: list[Sounding], bounds: Bounds = BOUNDS) -> TerrainMap:
    terrain = TerrainMap(bounds)
    terrain.add(soundings)
    return terrain


# Soundings


@given(height=st.floats(0.5, 5.0), yaw=st.floats(-3.1, 3.1), pitch=st.floats(-0.5, 0.5))
def test_a_leaning_beam_meets_level_ground_ahead(height: float, yaw: float, pitch: float) -> None:
    one = present(
        of_range(TF_LUNA, 7, height / math.cos(pitch), (3.0, -2.0, -height), quaternion(0.0, pitch, yaw), 0.5, 0.3)
    )
    ahead = height * math.tan(pitch)
    expected = (7, 3.0 + ahead * math.cos(yaw), -2.0 + ahead * math.sin(yaw), 0.0)
    assert one[:4] == pytest.approx(expected, abs=1e-6)
    assert one.sigma_m < 0.1 and one.eph_m >= 0.5 and one.epv_m >= math.hypot(0.3, 0.05), "the place's error counts"


@pytest.mark.parametrize(("range_m", "roll"), [(0.1, 0.0), (8.5, 0.0), (math.nan, 0.0), (3.0, 0.9), (3.0, 3.0)])
def test_what_a_lidar_cant_have_measured_is_no_sounding(range_m: float, roll: float) -> None:
    assert of_range(TF_LUNA, 0, range_m, (0.0, 0.0, -5.0), quaternion(roll, 0.0, 0.0), 0.5, 0.3) is None


def test_rays_that_cross_at_a_feature_are_a_sounding_and_one_ray_is_none() -> None:
    crossing, place = Intersection(-1.0), np.array((4.0, 2.0, -3.0))
    for north in (-6.0, 4.0, 14.0):
        origin = np.array((north, 0.0, -20.0))
        crossing.add(Ray(origin, (place - origin) / np.linalg.norm(place - origin)), 0.0)
        if north == -6.0:
            assert of_feature(0, crossing.point(), crossing.covariance(), 0.5, 1.0, 1.0) is None
    one = present(of_feature(5, crossing.point(), crossing.covariance(), 0.5, 1.0, 1.0))
    assert one[:3] == pytest.approx((5, 4.0, 2.0), abs=0.02)
    assert one.height_m == pytest.approx(3.0, abs=1e-6), "home's height has no part in it"
    assert 0.1 < one.sigma_m < 1.0 and one.eph_m > 0.5 and one.epv_m == 1.0


def along(heights: list[float], step_us: int = 20_000) -> list[Sounding]:
    return [Sounding(i * step_us, i * 0.1, 5.0, height, 0.02, 0.5, 0.3) for i, height in enumerate(heights)]


@given(
    slope=st.floats(-0.5, 0.5), step_m=st.floats(-5.0, 5.0), step_at=st.integers(4, 36), spike_m=st.floats(0.7, 8.0),
    spike_at=st.integers(0, 39), up=st.booleans(),
)  # fmt: skip
def test_a_spike_goes_and_slopes_and_steps_stay(
    slope: float, step_m: float, step_at: int, spike_m: float, spike_at: int, up: bool
) -> None:
    ground = [slope * 0.1 * i + (step_m if i >= step_at else 0.0) for i in range(40)]
    assert believed(along(ground)) == along(ground)
    if abs(spike_at - step_at) > 8:
        spiked = list(ground)
        spiked[spike_at] += spike_m if up else -spike_m
        kept = believed(along(spiked))
        assert kept == [one for i, one in enumerate(along(spiked)) if i != spike_at]


def test_heights_beyond_limits_and_lone_soundings_are_not_believed() -> None:
    assert believed(along([1.0, 1.0, 50.0, 50.0, 50.0, 1.0, 1.0]), 0.0, 20.0) == [
        one for one in along([1.0, 1.0, 50.0, 50.0, 50.0, 1.0, 1.0]) if one.height_m == 1.0
    ]
    assert believed(along([1.0, 1.0, 1.0], step_us=600_000)) == []
    assert believed([]) == []


# The map


@given(soundings=SOUNDINGS, cut=st.integers(0, 30))
def test_order_and_batches_do_not_matter_and_maps_merge(soundings: list[Sounding], cut: int) -> None:
    whole, other = mapped(soundings), mapped(list(reversed(soundings[cut:])))
    first = mapped(soundings[:cut])
    first.merge(other)
    assert first.outside == whole.outside
    np.testing.assert_allclose(first.means_m(), whole.means_m(), atol=1e-6)
    np.testing.assert_allclose(first.sigmas_m(), whole.sigmas_m(), atol=1e-3)


@given(soundings=SOUNDINGS, place=PLACES)
def test_a_height_lies_among_its_soundings_and_is_nan_without_any(
    soundings: list[Sounding], place: tuple[float, float]
) -> None:
    terrain = mapped(soundings)
    cell = math.floor(place[0]), math.floor(place[1])
    here = [
        one.height_m
        for one in soundings
        if (math.floor(one.north_m), math.floor(one.east_m)) == cell
        and BOUNDS.south_m <= one.north_m < BOUNDS.north_m and BOUNDS.west_m <= one.east_m < BOUNDS.east_m
    ]  # fmt: skip
    height = terrain.height_m(*place)
    if here:
        assert min(here) - 1e-6 <= height.mean_m <= max(here) + 1e-6 and height.sigma_m > 0.0
    else:
        assert math.isnan(height.mean_m) and math.isnan(height.sigma_m)


@given(soundings=SOUNDINGS)
def test_a_place_has_what_the_grids_have(soundings: list[Sounding]) -> None:
    terrain = mapped(soundings)
    means, sigmas = terrain.means_m(), terrain.sigmas_m()
    for one in soundings:
        row, column = math.floor(one.north_m) + 10, math.floor(one.east_m)
        if 0 <= row < 30 and 0 <= column < 40:
            expected = (means[row, column], sigmas[row, column])
            assert terrain.height_m(one.north_m, one.east_m) == pytest.approx(expected, abs=1e-9)


@given(measured=st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.05, 1.0)), min_size=1, max_size=20))
def test_a_cell_is_the_kalman_filter_of_a_height_that_stays(measured: list[tuple[float, float]]) -> None:
    mean, variance = measured[0][0], measured[0][1] ** 2
    for z, sigma in measured[1:]:
        gain = variance / (variance + sigma**2)
        mean, variance = mean + gain * (z - mean), (1.0 - gain) * variance
    terrain = mapped([at(0.5, 0.5, z, sigma) for z, sigma in measured])
    height = terrain.height_m(0.5, 0.5)
    assert height.mean_m == pytest.approx(mean, abs=1e-6)
    assert height.sigma_m >= math.sqrt(variance) - 1e-6, "and the cell's own relief on top"
    noises_m = terrain.noises_m()
    assert np.nanmax(noises_m) == pytest.approx(math.sqrt(variance), abs=1e-6)
    assert np.isfinite(noises_m).sum() == 1, "a cell that was not measured has none"


def test_noise_averages_out_what_lasts_does_not_and_a_place_counts_by_the_slope() -> None:
    assert mapped([at(0.5, 0.5, 2.0, 0.3)] * 100).height_m(0.5, 0.5) == pytest.approx((2.0, 0.03))
    assert mapped([at(0.5, 0.5, 2.0, 0.3, 0.0, 0.4)] * 100).height_m(0.5, 0.5).sigma_m == pytest.approx(0.4, abs=0.01)
    steep = mapped([at(0.5, 0.5, 2.0, 0.01, 0.5), at(1.5, 0.5, 5.0, 0.01, 0.5)])
    assert steep.height_m(0.5, 0.5).sigma_m == pytest.approx(1.5, abs=0.01), "half a metre off on a slope of 3"
    relief = mapped([at(0.5, 0.5, 1.0, 0.01), at(0.5, 0.5, 3.0, 0.01)])
    assert relief.height_m(0.5, 0.5) == pytest.approx((2.0, 1.0), abs=0.01)


def test_what_is_no_number_or_lies_outside_is_counted_and_left_out() -> None:
    terrain = mapped([at(100.0, 5.0, 1.0), at(math.nan, 5.0, 1.0), at(5.0, 5.0, math.inf), at(5.0, 5.0, 1.0)])
    assert terrain.outside == 3 and np.isfinite(terrain.means_m()).sum() == 1
    assert math.isnan(terrain.height_m(math.nan, 5.0).mean_m) and math.isnan(terrain.height_m(1e9, 5.0).mean_m)


@pytest.mark.parametrize(
    ("bounds", "resolution_m"), [(Bounds(0, 0, 0, 5), 1.0), (BOUNDS, 0.0), (Bounds(0, 0, 1e4, 1e4), 1.0)]
)
def test_a_map_without_extent_or_end_is_refused(bounds: Bounds, resolution_m: float) -> None:
    with pytest.raises(ValueError, match=r"terrain map: .*(must have an extent|at most)"):
        TerrainMap(bounds, resolution_m)


def test_maps_of_other_cells_are_not_merged() -> None:
    with pytest.raises(ValueError, match="same cells"):
        mapped([]).merge(TerrainMap(BOUNDS, 0.5))


def hills(north: float, east: float) -> float:
    """Relief from 0 to 6 m."""
    return 3.0 + 2.0 * math.sin(north / 11.0) + math.sin(east / 7.0 + north / 23.0)


def errors_m(terrain: TerrainMap, truth: Callable[[float, float], float]) -> npt.NDArray[np.float64]:
    """Mapped less true heights at the middle of each known cell."""
    means = terrain.means_m()
    places = [
        (terrain.south_m + (row + 0.5) * terrain.resolution_m, terrain.west_m + (column + 0.5) * terrain.resolution_m)
        for row, column in np.argwhere(np.isfinite(means))
    ]
    return np.asarray(means[np.isfinite(means)] - np.array([truth(*place) for place in places]))


def rms(values: npt.NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(values**2)))


def flown(truth: Callable[[float, float], float], spikes: float, sift: bool) -> TerrainMap:
    """Lines 3 m apart, 5 m above the ground, by a TF-Luna with a lasting 1 %, some of whose ranges are spurious."""
    rng, terrain = np.random.default_rng(3), TerrainMap(Bounds(-1.0, -1.0, 41.0, 31.0))
    time_us = 0
    for east in range(0, 31, 3):
        line = []
        for north in np.arange(0.0, 40.0, 0.1).tolist():
            time_us += 20_000
            roll, pitch = rng.normal(0.0, 0.03, 2).tolist()
            q = quaternion(roll, pitch, 0.0)
            altitude = truth(north, east) + 5.0
            range_m = 5.0 * 1.01 + rng.normal(0.0, 0.0175)
            if rng.random() < spikes:
                range_m = rng.uniform(0.2, 8.0)
            line.append(of_range(TF_LUNA, time_us, range_m, (north, east, -altitude), q, 0.5, 0.2))
        soundings = [one for one in line if one is not None]
        terrain.add(believed(soundings) if sift else soundings)
    return terrain


def test_a_flown_map_is_within_0_2_m_though_one_range_in_20_is_spurious() -> None:
    sifted, unsifted = flown(hills, 0.05, True), flown(hills, 0.05, False)
    assert rms(errors_m(sifted, hills)) < 0.2 and rms(errors_m(unsifted, hills)) > 2.0 * rms(errors_m(sifted, hills))
    assert 0.3 < np.isfinite(sifted.means_m()).mean() < 0.7, "between the lines nothing is known"


def test_sigmas_are_as_large_as_errors_are() -> None:
    terrain = flown(hills, 0.0, True)
    normalised = errors_m(terrain, hills) / terrain.sigmas_m()[np.isfinite(terrain.means_m())]
    assert np.mean(np.abs(normalised) < 2.0) > 0.95 and rms(normalised) > 0.1


# Files


def test_a_geotiff_is_read_by_our_own_worlds_where_it_lies(tmp_path: Path) -> None:
    origin = Origin(lat_deg=47.4, lon_deg=8.55, alt_amsl_m=408.0)
    north, east = np.mgrid[-9.5:20.0, 0.5:40.0]

    def rough(n: float, e: float) -> float:
        return 0.3 * n - 0.1 * e + math.sin(n)

    terrain = mapped(
        [at(n, e, rough(n, e)) for n, e in zip(north.flat, east.flat, strict=True) if not (n < -6.0 and e < 4.0)]
    )
    files.write_geotiff(tmp_path / "map.tif", terrain, origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
    read = height_files.read(Terrain(file="map.tif", spacing_m=0.25, no_data_m=-99.0), origin, tmp_path)
    for n, e in ((0.5, 10.5), (-5.5, 30.5), (18.5, 1.5), (18.5, 38.5), (-8.5, 38.5)):
        assert read.height_m(n, e) == pytest.approx(rough(n, e), abs=0.1), "degrees and metres meet within 5 cm"
    assert read.height_m(-8.5, 1.5) == -99.0, "not known there"
    with tifffile.TiffFile(tmp_path / "map.tif") as file:
        heights, sigmas = (page.asarray() for page in file.pages)
        tie = file.pages[0].geotiff_tags["ModelTiepoint"]
    assert tie[4:2:-1] == pytest.approx(from_metres(20.0, 0.0, origin.lat_deg, origin.lon_deg))
    np.testing.assert_allclose(heights[::-1], terrain.means_m() + 408.0, atol=1e-3)
    np.testing.assert_allclose(sigmas[::-1], terrain.sigmas_m(), atol=1e-3)


# Following

STRIP = Bounds(0.0, -10.0, 200.0, 10.0)


def whole(height: Callable[[float, float], float], bounds: Bounds = STRIP) -> TerrainMap:
    """Every cell known within a centimetre."""
    south, west, north, east = (round(edge) for edge in bounds)
    places = [(n + 0.5, e + 0.5) for n in range(south, north) for e in range(west, east)]
    return mapped([at(n, e, height(n, e), 0.01) for n, e in places], bounds)


def test_the_highest_ahead_counts_its_sigmas_and_nothing_beside_or_behind() -> None:
    terrain = mapped([at(15.5, 5.5, 6.0, 0.5), at(15.5, 15.5, 30.0), at(-5.5, 5.5, 40.0)])

    def wanted_m(here_m: tuple[float, float], course_rad: float, ahead_m: float) -> float:
        following = Following(clearance_m=10.0, ahead_m=ahead_m, half_width_m=2.0, climb_m_s=0.0)
        return next_altitude(terrain, here_m, course_rad, 5.0, 0.0, 1.0, following).wanted_m

    assert wanted_m((5.0, 5.0), 0.0, 14.0) == pytest.approx(17.0), "forward"
    assert wanted_m((15.0, 5.0), math.pi / 2.0, 20.0) == pytest.approx(40.2), "to the right"
    assert wanted_m((5.0, 5.0), math.pi, 20.0) == pytest.approx(50.2), "back"


def test_where_nothing_is_mapped_the_altitude_stays_and_is_told_unknown() -> None:
    for here in ((0.0, 10.0), (500.0, 500.0)):
        told = next_altitude(mapped([]), here, 0.0, 5.0, 12.0, 0.1, Following())
        assert told.altitude_m == 12.0 and math.isnan(told.wanted_m) and told.late_m == 0.0


def test_what_is_to_be_held_is_held_unless_something_asks_for_more() -> None:
    wall = whole(lambda n, _: 14.0 if n >= 100 else 0.0)
    before, behind = (next_altitude(wall, (n, 0.0), 0.0, 5.0, 20.0, 0.5, Following(), 20.0) for n in (20.0, 90.0))
    assert before.wanted_m == before.altitude_m == 20.0
    assert behind.wanted_m > 20.0 and behind.altitude_m == pytest.approx(21.0)
    assert next_altitude(mapped([]), (0.0, 0.0), 0.0, 5.0, 19.0, 1.0, Following(), 20.0).altitude_m == 20.0


@settings(max_examples=25, deadline=None)
@given(
    wall_m=st.floats(0.0, 14.0), wall_at=st.integers(60, 150), slope=st.floats(-0.1, 0.1), speed=st.floats(1.0, 5.0),
)  # fmt: skip
def test_what_follows_the_ground_keeps_its_clearance_within_its_rates(
    wall_m: float, wall_at: int, slope: float, speed: float
) -> None:

    def ground(n: float, _: float) -> float:
        return slope * n + (wall_m if wall_at <= n < wall_at + 20 else 0.0)

    terrain, following, dt_s = whole(ground), Following(), 0.5
    north, altitude = 10.0, ground(10.0, 0.0) + 12.0
    while north < 195.0:
        told = next_altitude(terrain, (north, 0.0), 0.0, speed, altitude, dt_s, following)
        rate = (told.altitude_m - altitude) / dt_s
        assert -following.sink_m_s - 1e-9 <= rate <= following.climb_m_s + 1e-9
        assert told.late_m < 1e-6 and told.altitude_m >= told.wanted_m - 1e-6
        north, altitude = north + speed * dt_s, told.altitude_m
        if north < 199.0:
            assert altitude - ground(math.floor(north), 0.0) >= following.clearance_m - 0.2 - abs(slope)
    assert altitude - ground(195.0, 0.0) < following.clearance_m + 30.0


def test_a_wall_that_is_too_near_is_told() -> None:
    terrain = whole(lambda n, _: 20.0 if n >= 50 else 0.0)
    too_fast = next_altitude(terrain, (30.0, 0.0), 0.0, 5.0, 10.0, 0.1, Following())
    assert too_fast.altitude_m == pytest.approx(10.2) and too_fast.late_m == pytest.approx(too_fast.wanted_m - 10.2)
    stopped = next_altitude(terrain, (30.0, 0.0), 0.0, 0.0, 10.5, 0.1, Following())
    assert stopped.late_m == 0.0 and stopped.altitude_m == pytest.approx(10.4), "and it sinks to its clearance"
