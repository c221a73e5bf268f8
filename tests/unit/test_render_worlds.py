"""Every generated world from eight places: another's rays meet the same things, and the bytes are always the same."""

import hashlib
import math
import os
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.run import worlds
from sitl_emu.world.render import shared
from sitl_emu.world.render.scene import MeshRenderer, MeshScene
from sitl_emu.world.world import World

F64 = npt.NDArray[np.float64]
KINDS = ("urban_flood", "debris_field", "wildfire_perimeter")
AT_S = 20.0
VIEWS = {  # share of the area north and east, height m, heading and degrees below the horizon
    "nadir 5 m": (0.45, 0.45, 5.0, 0.0, 90.0),
    "nadir 15 m": (0.5, 0.5, 15.0, 0.0, 90.0),
    "nadir 30 m": (0.5, 0.5, 30.0, 0.0, 90.0),
    "nadir 60 m": (0.5, 0.5, 60.0, 0.0, 90.0),
    "oblique": (0.2, 0.25, 24.0, 40.0, 38.0),
    "forward": (0.35, 0.6, 9.0, 100.0, 15.0),
    "street": (0.62, 0.5, 1.7, 180.0, 3.0),
    "whole world": (-0.1, -0.1, 60.0, 45.0, 28.0),
}
pytestmark = pytest.mark.timeout(600)


@lru_cache(maxsize=1)
def seen_by(kind: str) -> tuple[World, MeshScene, MeshRenderer]:
    """A world, and who draws it."""
    world = worlds.build(kind, 1, {})
    scene = MeshScene(world, world.folder)
    return world, scene, scene.renderer(640, 480, 320.0)


def pose(world: World, view: str) -> tuple[F64, F64]:
    """A view's place and axes in NED."""
    n, e, above, heading, below = VIEWS[view]
    north, east = np.max(world.description.area_m, axis=0)
    h, p = math.radians(heading), math.radians(below)
    ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
    right = np.array((-math.sin(h), math.cos(h), 0.0))
    axes = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    return np.array((n * north, e * east, -world.ground(n * north, e * east) - above)), axes


@pytest.mark.slow
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", KINDS)
def test_objects_and_depth_agree_with_embree(kind: str, view: str) -> None:
    """The same triangles, by rays of another's make. Flames are no triangles, and have no depth."""
    rtcore_scene = pytest.importorskip("embreex.rtcore_scene", reason="embreex has no wheel for this machine")
    from embreex.mesh_construction import TriangleMesh

    world, scene, renderer = seen_by(kind)
    place, rotation = pose(world, view)
    seen = renderer.look(place, rotation, AT_S)
    drawn, meshes, things = renderer._drawn, scene.meshes, scene.things
    corners, objects = [], []
    for instance, level in zip(drawn.instance[: renderer.count], drawn.level, strict=False):
        first, end, begin, stop = meshes.levels[level]
        own = meshes.corners[first:end].astype(float) @ things.rotation[instance].T + things.place[instance] - place
        corners.append(own[meshes.triangles[begin:stop]])
        objects += [int(things.objects[instance])] * (stop - begin)
    soup = rtcore_scene.EmbreeScene()
    TriangleMesh(soup, np.concatenate(corners).astype(np.float32))
    x, y = (np.arange(640) + 0.5 - 320.0) / 320.0, (np.arange(480) + 0.5 - 240.0) / 320.0
    grid = np.stack((*np.meshgrid(x, y), np.ones((480, 640))), axis=2).reshape(-1, 3)
    rays = (grid @ rotation.T).astype(np.float32)
    met = soup.run(np.zeros_like(rays), rays, output=True)
    theirs = np.where(met["primID"] >= 0, np.array([*objects, -1])[met["primID"]], -1).reshape(480, 640)
    burning = np.isin(seen.objects, np.flatnonzero(np.array(scene.labels) == "fire"))
    gap = np.abs(met["tfar"].reshape(480, 640) - seen.depth_m)
    # Walls and their parapets have faces in one plane: either may be named
    differ = (theirs != seen.objects) & ~burning & ~(gap < 1e-3)
    assert int(differ.sum()) <= 20
    both = ~differ & ~burning & (theirs >= 0) & (seen.depth_m < 200.0)
    assert float(np.mean(gap[both] < 1e-3)) > 0.99


def digest(kind: str) -> str:
    """Of picture, depth and objects of a small frame."""
    world, scene, _ = seen_by(kind)
    summed = hashlib.sha256()
    for part in scene.renderer(160, 120, 80.0).look(*pose(world, "oblique"), AT_S):
        summed.update(np.ascontiguousarray(part).tobytes())
    return summed.hexdigest()


@pytest.mark.slow
def test_worlds_have_the_same_bytes_also_on_another_kind_of_processor() -> None:
    """Compiled for a generic one: no vector instructions but the oldest."""
    code = "import sys; sys.path.insert(0, sys.argv[1]); import test_render_worlds as t; "
    code += "print(*map(t.digest, t.KINDS * 2))"

    def drawn(**environment: str) -> list[str]:
        command = [sys.executable, "-c", code, str(Path(__file__).parent)]
        told = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
        return told.stdout.split()[-2 * len(KINDS) :]

    own = drawn()
    assert own[: len(KINDS)] == own[len(KINDS) :]
    assert drawn(NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="") == own


# --- shared memory ----------------------------------------------------------------------------------------------------


def test_cameras_that_share_what_they_look_up_see_the_same() -> None:
    fd = os.memfd_create("test")
    try:
        world = worlds.build("debris_field", 3, {"size_m": 60, "ruins": 1, "rubble": 20})
        views = [
            MeshScene(world, world.folder, shared_fd).renderer(160, 120, 80.0).look(*pose(world, "oblique"), 0.0)
            for shared_fd in (None, fd, fd)
        ]
        assert os.fstat(fd).st_size > 20_000_000
        for view in views[1:]:
            assert np.array_equal(view.picture, views[0].picture)
            assert np.array_equal(view.depth_m, views[0].depth_m)
            assert np.array_equal(view.objects, views[0].objects)
    finally:
        os.close(fd)


def test_shared_arrays_are_made_once_and_again_after_one_who_died_over_it() -> None:
    fd = os.memfd_create("test")
    made = list[int]()

    def make() -> list[npt.NDArray[np.generic]]:
        made.append(len(made))
        return [np.arange(5, dtype=np.int32), np.zeros((3, 2), np.float32), np.full((2, 3), 7, np.uint8)]

    try:
        with pytest.raises(ZeroDivisionError):
            shared.arrays(fd, lambda: (np.ones(1 // k) for k in (1, 0)))
        first, second = shared.arrays(fd, make), shared.arrays(fd, make)
        assert made == [0]
        for one, other, own in zip(first, second, make(), strict=True):
            assert np.array_equal(one, own) and one.dtype == own.dtype
            assert np.array_equal(one, other)
        first[1][2, 1] = 9.0
        assert second[1][2, 1] == 9.0, "they are the same memory"
    finally:
        os.close(fd)
