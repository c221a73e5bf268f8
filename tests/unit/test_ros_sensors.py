"""Frames of feeds as sensor_msgs: what is told leads back to what was seen."""

import math

import cv2
import numpy as np
import pytest

from sitl_emu.run.configs import LidarDescription
from sitl_emu.run.ros import sensors
from sitl_emu.world.camera import FloatArray, Pose
from sitl_emu.world.lens import Distortion, Intrinsics, Mount, distorted
from sitl_emu.world.ranging import DepthCamera, Noise, Scan, ScanningLidar
from sitl_emu.world.rays import Hits


class Room:
    """Walls 4 m north and 3 m east of the origin, and ground 2 m below; nothing else."""

    def raycast(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """How far it is to the nearest."""
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (np.array((4.0, 3.0, 2.0)) - origins) / directions
        far[~(far > 0.0)] = np.inf
        nearest = far.min(axis=1)
        nearest[nearest > reach_m] = np.inf
        return Hits(nearest, [""] * len(nearest), np.zeros_like(directions))

    echoes = raycast


HERE = Pose(0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0))
EXACT = Noise(0.0, 1, "x")


def lidar(**more: object) -> LidarDescription:
    figures = {
        "columns": 36,
        "rows": 1,
        "elevation_deg": (0.0, 0.0),
        "range_m": (0.1, 20.0),
        "noise_m": 0.0,
        "place_m": (0.5, -0.25, 0.125),
        "depression_deg": 0.0,
        "rate_hz": 10.0,
        "latency_s": 0.0,
        "tells_obstacles": False,
    }
    return LidarDescription(**(figures | more))  # type: ignore[arg-type]


def scanned(described: LidarDescription) -> sensors.Array:
    scan = Scan(described.columns, described.rows, *described.elevation_deg, *described.range_m)
    mount = Mount(*described.place_m, described.depression_deg)
    return ScanningLidar(Room(), scan, mount, EXACT).measure(HERE, 0)


def test_a_scan_of_one_plane_goes_round_to_the_left() -> None:
    described = lidar()
    assert sensors.is_plane(described)
    points = sensors.in_lidar(scanned(described), described)
    told = sensors.scan(5_000_000, "ugv/lidar_link", points, described)
    ranges = told["ranges"]
    assert (told["angle_min"], told["angle_increment"]) == (0.0, pytest.approx(math.radians(10.0)))
    assert told["angle_max"] == pytest.approx(math.radians(350.0))
    assert ranges[0] == pytest.approx(3.5)  # the wall ahead
    assert ranges[27] == pytest.approx(3.25)  # 270° to the left: right
    assert math.isinf(ranges[9]) and math.isinf(ranges[18])
    assert len(ranges) == 36


def test_a_lidar_that_looks_about_is_no_scan() -> None:
    assert not sensors.is_plane(lidar(rows=16, elevation_deg=(-15.0, 15.0)))
    assert not sensors.is_plane(lidar(elevation_deg=(-5.0, -5.0)))


def test_points_are_told_in_the_lidar_s_own_axes() -> None:
    described = lidar(rows=2, elevation_deg=(-10.0, 10.0), depression_deg=30.0)
    points = sensors.in_lidar(scanned(described), described)
    elevation = np.degrees(np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])))
    assert np.allclose(np.abs(elevation), 10.0, atol=1e-3)
    told = sensors.cloud(0, "ugv/lidar_link", points)
    assert (told["height"], told["width"], told["row_step"]) == (1, len(points), 12 * len(points))
    assert np.allclose(np.frombuffer(told["data"], "<f4").reshape(-1, 3), points, atol=1e-6)
    assert [(field["name"], field["offset"]) for field in told["fields"]] == [("x", 0), ("y", 4), ("z", 8)]


def test_depth_s_points_lie_where_it_saw_them() -> None:
    """Straight ahead stands the wall; the ground lies 2 m below, the wall to the right 3 m away."""
    seen = Intrinsics(64, 48, 90.0)
    depth = DepthCamera(Room(), seen, Mount(0.0, 0.0, 0.0, 0.0), 10.0, EXACT).measure(HERE, 0)
    depth[0, 0] = np.inf
    points = sensors.depth_points(depth, seen)
    assert np.isnan(points[0, 0]).all()
    x, y, z = points[~np.isnan(points[..., 0])].T
    on_something = (np.abs(z - 4.0) < 1e-4) | (np.abs(x - 3.0) < 1e-4) | (np.abs(y - 2.0) < 1e-4)
    assert on_something.all()
    told = sensors.cloud(0, "uas/depth_camera_optical_frame", points)
    assert (told["height"], told["width"], told["is_dense"], len(told["data"])) == (48, 64, False, 64 * 48 * 12)


def test_a_camera_s_info_projects_as_its_lens_does() -> None:
    lens = Distortion(-0.12, 0.015, 0.001, -0.002, 0.0)
    seen = Intrinsics(640, 480, 70.0, lens)
    told = sensors.camera_info(0, "uas/camera_optical_frame", seen)
    matrix, coefficients = np.array(told["k"]).reshape(3, 3), np.array(told["d"])
    points = np.array(((0.3, -0.2, 1.0), (-0.5, 0.4, 1.0)))
    by_opencv, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, coefficients)
    x, y = distorted(points[:, 0], points[:, 1], lens)
    ours = np.stack((x * seen.focal_px + 319.5, y * seen.focal_px + 239.5), axis=-1)
    assert np.allclose(by_opencv[:, 0], ours, atol=1e-9)
    assert told["p"][0] == told["k"][0] == seen.focal_px


def test_pictures_are_as_they_were_drawn() -> None:
    picture = np.random.default_rng(1).integers(0, 255, (48, 64, 3), np.uint8)
    told = sensors.image(1, "uas/camera_optical_frame", picture, "bgr8")
    assert (told["height"], told["width"], told["step"]) == (48, 64, 192)
    assert np.array_equal(np.frombuffer(told["data"], np.uint8).reshape(picture.shape), picture)
    smooth = cv2.GaussianBlur(picture, (0, 0), 5)
    compressed = sensors.compressed_image(1, "uas/camera_optical_frame", smooth)
    again = cv2.imdecode(np.frombuffer(compressed["data"], np.uint8), cv2.IMREAD_COLOR)
    assert again is not None
    assert np.abs(again.astype(int) - smooth).mean() < 2.0
