"""Where a parcel lies, by the pictures before and after it was let go: over ground that is painted for the test."""

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, CameraPose, Distortion, camera_pose
from sitl_emu.missions.disaster.drop import CELL_M, View, find

PX_M = 0.02
SIDE = 1200
"""Of the painted ground, in pixels: 24 m, its middle at (0, 0)."""
ABOUT_M = (1.0, -2.0)
LENS = CameraModel(distortion=Distortion(k1=-0.05, k2=0.01))


def ground(seed: int, flicker: float = 0.0) -> npt.NDArray[np.float32]:
    """Grey levels, north up: patches, and a fine grain; `flicker` changes a pond in a corner."""
    rng = np.random.default_rng(seed)
    fine, coarse = (cv2.GaussianBlur(rng.normal(size=(SIDE, SIDE)), (0, 0), s) * s for s in (1.5, 12.0))
    made = 110.0 + 25.0 * fine + 60.0 * coarse
    made[:300, :300] += flicker
    return np.asarray(made, np.float32)


def with_box(painted: npt.NDArray[np.float32], north_m: float, east_m: float) -> npt.NDArray[np.float32]:
    """A parcel of 0.24 by 0.16 m, light, with a shadow to its right."""
    made = painted.copy()
    row, column = SIDE / 2 - north_m / PX_M, SIDE / 2 + east_m / PX_M
    top, left = round(row - 4), round(column - 6)
    made[top : top + 8, left + 12 : left + 15] *= 0.5
    made[top : top + 8, left : left + 12] = 215.0
    return made


def seen(painted: npt.NDArray[np.float32], pose: CameraPose, seed: int) -> npt.NDArray[np.uint8]:
    """The picture of the ground, pixel by pixel, with noise."""
    rows, columns = np.mgrid[0 : LENS.height, 0 : LENS.width].astype(np.float64)
    lens = np.array(((LENS.fx, 0.0, LENS.cx), (0.0, LENS.fy, LENS.cy), (0.0, 0.0, 1.0)))
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 1, 2)
    straight = cv2.undistortPoints(pixels, lens, np.array(LENS.distortion))[:, 0]
    rays = np.column_stack((straight, np.ones(len(straight)))) @ pose.to_ned.T
    at = pose.position_m + rays * (-pose.position_m[2] / rays[:, 2])[:, None]
    x = (SIDE / 2 + at[:, 1] / PX_M).reshape(rows.shape).astype(np.float32)
    y = (SIDE / 2 - at[:, 0] / PX_M).reshape(rows.shape).astype(np.float32)
    picture = cv2.remap(painted, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    noise = np.random.default_rng(seed).normal(scale=2.0, size=picture.shape)
    return np.asarray(np.clip(picture + noise, 0, 255), np.uint8)


def views(
    before: npt.NDArray[np.float32], after: npt.NDArray[np.float32], wrong_deg: float = 0.0, wrong_m: float = 0.0
) -> tuple[View, View]:
    """From 7 m, a little moved and turned; of the second pose the vehicle knows a wrong one."""
    first = camera_pose((0.6, -2.2, -7.0), quaternion(0.02, -0.03, 0.4), NADIR)
    second = camera_pose((0.9, -1.9, -7.2), quaternion(-0.03, 0.02, 0.45), NADIR)
    off = np.radians(wrong_deg)
    told = camera_pose((0.9 + wrong_m, -1.9, -7.2 - wrong_m), quaternion(-0.03 + off, 0.02, 0.45 - off), NADIR)
    return View(0, seen(before, first, 1), first), View(4_000_000, seen(after, second, 2), told)


@pytest.mark.parametrize("lies_m", [(1.0, -2.0), (2.1, -1.2), (-0.6, -3.4)])
def test_the_parcel_is_found_where_it_lies(lies_m: tuple[float, float]) -> None:
    painted = ground(3)
    found = find(*views(painted, with_box(painted, *lies_m)), LENS, ABOUT_M, 0.0)
    assert found is not None
    assert np.hypot(*np.subtract(found, lies_m)) < 4.0 * CELL_M


def test_poses_that_err_move_the_place_by_their_error_and_no_more() -> None:
    painted = ground(4)
    found = find(*views(painted, with_box(painted, 1.5, -2.5), 1.0, 0.2), LENS, ABOUT_M, 0.0)
    assert found is not None
    assert np.hypot(*np.subtract(found, (1.5, -2.5))) < 0.4


def test_where_nothing_came_nothing_is_seen() -> None:
    painted = ground(5)
    assert find(*views(painted, painted, 0.5, 0.1), LENS, ABOUT_M, 0.0) is None


def test_what_changes_over_a_large_area_is_no_parcel() -> None:
    assert find(*views(ground(6), ground(6, flicker=40.0)), LENS, (4.0, -4.0), 0.0) is None


def test_ground_without_looks_tells_nothing() -> None:
    plain = np.full((SIDE, SIDE), 100.0, np.float32)
    black = View(0, np.zeros((LENS.height, LENS.width), np.uint8), views(plain, plain)[0].pose)
    assert find(black, black, LENS, ABOUT_M, 0.0) is None


def test_a_place_beyond_both_pictures_tells_nothing() -> None:
    painted = ground(7)
    assert find(*views(painted, painted), LENS, (60.0, 60.0), 0.0) is None
