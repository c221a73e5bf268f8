"""A terrain map from corners' rays and a lidar's ranges, and corners followed from picture to picture."""

import math
from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, CameraPose, Point, Sweep, camera_pose, project
from sitl_emu.missions.companion.geolocation import Intersection, Ray
from sitl_emu.missions.companion.terrain.crossings import none_yet
from sitl_emu.missions.companion.terrain.crossover import NONE, drift_of, without
from sitl_emu.missions.companion.terrain.features import Feature, FeatureTracker
from sitl_emu.missions.companion.terrain.soundings import Sounding
from sitl_emu.missions.companion.terrain.survey import Survey
from sitl_emu.missions.companion.terrain.terrain_map import Bounds

CAMERA = CameraModel()
BOUNDS = Bounds(-10.0, -10.0, 40.0, 10.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)
PLACES = [(12.0, -3.0, 2.0), (15.0, 4.0, -1.5), (18.0, 0.0, 0.0)]
"""North, east, height of corners."""


def pose_at(time_s: float) -> CameraPose:
    """On a line to the north, 20 m up at 5 m/s, that begins 20 m before the places."""
    return camera_pose((5.0 * time_s, 0.0, -20.0), quaternion(0.0, -0.05, 0.0), NADIR)


def pixel_of(point: Point, time_s: float, readout_s: float = 0.0) -> tuple[float, float] | None:
    """Where a place appears in a frame: in the row that is read when it is seen there."""
    row = (CAMERA.height - 1) / 2.0
    for _ in range(5):
        pixel = project(CAMERA, pose_at(time_s + (row / (CAMERA.height - 1) - 0.5) * readout_s), point)
        if pixel is None or not (0 <= pixel[0] < CAMERA.width and 0 <= pixel[1] < CAMERA.height):
            return None
        row = pixel[1]
    return pixel


def sweep_at(time_s: float, readout_s: float = 0.0) -> Sweep:
    return Sweep(pose_at(time_s - readout_s / 2.0), pose_at(time_s + readout_s / 2.0))


def flown(
    survey: Survey, *, drift_m_s: float = 0.0, noise_px: float = 0.0, readout_s: float = 0.0, told_s: float = 0.0
) -> None:
    """A line, five frames a second; what is seen may drift to the east. `told_s`: how long rows are said to take."""
    rng = np.random.default_rng(3)
    for k in range(40):
        time_s, seen = 0.2 * k, []
        for number, (north, east, up) in enumerate(PLACES):
            pixel = pixel_of((north, east + drift_m_s * time_s, -up), time_s, readout_s)
            if pixel is not None:
                x, y = np.array(pixel) + rng.normal(scale=noise_px, size=2)
                seen.append(Feature(number, float(x), float(y)))
        survey.on_features(k * 200_000, sweep_at(time_s, told_s), seen, 0.5, 1.0)


def test_corners_tell_the_ground_and_home_s_height_does_not() -> None:
    survey = Survey(BOUNDS, CAMERA)
    flown(survey, noise_px=1.0)
    assert survey.features == len(PLACES)
    for north, east, up in PLACES:
        height = survey.terrain.height_m(north, east)
        near = [survey.terrain.height_m(north + n, east + e).mean_m for n in (-1.0, 0.0, 1.0) for e in (-1.0, 0.0, 1.0)]
        known = [each for each in near if math.isfinite(each)]
        assert known and min(abs(each - up) for each in known) < 0.3, height


@pytest.mark.parametrize(("told_s", "off_m"), [(0.0, 0.15), (0.0326, 0.0)])
def test_a_rolling_shutter_s_rows_are_seen_from_where_the_camera_was_when_they_were_read(
    told_s: float, off_m: float
) -> None:
    """Taken for one moment, 20 m of height and 33 ms are 0.15 m: the way is longer than it seems."""
    survey = Survey(BOUNDS, CAMERA)
    flown(survey, readout_s=0.0326, told_s=told_s)
    above = [min((one.height_m - up for *_, up in PLACES), key=abs) for one in survey.soundings]
    assert above == pytest.approx([off_m] * len(PLACES), abs=0.04)


