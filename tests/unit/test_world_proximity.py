"""OBSTACLE_DISTANCE from scans and depth images: the walls around a vehicle, however it leans."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.world import description
from sitl_emu.world.camera import Pose
from sitl_emu.world.lens import NADIR, Intrinsics, Mount
from sitl_emu.world.proximity import UNKNOWN, Obstacles
from sitl_emu.world.ranging import DepthCamera, Noise, Scan, ScanningLidar
from sitl_emu.world.world import World
from tests.typed import present

EXACT = Noise(0.0, 1, "exact")
SIDE_M, TOP_M = 12.0, 8.0
"""Half the side, inside, of a square of four walls, and their height."""
DOME = Scan(360, 61, -60.0, 60.0, 0.3, 60.0)


def wall(name: str, north_m: float, east_m: float, size_m: list[float]) -> dict[str, Any]:
    return {"name": name, "north_m": north_m, "east_m": east_m, "label": "wall", "box": {"size_m": size_m}}


@pytest.fixture(scope="module")
def court() -> World:
    far, long = SIDE_M + 0.25, 2.0 * SIDE_M + 1.0
    walls = [
        wall("north", far, 0.0, [0.5, long, TOP_M]),
        wall("south", -far, 0.0, [0.5, long, TOP_M]),
        wall("east", 0.0, far, [long, 0.5, TOP_M]),
        wall("west", 0.0, -far, [long, 0.5, TOP_M]),
    ]
    return World(description.read({"name": "court", "solids": walls}, "court"), Path())


def free_m(pose: Pose, heading: float, place: int) -> tuple[float, float]:
    """The shortest and the longest way to a wall within a place's 5 degrees."""
    ways = []
    for degrees in np.linspace(place * 5.0 - 2.5, place * 5.0 + 2.5, 41):
        n, e = math.cos(heading + math.radians(degrees)), math.sin(heading + math.radians(degrees))
        to_n = (math.copysign(SIDE_M, n) - pose.north_m) / n if abs(n) > 1e-9 else math.inf
        to_e = (math.copysign(SIDE_M, e) - pose.east_m) / e if abs(e) > 1e-9 else math.inf
        ways.append(min(to_n, to_e))
    return min(ways), max(ways)


def scan(world: World, pose: Pose, shape: Scan = DOME) -> Obstacles | None:
    lidar = ScanningLidar(world, shape, Mount(0.0, 0.0, 0.0, 0.0), EXACT)
    return lidar.obstacles(lidar.measure(pose, 0), pose)


@given(
    north=st.floats(-8.0, 8.0),
    east=st.floats(-8.0, 8.0),
    roll=st.floats(-0.5, 0.5),
    pitch=st.floats(-0.5, 0.5),
    yaw=st.floats(-3.1, 3.1),
)
def test_a_lidar_tells_how_far_the_walls_are_in_the_horizontal_however_it_leans(
    court: World, north: float, east: float, roll: float, pitch: float, yaw: float
) -> None:
    pose = Pose(north, east, -4.0, quaternion(roll, pitch, yaw))
    seen = present(scan(court, pose))
    assert (seen.nearest, seen.farthest) == (30, 4000)
    for place, distance in enumerate(seen.distances):
        shortest, longest = free_m(pose, yaw, place)
        assert shortest * 100.0 - 2.0 <= distance <= longest * 100.0 + 2.0


def test_index_0_is_ahead_and_they_go_clockwise(court: World) -> None:
    pose = Pose(2.0, 5.0, -4.0, quaternion(0.0, 0.0, math.pi / 2.0))
    seen = present(scan(court, pose))
    assert [seen.distances[place] for place in (0, 18, 36, 54)] == pytest.approx([700, 1400, 1700, 1000], abs=2)


def test_the_ground_below_and_what_is_flown_over_are_in_nobodys_way(court: World) -> None:
    """Above the walls, whose tops the lowest rays see."""
    seen = present(scan(court, Pose(0.0, 0.0, -TOP_M - 2.0, quaternion(0.0, -0.3, 0.0))))
    assert set(seen.distances) == {4001}
    lower = present(scan(court, Pose(0.0, 0.0, -TOP_M - 0.4, quaternion(0.0, 0.0, 0.0))))
    assert lower.distances[0] == pytest.approx(SIDE_M * 100.0, abs=2), "its legs would touch"


def test_what_no_ray_looked_at_is_unknown(court: World) -> None:
    ahead = DepthCamera(court, Intrinsics(64, 48, 60.0), Mount(0.0, 0.0, 0.0, 0.0), 30.0, EXACT)
    pose = Pose(0.0, 0.0, -4.0, quaternion(0.0, 0.0, 0.0))
    seen = present(ahead.obstacles(ahead.measure(pose, 0), pose))
    known = [place for place, distance in enumerate(seen.distances) if distance != UNKNOWN]
    assert known == [*range(7), *range(66, 72)], "60 degrees, 30 to either side"
    assert seen.distances[0] == pytest.approx(SIDE_M * 100.0, abs=2) and seen.farthest == 3000
    near = DepthCamera(court, Intrinsics(64, 48, 60.0), Mount(0.0, 0.0, 0.0, 0.0), 10.0, EXACT)
    assert present(near.obstacles(near.measure(pose, 0), pose)).distances[0] == 1001, "nothing within its reach"


def test_who_looks_down_or_leans_too_far_knows_nothing(court: World) -> None:
    pose = Pose(0.0, 0.0, -4.0, quaternion(0.0, 0.0, 0.0))
    down = DepthCamera(court, Intrinsics(32, 24, 60.0), NADIR, 30.0, EXACT)
    assert down.obstacles(down.measure(pose, 0), pose) is None
    flat = Scan(72, 4, -5.0, 5.0, 0.3, 60.0)
    leaning = present(scan(court, Pose(0.0, 0.0, -4.0, quaternion(0.0, -0.4, 0.0)), flat))
    assert leaning.distances[0] == leaning.distances[36] == UNKNOWN, "ahead it sees the ground, behind the sky"
    assert leaning.distances[18] == pytest.approx(SIDE_M * 100.0, abs=10)


def test_a_depth_camera_on_a_gimbal_sees_where_that_looks(court: World) -> None:
    camera = DepthCamera(court, Intrinsics(64, 48, 60.0), Mount(0.0, 0.0, 0.0, 0.0), 30.0, EXACT)
    pose, head = Pose(0.0, 3.0, -4.0, quaternion(0.2, -0.3, 0.5)), quaternion(0.0, 0.0, 0.5 + math.pi / 2.0)
    seen = present(camera.obstacles(camera.measure(pose, 0, head), pose, head))
    shortest, longest = free_m(pose, 0.5, 18)
    assert shortest * 100.0 - 2.0 <= seen.distances[18] <= longest * 100.0 + 2.0
    assert seen.distances[0] == UNKNOWN
