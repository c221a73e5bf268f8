"""Depth cameras and scanning lidars: what they measure lies where the world's surfaces are."""

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion import camera_model
from sitl_emu.world import description
from sitl_emu.world.camera import OtherVehicle, Pose, body_to_ned
from sitl_emu.world.lens import NADIR, Intrinsics, Mount
from sitl_emu.world.ranging import DepthCamera, Noise, Scan, ScanningLidar
from sitl_emu.world.world import World

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
ROOF_M, WALL_NORTH_M = 4.0, 39.8
"""Of the yard's house (20 to 30 m north, 4 to 16 m east), and the near side of its wall."""
LENS = Intrinsics(32, 24, 87.0)
EXACT = Noise(0.0, 1, "exact")
SCAN = Scan(90, 8, -15.0, 15.0, 0.5, 60.0)


@pytest.fixture(scope="module")
def yard() -> World:
    return World(description.load(YARD), YARD.parent)


def level(north_m: float, east_m: float, up_m: float, heading_deg: float = 0.0) -> Pose:
    return Pose(north_m, east_m, -up_m, quaternion(0.0, 0.0, math.radians(heading_deg)))


def surface_distance_m(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """How far each point (n, 3) NED is from the ground, the house, the wall and the person's start."""
    north, east, up = points[:, 0], points[:, 1], -points[:, 2]

    def outside(value: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
        return np.asarray(np.maximum(0.0, np.maximum(low - value, value - high)))

    def slab(north_m: tuple[float, float], east_m: tuple[float, float], top_m: float) -> npt.NDArray[np.float64]:
        away = np.stack((outside(north, *north_m), outside(east, *east_m), outside(up, 0.0, top_m)))
        inside = np.minimum.reduce(
            [np.abs(north - each) for each in north_m] + [np.abs(east - each) for each in east_m] + [np.abs(up - top_m)]
        )
        far = np.linalg.norm(away, axis=0)
        return np.asarray(np.where(far > 0.0, far, inside))

    house, wall = slab((20.0, 30.0), (4.0, 16.0), ROOF_M), slab((39.8, 40.2), (-15.0, 15.0), 2.5)
    person = np.where((np.hypot(north - 10.0, east + 5.0) < 0.301) & (up < 1.76), 0.0, np.inf)
    return np.asarray(np.minimum.reduce([np.abs(up), house, wall, person]))


def test_depth_straight_down_is_the_height_above_a_roof_and_above_the_ground(yard: World) -> None:
    camera = DepthCamera(yard, LENS, NADIR, 20.0, EXACT)
    roof = camera.measure(level(25.0, 10.0, 8.15), 0)
    assert roof.shape == (24, 32) and roof.dtype == np.float32
    assert np.allclose(roof, 8.0 - ROOF_M, atol=1e-3), "along the optical axis, so the same in every pixel"
    assert np.allclose(camera.measure(level(0.0, -10.0, 8.15), 0), 8.0, atol=1e-3)


def test_the_picture_lies_as_a_cameras_does(yard: World) -> None:
    """Over the house's southern edge, heading north: the roof is at the picture's top; heading east, at its left."""
    camera = DepthCamera(yard, LENS, NADIR, 20.0, EXACT)
    north = camera.measure(level(20.0, 10.0, 8.15), 0)
    assert np.allclose(north[:11], 4.0, atol=1e-3) and np.allclose(north[-3:], 8.0, atol=1e-3)
    east = camera.measure(level(20.0, 10.0, 8.15, 90.0), 0)
    assert np.allclose(east[:, :15], 4.0, atol=1e-3) and np.allclose(east[:, -3:], 8.0, atol=1e-3)


def test_beyond_its_reach_a_depth_camera_sees_nothing(yard: World) -> None:
    forward = DepthCamera(yard, LENS, Mount(0.0, 0.0, 0.0, 0.0), 10.0, EXACT)
    depth = forward.measure(level(32.0, 0.0, 1.0), 0)
    assert np.all(depth[0] == math.inf), "above the wall"
    assert depth[12, 16] == pytest.approx(WALL_NORTH_M - 32.0, abs=1e-3)
    assert np.all(forward.measure(level(25.0, -10.0, 1.0), 0)[11] == math.inf), "the wall is 14.8 m away"


poses = st.builds(
    lambda north, east, up, roll, pitch, yaw: Pose(north, east, -up, quaternion(roll, pitch, yaw)),
    st.floats(5.0, 35.0),
    st.floats(-12.0, 12.0),
    st.floats(5.0, 15.0),
    st.floats(-0.5, 0.5),
    st.floats(-0.5, 0.5),
    st.floats(-3.1, 3.1),
)


@given(pose=poses, depression_deg=st.floats(30.0, 90.0))
def test_what_a_companion_makes_of_depth_lies_on_surfaces(yard: World, pose: Pose, depression_deg: float) -> None:
    mount = (0.1, -0.05, 0.2, depression_deg)
    depth = DepthCamera(yard, LENS, Mount(*mount), 60.0, EXACT).measure(pose, 0)
    model = camera_model.CameraModel(32, 24, LENS.focal_px, LENS.focal_px, 15.5, 11.5)
    place = (pose.north_m, pose.east_m, pose.down_m)
    seen = camera_model.depth_points(
        model, camera_model.camera_pose(place, pose.q, camera_model.Mount(*mount)), depth
    ).reshape(-1, 3)
    shown = seen[np.isfinite(depth).ravel()]
    assert len(shown) > 0 and surface_distance_m(shown).max() < 0.01
    assert not np.isfinite(seen[np.isinf(depth).ravel()]).all(axis=1).any()


@given(pose=poses, tilt_deg=st.floats(-20.0, 60.0))
def test_what_a_companion_makes_of_a_scan_lies_on_surfaces(yard: World, pose: Pose, tilt_deg: float) -> None:
    lidar = ScanningLidar(yard, SCAN, Mount(0.1, 0.0, -0.2, tilt_deg), EXACT)
    points = lidar.measure(pose, 0)
    seen = camera_model.body_points((pose.north_m, pose.east_m, pose.down_m), pose.q, points)
    assert points.dtype == np.float32 and surface_distance_m(seen).max(initial=0.0) < 0.01


def test_a_scan_finds_the_wall_at_its_place_and_begins_straight_ahead(yard: World) -> None:
    lidar = ScanningLidar(
        yard, SCAN._replace(columns=360, rows=1, lowest_deg=0.0, highest_deg=0.0), Mount(0.0, 0.0, 0.0, 0.0), EXACT
    )
    points = lidar.measure(level(32.0, 0.0, 1.0), 0)
    assert points[0] == pytest.approx((WALL_NORTH_M - 32.0, 0.0, 0.0), abs=1e-3)
    assert points[1, 1] > 0.0, "clockwise: then to the right"
    turned = lidar.measure(level(32.0, 0.0, 1.0, 90.0), 0)
    ahead = turned[np.argmin(np.abs(np.arctan2(turned[:, 1], turned[:, 0]) + math.pi / 2))]
    assert ahead == pytest.approx((0.0, -(WALL_NORTH_M - 32.0), 0.0), abs=1e-3), "heading east, the wall is on the left"


def test_a_scan_leaves_out_what_is_too_near_and_too_far(yard: World) -> None:
    flat = SCAN._replace(rows=1, lowest_deg=0.0, highest_deg=0.0, farthest_m=7.0)
    far = ScanningLidar(yard, flat, Mount(0.0, 0.0, 0.0, 0.0), EXACT).measure(level(39.0, 0.0, 1.0), 0)
    assert len(far) and np.linalg.norm(far, axis=1).max() <= 7.0
    near = ScanningLidar(yard, flat._replace(nearest_m=2.0), Mount(0.0, 0.0, 0.0, 0.0), EXACT)
    assert np.linalg.norm(near.measure(level(39.0, 0.0, 1.0), 0), axis=1).min() >= 2.0


def test_noise_is_as_large_as_said_new_at_each_moment_and_the_same_in_every_run(yard: World) -> None:
    def at(time_us: int, seed: int = 1) -> npt.NDArray[np.float32]:
        return DepthCamera(yard, LENS, NADIR, 20.0, Noise(0.05, seed, "uas depth")).measure(
            level(0, -10, 8.15), time_us
        )

    error = np.concatenate([(at(time_us) - 8.0).ravel() for time_us in range(0, 1_000_000, 200_000)])
    assert error.std() == pytest.approx(0.05, rel=0.05) and abs(error.mean()) < 0.005
    assert (
        np.array_equal(at(0), at(0)) and not np.array_equal(at(0), at(200_000)) and not np.array_equal(at(0), at(0, 2))
    )


def test_things_that_walk_are_where_they_are_at_that_time(yard: World) -> None:
    """The yard's person starts 10 m north, 5 m west, and is 7.5 m east after 10 s."""
    lidar = ScanningLidar(
        yard, SCAN._replace(columns=720, rows=1, lowest_deg=0.0, highest_deg=0.0), Mount(0, 0, 0, 0), EXACT
    )
    pose = level(6.0, -5.0, 1.0)
    assert lidar.measure(pose, 0)[0, 0] == pytest.approx(3.7, abs=0.01)
    later = camera_model.body_points((6.0, -5.0, -1.0), pose.q, lidar.measure(pose, 10_000_000))
    near = later[np.hypot(later[:, 0] - 10.0, later[:, 1] - 7.5) < 0.35]
    assert len(near), "and not where it was"
    assert not (np.hypot(later[:, 0] - 10.0, later[:, 1] + 5.0) < 1.0).any()


# --- other vehicles ---------------------------------------------------------------------------------------------------


def test_another_vehicle_is_met_where_its_spheres_are(yard: World) -> None:
    m600 = vehicles.load("m600")
    assert m600.body is not None
    lidar = ScanningLidar(yard, SCAN, Mount(0.0, 0.0, 0.0, 0.0), EXACT)
    here, there = level(10.0, -20.0, 30.0), level(14.0, -18.0, 30.0, heading_deg=70.0)
    assert not len(lidar.measure(here, 0)), "nothing else is that high"
    yard.put_vehicles([OtherVehicle("other", m600, there, True)])
    try:
        points = lidar.measure(here, 0)
        hits = yard.raycast(
            np.array([(10.0, -20.0, -30.0)]), np.array([(4.0, 2.0, 0.0)]) / math.hypot(4.0, 2.0), 0.0, 60.0
        )
    finally:
        yard.put_vehicles([])
    assert len(points) > 3 and hits.name == ["other"]
    assert np.einsum("ij,ij->i", hits.normal, np.array([(4.0, 2.0, 0.0)]))[0] < 0.0
    to_body = body_to_ned(there.q).T
    apart = np.array((here.north_m - there.north_m, here.east_m - there.east_m, here.down_m - there.down_m))
    in_its_axes = (points + apart) @ to_body.T
    away = [np.linalg.norm(in_its_axes - sphere.centre_m, axis=1) - sphere.radius_m for sphere in m600.body.spheres]
    assert np.abs(np.minimum.reduce(away)).max() < 1e-5
    assert not len(lidar.measure(here, 0))
