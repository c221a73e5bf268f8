"""Every generated world from eight places: another's rays meet the same things, and the bytes are always the same."""

import hashlib
import os
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from sitl_emu.run import worlds
from sitl_emu.world.render import ground_map, shared
from sitl_emu.world.render.maps import SIDE
from sitl_emu.world.render.scene import MeshRenderer, MeshScene
from sitl_emu.world.world import World
from tests import embree
from tools.bench_renderer import AT_S, KINDS, VIEWS, pose

F64 = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]


@lru_cache(maxsize=1)
def seen_by(kind: str) -> tuple[World, MeshScene, MeshRenderer]:
    """A world, and who draws it."""
    world = worlds.build(kind, 1, {})
    scene = MeshScene(world, world.folder)
    return world, scene, scene.renderer(640, 480, 320.0)


@pytest.mark.slow
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("kind", KINDS)
def test_objects_and_depth_agree_with_embree(kind: str, view: str) -> None:
    """The same triangles, by rays of another's make. Flames are no triangles, and have no depth."""
    world, scene, renderer = seen_by(kind)
    place, rotation = pose(world, view)
    seen = renderer.look(place, rotation, AT_S)
    theirs, range_m = embree.seen_by_rays(scene, renderer, place, rotation)
    burning = np.isin(seen.objects, np.flatnonzero(np.array(scene.labels) == "fire"))
    gap = np.abs(range_m - seen.depth_m)
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
    code = "import tests.unit.test_render_worlds as t; print(*map(t.digest, t.KINDS * 2))"

    def drawn(**environment: str) -> list[str]:
        command = [sys.executable, "-c", code]
        given = {**os.environ, **environment}
        told = subprocess.run(command, cwd=ROOT, env=given, capture_output=True, text=True, check=True)
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


def test_whoever_has_the_turn_to_make_shared_arrays_is_alone() -> None:
    fd = os.memfd_create("test")

    def others() -> bool:
        """Whether another process would have it now."""
        child = os.fork()
        if child == 0:
            with shared.turn(fd) as is_ours:
                os._exit(int(is_ours))
        return bool(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))

    try:
        with pytest.raises(ZeroDivisionError), shared.turn(fd) as is_ours:
            assert is_ours and not others()
            raise ZeroDivisionError
        assert others(), "one who failed leaves it to the next"
        with shared.turn(fd):
            shared.arrays(fd, lambda: [np.ones(3)])
        with shared.turn(fd) as is_ours:
            assert not is_ours and not others(), "all is made"
    finally:
        os.close(fd)


@pytest.mark.parametrize("kind", KINDS)
def test_no_ground_is_shown_by_a_texture_that_nobody_drew(kind: str) -> None:
    """The map names no detail texture but those that are foretold, and drawn, from the description."""
    world, scene, _ = seen_by(kind)
    named = set(np.unique(scene.surfaces.ground.texels >> 24).tolist())
    assert named <= ground_map.details(world.description.ground, world.description.cover)
    starts = scene.surfaces.textures.starts
    assert all(scene.surfaces.textures.texels[starts[0] + number * SIDE * SIDE] for number in named)
