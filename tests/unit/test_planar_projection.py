"""The paper's equations 1 to 3 beside our own projection: where they agree, and by how much they miss elsewhere."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.camera_model import (
    NADIR,
    CameraModel,
    CameraPose,
    Point,
    body_to_ned,
    camera_pose,
)
from sitl_emu.missions.companion.geolocation import on_level_ground, pixel_ray
from sitl_emu.missions.companion.planar_projection import Offset, ground_offset, moved, pixels, placed
from tests.typed import present

CAMERA = CameraModel()
CENTRE = (319.5, 239.5)
HEIGHT_M = 20.0
HEADINGS = [0.0, 90.0, 180.0, 270.0]
OFF_CENTRE = st.tuples(st.floats(-319.5, 319.5), st.floats(-239.5, 239.5))


def right_side_forward(roll: float, pitch: float, yaw: float) -> CameraPose:
    """The mount that the equations are printed for: camera axes (right, down, along) are the body's."""
    position = camera_pose((0.0, 0.0, -HEIGHT_M), (1.0, 0.0, 0.0, 0.0), NADIR._replace(down_m=0.0)).position_m
    return CameraPose(position, body_to_ned(quaternion(roll, pitch, yaw)))


def top_forward(roll: float, pitch: float, yaw: float) -> CameraPose:
    return camera_pose((0.0, 0.0, -HEIGHT_M), quaternion(roll, pitch, yaw), NADIR._replace(down_m=0.0))


def by_ray(pose: CameraPose, du: float, dv: float, ground_down_m: float = 0.0) -> Point:
    return present(on_level_ground(pixel_ray(CAMERA, pose, CENTRE[0] + du, CENTRE[1] + dv), ground_down_m))


@pytest.mark.parametrize("heading_deg", HEADINGS)
@given(pixel=OFF_CENTRE)
def test_as_printed_they_are_right_with_the_pictures_right_side_forward(
    heading_deg: float, pixel: tuple[float, float]
) -> None:
    yaw = math.radians(heading_deg)
    assert ground_offset(CAMERA, HEIGHT_M, yaw, *pixel) == pytest.approx(
        by_ray(right_side_forward(0.0, 0.0, yaw), *pixel)[:2], abs=1e-6
    )


@pytest.mark.parametrize(("heading_deg", "right", "below"), [
    (0.0, (20.0, 0.0), (0.0, 15.0)), (90.0, (0.0, 20.0), (-15.0, 0.0)),
    (180.0, (-20.0, 0.0), (0.0, -15.0)), (270.0, (0.0, -20.0), (15.0, 0.0)),
])  # fmt: skip
def test_by_hand_the_pictures_right_edge_lies_ahead_and_its_lower_edge_to_the_right(
    heading_deg: float, right: Offset, below: Offset
) -> None:
    yaw = math.radians(heading_deg)
    assert ground_offset(CAMERA, HEIGHT_M, yaw, 320.0, 0.0) == pytest.approx(right, abs=1e-9)
    assert ground_offset(CAMERA, HEIGHT_M, yaw, 0.0, 240.0) == pytest.approx(below, abs=1e-9)


@pytest.mark.parametrize("heading_deg", HEADINGS)
@given(pixel=OFF_CENTRE)
def test_with_the_pictures_top_forward_the_vehicles_yaw_misses_by_a_quarter_turn(
    heading_deg: float, pixel: tuple[float, float]
) -> None:
    yaw = math.radians(heading_deg)
    north, east, _ = by_ray(top_forward(0.0, 0.0, yaw), *pixel)
    printed = ground_offset(CAMERA, HEIGHT_M, yaw, *pixel)
    away = math.hypot(printed.north_m - north, printed.east_m - east)
    assert away == pytest.approx(math.sqrt(2.0) * math.hypot(north, east), abs=1e-6)
    mended = ground_offset(CAMERA, HEIGHT_M, yaw + math.pi / 2.0, *pixel)
    assert mended == pytest.approx((north, east), abs=1e-6)