def test_corners_that_are_still_followed_tell_the_ground_ahead() -> None:
    survey, known = Survey(BOUNDS, CAMERA), list[tuple[bool, bool]]()
    for k in range(40):
        pixel = pixel_of((15.5, 2.5, -2.0), 0.2 * k)
        seen = [] if pixel is None else [Feature(1, *pixel)]
        survey.on_features(k * 200_000, sweep_at(0.2 * k), seen, 0.5, 1.0)
        followed_m, taken_m = (terrain.height_m(15.5, 2.5).mean_m for terrain in (survey.so_far(), survey.terrain))
        known.append((math.isfinite(followed_m), math.isfinite(taken_m)))
        assert not known[-1][0] or followed_m == pytest.approx(2.0, abs=0.3)
    followed, taken = (5.0 * 0.2 * [each[which] for each in known].index(True) for which in (0, 1))
    assert followed < 15.5 < taken, "m north, where the vehicle was when it was known"


def test_what_moves_is_no_ground() -> None:
    survey = Survey(BOUNDS, CAMERA)
    flown(survey, drift_m_s=3.0)
    assert survey.features == 0


def test_ranges_are_sifted_and_taken_at_the_end() -> None:
    survey = Survey(BOUNDS, CAMERA)
    for k in range(50):
        range_m = 5.0 if k != 20 else 2.0
        survey.on_range(k * 20_000, range_m, (0.02 * k, 0.0, -5.0), LEVEL, 0.5, 1.0)
    survey.on_range(10_000_000, 9.0, (1.0, 0.0, -9.0), LEVEL, 0.5, 1.0)
    survey.finish()
    assert survey.ranges == 49
    assert survey.terrain.height_m(0.4, 0.0).mean_m == pytest.approx(0.0, abs=0.01)


def test_a_long_flight_keeps_so_many_soundings_of_all_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sitl_emu.missions.companion.terrain.survey.MOST_SOUNDINGS", 100)
    survey = Survey(BOUNDS, CAMERA)
    for k in range(1000):
        survey.on_range(k * 20_000, 5.0, (0.02 * k, 0.0, -5.0), LEVEL, 0.5, 1.0)
    survey.finish()
    times_s = [one.time_us / 1e6 for one in survey.soundings]
    assert survey.ranges == 1000 and len(times_s) == 63
    assert np.diff(times_s) == pytest.approx(16 * 0.02)
    assert np.isfinite(survey.adjusted()[0].means_m()).sum() == np.isfinite(survey.terrain.means_m()).sum()


def sounded(drift: Callable[[float], float], noise_m: float = 0.2, every_s: float = 0.05) -> list[Sounding]:
    """Three lines over hilly ground, each of which sees the half of the one before again, by a height that drifts."""
    rng, found = np.random.default_rng(4), list[Sounding]()
    for k in range(round(90.0 / every_s)):
        time_s = k * every_s
        line, along = divmod(time_s, 30.0)
        north = 2.0 * along if line % 2 == 0 else 60.0 - 2.0 * along
        east = 8.0 * line + rng.uniform(-8.0, 8.0)
        height = 2.0 * math.sin(north / 15.0) + 0.1 * east + drift(time_s) + rng.normal(scale=noise_m)
        found.append(Sounding(round(time_s * 1e6), north, east, height, 0.3, 0.5, 1.0))
    return found


@pytest.mark.parametrize("drift", [lambda s: 0.0, lambda s: 0.01 * s, lambda s: 0.6 * math.sin(s / 30.0)])
def test_a_drift_is_told_by_places_that_were_sounded_twice(drift: Callable[[float], float]) -> None:
    found = drift_of(sounded(drift))
    times_s = np.arange(0.0, 90.0, 5.0)
    wanted = np.array([drift(s) for s in times_s.tolist()])
    assert np.sqrt(np.mean((found.at_m(np.round(times_s * 1e6).astype(np.int64)) - wanted) ** 2)) < 0.12


