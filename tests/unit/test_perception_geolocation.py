"""From pixel to place: the projection and its inverse, and the crossing of many rays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.camera_model import MAST, NADIR, CameraModel, camera_pose, gsd_m, in_view, project
from sitl_emu.missions.companion.geolocation import Intersection, Ray, on_level_ground, pixel_ray

CAMERA = CameraModel()


@given(
    x=st.floats(0, 639),
    y=st.floats(0, 479),
    roll=st.floats(-0.3, 0.3),
    pitch=st.floats(-0.3, 0.3),
    yaw=st.floats(-3.2, 3.2),
)
def test_pixel_to_ground_and_back(x: float, y: float, roll: float, pitch: float, yaw: float) -> None:
    pose = camera_pose((12.0, -7.0, -15.0), quaternion(roll, pitch, yaw), NADIR)
    point = on_level_ground(pixel_ray(CAMERA, pose, x, y), 1.0)
    assert point is not None
    assert project(CAMERA, pose, point) == pytest.approx((x, y), abs=1e-6)


def test_heading_pitch_and_roll_each_move_the_place() -> None:
    """Hand-worked: 10 m above ground, focal length 320 px."""

    def seen(roll: float, pitch: float, yaw: float, x: float, y: float) -> tuple[float, float]:
        level = NADIR._replace(down_m=0.0)
        point = on_level_ground(
            pixel_ray(CAMERA, camera_pose((0.0, 0.0, -10.0), quaternion(roll, pitch, yaw), level), x, y), 0.0
        )
        assert point is not None
        return point[:2]

    ahead = (319.5, 239.5 - 160.0)  # up in the picture: half the height ahead
    assert seen(0, 0, 0, *ahead) == pytest.approx((5.0, 0.0), abs=1e-9)
    assert seen(0, 0, math.pi / 2, *ahead) == pytest.approx((0.0, 5.0), abs=1e-9)
    assert seen(0, 0, 0, 319.5 + 160.0, 239.5) == pytest.approx((0.0, 5.0), abs=1e-9)
    # Nose up by 0.1 rad: the axis meets the ground ahead. Right side down: to the left.
    assert seen(0, 0.1, 0, 319.5, 239.5) == pytest.approx((10 * math.tan(0.1), 0.0), abs=1e-9)
    assert seen(0.1, 0, 0, 319.5, 239.5) == pytest.approx((0.0, -10 * math.tan(0.1)), abs=1e-9)


def test_the_masts_axis_meets_the_ground_ahead() -> None:
    pose = camera_pose((0.0, 0.0, -0.2), quaternion(0, 0, math.pi / 2), MAST)
    point = on_level_ground(pixel_ray(CAMERA, pose, 319.5, 239.5), 0.0)
    assert point is not None
    assert point[:2] == pytest.approx((0.0, 0.2 + 2.0 / math.tan(math.radians(60))), abs=1e-9)
    assert gsd_m(CAMERA, pose, 0.0) == pytest.approx(2.0 / math.sin(math.radians(60)) / 320.0)


def test_rays_that_never_meet_the_ground_have_no_place() -> None:
    pose = camera_pose((0.0, 0.0, -10.0), quaternion(2.0, 0, 0), NADIR)
    assert on_level_ground(pixel_ray(CAMERA, pose, 319.5, 239.5), 0.0) is None
    assert gsd_m(CAMERA, pose, 0.0) is None
    behind = camera_pose((0.0, 0.0, 5.0), quaternion(0, 0, 0), NADIR)
    assert on_level_ground(pixel_ray(CAMERA, behind, 319.5, 239.5), 0.0) is None
    assert project(CAMERA, behind, (0.0, 0.0, 0.0)) is None
    assert not in_view(CAMERA, behind, (0.0, 0.0, 0.0))


def test_in_view_keeps_a_margin() -> None:
    pose = camera_pose((0.0, 0.0, -10.0), quaternion(0, 0, 0), NADIR._replace(down_m=0.0))
    assert in_view(CAMERA, pose, (0.0, 9.9, 0.0)) and not in_view(CAMERA, pose, (0.0, 9.9, 0.0), 24.0)
    assert not in_view(CAMERA, pose, (0.0, 10.1, 0.0))


def fly_over(target: tuple[float, float, float], noise_rad: float, rng: np.random.Generator) -> Intersection:
    """Rays to a target from a line at 15 m that passes it 4 m aside, each with its own attitude error."""
    place = Intersection(0.0)
    for i in range(40):
        position = (target[0] - 9.0 + i * 0.45, target[1] - 4.0, -15.0)
        true = rng.normal(scale=0.05, size=3)
        believed = true + rng.normal(scale=noise_rad, size=3)
        pixel = project(CAMERA, camera_pose(position, quaternion(*true.tolist()), NADIR), target)
        assert pixel is not None
        pose = camera_pose(position, quaternion(*believed.tolist()), NADIR)
        place.add(pixel_ray(CAMERA, pose, *pixel), place.point()[2] if place.count else 0.0)
    return place


def test_many_rays_find_place_and_height_without_a_map() -> None:
    """Ground 2.5 m above home: level ground at home's height would be wrong by 0.7 m even from overhead."""
    place = fly_over((30.0, 20.0, -2.5), 0.0, np.random.default_rng(1))
    assert place.point() == pytest.approx((30.0, 20.0, -2.5), abs=0.1)
    assert place.spread_rad > math.radians(60)