@pytest.mark.parametrize("heading_deg", HEADINGS)
@pytest.mark.parametrize("mounted", [right_side_forward, top_forward])
def test_placed_by_the_cameras_pose_either_mount_is_right(mounted, heading_deg: float) -> None:  # type: ignore[no-untyped-def]
    pose = mounted(0.0, 0.0, math.radians(heading_deg))
    for x, y in ((0.0, 0.0), (639.0, 479.0), (500.0, 100.0)):
        expected = on_level_ground(pixel_ray(CAMERA, pose, x, y), 1.5)
        assert placed(CAMERA, pose, x, y, 1.5) == pytest.approx(expected, abs=1e-6)


@given(pixel=OFF_CENTRE, relief_m=st.floats(-6.0, 6.0), yaw=st.floats(-3.1, 3.1))
def test_ground_that_is_higher_than_assumed_is_missed_by_its_height_times_the_tangent(
    pixel: tuple[float, float], relief_m: float, yaw: float
) -> None:
    pose = top_forward(0.0, 0.0, yaw)
    truth = by_ray(pose, *pixel, -relief_m)
    there = present(placed(CAMERA, pose, CENTRE[0] + pixel[0], CENTRE[1] + pixel[1], 0.0))
    away = math.hypot(there[0] - truth[0], there[1] - truth[1])
    assert away == pytest.approx(abs(relief_m) * math.hypot(*pixel) / 320.0, abs=1e-6)


@pytest.mark.parametrize(("du", "missed_m"), [(0.0, 1.75), (320.0, 3.84), (-320.0, 3.22)])
def test_a_tilt_of_five_degrees_is_missed_wholly(du: float, missed_m: float) -> None:
    """Rolled left side down, a camera with its top forward looks to the right."""
    pose = top_forward(math.radians(-5.0), 0.0, 0.0)
    truth = by_ray(pose, du, 0.0)
    there = present(placed(CAMERA, pose, CENTRE[0] + du, CENTRE[1], 0.0))
    assert truth[1] - there[1] == pytest.approx(missed_m, abs=0.01)


@given(yaw=st.floats(-3.1, 3.1), roll=st.floats(-0.3, 0.3), pitch=st.floats(-0.3, 0.3))
def test_the_heading_is_the_vehicles_whatever_its_tilt(yaw: float, roll: float, pitch: float) -> None:
    level, tilted = (placed(CAMERA, top_forward(*rp, yaw), 600.0, 30.0, 0.0) for rp in ((0.0, 0.0), (roll, pitch)))
    assert tilted == pytest.approx(level, abs=1e-6)


@given(north=st.floats(-500.0, 500.0), east=st.floats(-500.0, 500.0), lat=st.floats(-60.0, 60.0))
def test_equation_3_is_our_plane_on_the_sphere(north: float, east: float, lat: float) -> None:
    assert moved(lat, 8.0, Offset(north, east)) == pytest.approx(from_metres(north, east, lat, 8.0), abs=1e-10)


def test_below_the_ground_there_is_no_place() -> None:
    assert placed(CAMERA, top_forward(0.0, 0.0, 0.0), 300.0, 200.0, -HEIGHT_M) is None


@pytest.mark.parametrize("heading_deg", HEADINGS)
@given(OFF_CENTRE)
def test_the_way_back_gives_the_pixel_again(heading_deg: float, off: tuple[float, float]) -> None:
    pose = top_forward(0.0, 0.0, math.radians(heading_deg))
    x_px, y_px = CENTRE[0] + off[0], CENTRE[1] + off[1]
    north, east, _ = present(placed(CAMERA, pose, x_px, y_px, 0.0))
    x, y = pixels(CAMERA, pose, np.array([north]), np.array([east]), 0.0)
    assert (float(x[0]), float(y[0])) == pytest.approx((x_px, y_px), abs=1e-6)
    below, _ = pixels(CAMERA, pose, np.array([north]), np.array([east]), HEIGHT_M + 1.0)
    assert math.isnan(below[0])