def test_what_was_there_only_once_tells_no_drift() -> None:
    """A car that stood on every fifth place when it was first seen."""
    soundings = [
        one._replace(height_m=one.height_m + 1.5) if one.time_us < 30e6 and k % 5 == 0 else one
        for k, one in enumerate(sounded(lambda s: 0.01 * s))
    ]
    found = drift_of(soundings)
    assert found.at_m(np.array([85_000_000])) == pytest.approx(0.85, abs=0.3)


def test_a_roof_and_the_street_below_it_tell_no_drift() -> None:
    """In a town: two in five soundings are of roofs 6 m up, of another share each time that a place is seen."""
    rng = np.random.default_rng(6)
    soundings = [
        one._replace(height_m=one.height_m + 6.0) if rng.random() < (0.3 if one.time_us < 30e6 else 0.5) else one
        for one in sounded(lambda s: 0.01 * s, every_s=0.02)
    ]
    times_us = np.arange(0, 90_000_000, 5_000_000)
    assert drift_of(soundings).at_m(times_us) == pytest.approx(1e-8 * times_us, abs=0.3)


def test_a_drift_is_none_where_no_place_was_sounded_twice() -> None:
    line = [Sounding(k * 1_000_000, 5.0 * k, 0.0, 0.05 * k, 0.3, 0.5, 1.0) for k in range(40)]
    assert drift_of(line).offsets_m == pytest.approx(0.0, abs=1e-6)
    heights_m = [one.height_m for one in without(line, drift_of(line))]
    assert heights_m == pytest.approx([one.height_m for one in line], abs=1e-6)
    assert drift_of([]) is NONE and without([], NONE) == []


def a_picture(shift_px: int) -> npt.NDArray[np.uint8]:
    rng = np.random.default_rng(5)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (300, 320)).astype(np.float32), (0, 0), 3.0)
    ground = cv2.normalize(ground, None, 0, 255, cv2.NORM_MINMAX)
    return np.asarray(ground[shift_px : shift_px + 240], np.uint8)


def test_corners_are_followed_by_their_number() -> None:
    tracker = FeatureTracker()
    before = {one.number: one for one in tracker.follow(a_picture(20))}
    after = {one.number: one for one in tracker.follow(a_picture(8))}
    both = before.keys() & after.keys()
    assert len(both) > 30
    for number in both:
        assert after[number].x == pytest.approx(before[number].x, abs=1.0)
        assert after[number].y == pytest.approx(before[number].y + 12.0, abs=1.0)
    assert tracker.follow(np.zeros((240, 320), np.uint8)) == [], "nothing is there to follow"


@given(st.integers(0, 10_000))
def test_crossings_of_many_corners_are_those_of_each(seed: int) -> None:
    """As geolocation.Intersection has them, with corners that come and go."""
    rng = np.random.default_rng(seed)
    open_, single = none_yet(), dict[int, Intersection]()
    for _ in range(4):
        numbers = np.sort(rng.choice(6, size=rng.integers(1, 5), replace=False)).astype(np.int64)
        single = {number: single.get(number, Intersection(0.0)) for number in numbers.tolist()}
        origins = rng.uniform((-5.0, -5.0, -30.0), (5.0, 5.0, -10.0), (len(numbers), 3))
        rays = rng.normal(size=(len(numbers), 3)) + np.array((0.0, 0.0, 3.0))
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        open_ = open_.with_rays(numbers, origins, rays)
        for number, origin, ray in zip(numbers.tolist(), origins, rays, strict=True):
            single[number].add(Ray(origin, ray), 0.0)
    for row, number in enumerate(open_.numbers.tolist()):
        one = single[number]
        assert open_.points()[row] == pytest.approx(np.array(one.point()), abs=1e-6)
        assert open_.residuals_m()[row] == pytest.approx(one.residual_m(), abs=1e-4)
        assert open_.counts[row] == one.count
        assert math.acos(open_.cosines[row]) == pytest.approx(one.spread_rad, abs=1e-6)
        assert open_.covariances()[row].diagonal().tolist() == pytest.approx(
            [one.covariance().nn, one.covariance().ee, one.covariance().dd]
        )
