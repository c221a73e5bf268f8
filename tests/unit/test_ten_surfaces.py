"""Roofs, walls and rocks: lidar, depth camera, the picture's depth and contact have each of ten at the same place."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from sitl_emu.core.attitude import quaternion
from sitl_emu.vehicles.description import Body, Sphere
from sitl_emu.world import description
from sitl_emu.world.camera import Pose, body_to_ned, camera_to_body
from sitl_emu.world.lens import Intrinsics, Mount
from sitl_emu.world.ranging import DepthCamera, Noise, Scan, ScanningLidar
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.world import World
from tests.typed import present

AGREE_M = 0.05
AHEAD = Mount(0.0, 0.0, 0.0, 0.0)
EXACT = Noise(0.0, 1, "exact")
PICTURE = Intrinsics(65, 49, 60.0)
"""Odd, so that its middle is a pixel's."""
BALL_M = 0.02
GABLE = [[-5, -4, 0], [-5, 4, 0], [5, 4, 0], [5, -4, 0], [0, -4, 3], [0, 4, 3]]


class Aim(NamedTuple):
    """A solid, and the view to it: of its middle from a place above, in metres from there."""

    name: str
    solid: dict[str, Any]
    middle_up_m: float
    north_m: float
    east_m: float
    up_m: float


def rock(seed: int) -> dict[str, Any]:
    return {"points_m": (1.5 * np.random.default_rng(seed).normal(size=(20, 3))).round(3).tolist()}


AIMS = [
    Aim("flat roof", {"box": {"size_m": [8, 6, 5]}}, 4.5, 1.0, 0.5, 9.0),
    Aim("turned roof", {"box": {"size_m": [12, 5, 3]}, "heading_deg": 33}, 2.5, -3.0, 2.0, 8.0),
    Aim("gable", {"hull": {"points_m": GABLE}, "label": "roof"}, 1.0, 7.0, 0.3, 8.0),
    Aim("silo", {"cylinder": {"radius_m": 2.0, "height_m": 6.0}}, 5.5, 0.4, -0.6, 7.0),
    Aim("wall", {"box": {"size_m": [0.4, 12, 2.5]}, "label": "wall"}, 1.2, -9.0, 1.5, 1.0),
    Aim("slanted wall", {"box": {"size_m": [0.3, 9, 3]}, "heading_deg": 50, "label": "wall"}, 1.5, 6.0, -8.0, 2.0),
    Aim("leaning wall", {"box": {"size_m": [0.5, 6, 4]}, "pitch_deg": 15, "label": "wall"}, 1.8, -10.0, 0.0, 0.5),
    Aim("rock", {"hull": rock(1), "label": "rock"}, 0.4, 6.0, 4.0, 3.0),
    Aim("turned rock", {"hull": rock(2), "label": "rock", "heading_deg": 70, "pitch_deg": 20}, 0.4, -7.0, 3.0, 2.0),
    Aim("boulder", {"hull": rock(3), "label": "rock", "above_ground_m": 0.5}, 0.6, 1.0, -8.0, 5.0),
]
APART_M = 30.0


@pytest.fixture(scope="module")
def world() -> World:
    solids = [
        {"name": aim.name, "north_m": APART_M * (index // 4), "east_m": APART_M * (index % 4), **aim.solid}
        for index, aim in enumerate(AIMS)
    ]
    return World(description.read({"name": "ten", "solids": solids}, "ten"), Path())


@pytest.fixture(scope="module")
def scene(world: World) -> MeshScene:
    return MeshScene(world, Path())


@pytest.mark.parametrize("index", range(len(AIMS)), ids=[aim.name for aim in AIMS])
def test_all_who_measure_a_surface_find_it_at_the_same_place(world: World, scene: MeshScene, index: int) -> None:
    aim = AIMS[index]
    north_m, east_m = APART_M * (index // 4) + aim.north_m, APART_M * (index % 4) + aim.east_m
    yaw, level_m = math.atan2(-aim.east_m, -aim.north_m), math.hypot(aim.north_m, aim.east_m)
    q = quaternion(0.0, -math.atan2(aim.up_m, level_m), yaw)
    pose = Pose(north_m, east_m, -aim.middle_up_m - aim.up_m, q)

    lidar = ScanningLidar(world, Scan(1, 1, 0.0, 0.0, 0.1, 50.0), AHEAD, EXACT)
    (point,) = lidar.measure(pose, 0)
    by_lidar_m = float(point[0])
    by_depth_m = float(DepthCamera(world, PICTURE, AHEAD, 50.0, EXACT).measure(pose, 0)[24, 32])
    place = np.array(pose[:3])
    seen = scene.renderer(*PICTURE[:2], PICTURE.focal_px).look(place, body_to_ned(q) @ camera_to_body(AHEAD), 0.0)
    assert scene.names[int(seen.objects[24, 32])] == aim.name
    assert by_depth_m == pytest.approx(by_lidar_m, abs=AGREE_M)
    assert float(seen.depth_m[24, 32]) == pytest.approx(by_lidar_m, abs=AGREE_M)

    solids = present(world.solids)
    ball = solids.add_body(Body((Sphere((0.0, 0.0, 0.0), BALL_M),), crash_speed_m_s=4.0))
    n, e, d = place + by_lidar_m * body_to_ned(q)[:, 0]
    contacts = solids.touching(ball, (n, e, d), (1.0, 0.0, 0.0, 0.0), 0.5)
    assert {contact.other for contact in contacts} == {aim.name}
    from_surface_m = BALL_M - max(contact.depth_m for contact in contacts)
    assert abs(from_surface_m) < AGREE_M