def test_noisy_rays_average_out() -> None:
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(30):
        target = (*rng.uniform(0, 80, size=2).tolist(), float(rng.uniform(-2.5, 2.5)))
        point = fly_over(target, math.radians(1.0), rng).point()
        errors.append(math.hypot(point[0] - target[0], point[1] - target[1]))
    assert math.sqrt(sum(e * e for e in errors) / len(errors)) < 0.25


def test_a_single_ray_takes_homes_height() -> None:
    pose = camera_pose((0.0, 0.0, -15.0), quaternion(0, 0, 0), NADIR)
    ray = pixel_ray(CAMERA, pose, 500.0, 100.0)
    place = Intersection(0.0)
    place.add(ray, 0.0)
    assert place.point() == pytest.approx(on_level_ground(ray, 0.0), abs=1e-3)


@pytest.mark.parametrize("prior_m", [0.0, 1.5])
def test_two_rays_and_homes_height_are_weighed_by_what_each_can_tell(prior_m: float) -> None:
    """Hand-worked: from 15 m up, 1 m to either side, to a target 2 m above home; sigma 1 degree of a ray, 2 m of home.

    By symmetry only the height is open. A ray of length r at an angle t from the vertical tells it with the weight
    (sin t / (r * 1 degree))^2, home's with 1 / 2^2: the estimate is their weighed mean.
    """
    place = Intersection(prior_m)
    for north in (-1.0, 1.0):
        way = np.array((-north, 0.0, 13.0))
        place.add(Ray(np.array((north, 0.0, -15.0)), way / np.linalg.norm(way)), -2.0)
    of_rays = 2.0 * (1.0 / math.hypot(1.0, 13.0) ** 2 / math.radians(1.0)) ** 2
    of_home = 1.0 / 2.0**2
    height = (of_rays * -2.0 + of_home * prior_m) / (of_rays + of_home)
    assert 0.3 < of_rays / of_home < 3.0  # or one of them would not be seen
    assert place.point() == pytest.approx((0.0, 0.0, height), abs=1e-6)


def test_merging_adds_the_rays() -> None:
    rng = np.random.default_rng(3)
    one, two = fly_over((10.0, 10.0, 1.5), 0.01, rng), fly_over((10.0, 10.0, 1.5), 0.01, rng)
    before = math.dist(one.point(), (10.0, 10.0, 1.5))
    one.merge(two)
    assert one.count == 80 and math.dist(one.point(), (10.0, 10.0, 1.5)) < before + 0.1


def test_the_covariance_is_what_many_tries_scatter_by() -> None:
    """Of 200 targets placed with rays of one degree's noise, the squared errors weighed by the covariance average 3."""
    rng = np.random.default_rng(5)
    weighed, sigmas = [], []
    for _ in range(200):
        target = (*rng.uniform(0, 80, size=2).tolist(), float(rng.normal(scale=2.0)))
        place = fly_over(target, math.radians(1.0), rng)
        nn, ne, nd, ee, ed, dd = covariance = place.covariance()
        error = np.subtract(place.point(), target)
        weighed.append(error @ np.linalg.inv([[nn, ne, nd], [ne, ee, ed], [nd, ed, dd]]) @ error)
        sigmas.append(covariance.horizontal_sigma_m)
    assert 1.5 < np.mean(weighed) < 4.0
    assert max(sigmas) < 0.25


def test_the_residual_tells_rays_of_one_place_from_those_of_two() -> None:
    one, two = (fly_over((40.0, east, 0.0), math.radians(1.0), np.random.default_rng(7)) for east in (40.0, 43.0))
    assert 0.1 < one.residual_m() < 0.5  # one degree at about 15 m, on two axes
    one.merge(two)
    assert one.residual_m() > 1.2
