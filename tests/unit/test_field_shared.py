"""The field is painted in strips by whoever looks at them first; nobody's frames show it."""

import math
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.attitude import quaternion
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.kinds.corn_field.field import CornField, build
from sitl_emu.world.kinds.corn_field.painter import Layers, Painter
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.kinds.corn_field.sprites import Sprite, library
from sitl_emu.world.kinds.corn_field.whole import FIELD_GSD_M, SQUEEZE, STRIP_ROWS, WholeField, squeezed
from sitl_emu.world.lens import NADIR

SIDE_M = 60.0
TALL = build(3, (SIDE_M, 77.7), distractors=30, growth_stage=8)
"""Its plants and their shadows reach furthest over a strip's edge."""
forked = multiprocessing.get_context("fork")


@pytest.fixture
def shared_memory() -> Iterator[int]:
    fd = os.memfd_create("test_field_shared")
    yield fd
    os.close(fd)


@pytest.fixture(scope="module")
def painter() -> Painter:
    return Painter(TALL, FIELD_GSD_M)


def own(painter: Painter) -> Layers:
    """The whole field, painted at once."""
    whole = WholeField(TALL, lambda: painter).layers
    painted = painter.paint(whole.north0_m, whole.east0_m, *whole.canopy.shape[:2])
    return painted._replace(ground=squeezed(painted.ground))


def nobody() -> Painter:
    raise AssertionError("what others have painted is painted again")


def same(one: Layers, other: Layers) -> bool:
    return np.array_equal(one.ground, other.ground) and np.array_equal(one.canopy, other.canopy)


def in_a_process(work: Callable[[], object]) -> multiprocessing.process.BaseProcess:
    process = forked.Process(target=work)
    process.start()
    return process


def over(field: CornField, north: float, east: float, height: float, *angles: float) -> Pose:
    return Pose(north, east, -field.terrain.height_m(north, east) - height, quaternion(*angles))


_FINE = Painter(TALL, 0.016)
_WEED = TALL.targets[0]
_AT_ONCE = _FINE.paint(_WEED.north_m - 2.0, _WEED.east_m - 2.0, 250, 250)


@given(st.integers(0, 249), st.integers(1, 250))
def test_rows_of_a_rectangle_are_painted_to_the_same_pixels_as_all_of_it(first: int, count: int) -> None:
    part = first, min(first + count, 250)
    rows = _FINE.paint(_WEED.north_m - 2.0, _WEED.east_m - 2.0, 250, 250, part)
    assert np.array_equal(rows.ground, _AT_ONCE.ground[slice(*part)])
    assert np.array_equal(rows.canopy, _AT_ONCE.canopy[slice(*part)])


def test_no_plant_is_without_height_where_it_covers_the_ground() -> None:
    """The painter takes what has a height for covered."""
    for seed in range(6):
        for plant_height_m, gsd_m in ((0.32, 0.016), (0.62, FIELD_GSD_M)):
            sprites = sprites_of(seed, plant_height_m, gsd_m)
            heights = [int(sprite.bgra[sprite.mask > 0, 3].min()) for sprite in sprites if sprite.mask.any()]
            assert len(heights) > 60 and min(heights) > 0


def sprites_of(seed: int, plant_height_m: float, gsd_m: float) -> list[Sprite]:
    return [sprite for sprites in library(seed, plant_height_m, gsd_m).values() for sprite in sprites]


def test_a_field_painted_in_strips_is_the_field_painted_at_once(painter: Painter) -> None:
    whole = WholeField(TALL, lambda: painter)
    whole.paint(0.0, math.inf)
    assert same(whole.layers, own(painter))


@pytest.mark.parametrize(
    "pose",
    [
        over(TALL, 30, 30, 15.0, 0.02, 0.03, 1.0),
        over(TALL, 30, 30, 15.0, 0.7, -0.6, 2.0),
        over(TALL, -20, 5, 15.0, 0, 0, 0),
        over(TALL, -90, 5, 15.0, 0.3, 0, 0),
        over(TALL, SIDE_M + 30, 5, 25.0, 0, 0, 0),
        over(TALL, -400, 500, 15.0, 0, 0, 0),
        Pose(30, 30, -20.0, (0.7, 0.7, 0.14, 0.0)),
    ],
)
def test_what_is_not_in_view_need_not_be_painted(pose: Pose, painter: Painter, shared_memory: int) -> None:
    """The same frame, whether a strip is painted for it or all of them were; also where the picture is mirrored."""
    all_of_it = WholeField(TALL, lambda: painter, shared_memory)
    all_of_it.paint(-math.inf, math.inf)
    ready = Camera(FieldScene(TALL, shared_memory), NADIR, name="uas")
    lazy = Camera(FieldScene(TALL), NADIR, name="uas")
    assert np.array_equal(lazy.render(pose, 66_667), ready.render(pose, 66_667))


def test_one_look_paints_what_it_sees_and_no_more(painter: Painter) -> None:
    asked = list[int]()

    def counted() -> Painter:
        asked.append(1)
        return painter

    whole = WholeField(TALL, counted)
    whole.paint(STRIP_ROWS * 2 + 5.0, STRIP_ROWS * 4 - 5.0)
    assert len(asked) == 2
    whole.paint(STRIP_ROWS * 3 + 5.0, STRIP_ROWS * 5 - 5.0)
    assert len(asked) == 3
    assert not whole.layers.ground[STRIP_ROWS * 5 // SQUEEZE :].any()
    assert not whole.layers.canopy[STRIP_ROWS * 5 :].any()


def test_cameras_in_several_processes_paint_one_field(painter: Painter, shared_memory: int) -> None:
    """All at once, from other ends; what each sees is the field, and afterwards nothing is left to paint."""
    truth = own(painter)
    rows = len(truth.canopy)

    def look(first: int) -> None:
        mine = WholeField(TALL, lambda: painter, shared_memory)
        for start in range(0, rows, 100):
            at = (first + start) % rows
            seen = slice(at, min(at + 300, rows))
            mine.paint(seen.start, seen.stop - 1)
            below = slice(-(-seen.start // SQUEEZE), seen.stop // SQUEEZE)
            assert np.array_equal(mine.layers.ground[below], truth.ground[below])
            assert np.array_equal(mine.layers.canopy[seen], truth.canopy[seen])

    processes = [in_a_process(partial(look, at)) for at in (0, rows // 3, 0)]
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0, 0]
    later = WholeField(TALL, nobody, shared_memory)
    later.paint(0, rows)
    assert same(later.layers, truth)


def test_a_painter_that_is_killed_leaves_its_strip_to_the_next(painter: Painter, shared_memory: int) -> None:
    def dying() -> Painter:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError

    def half_of_it() -> None:
        mine = WholeField(TALL, lambda: painter, shared_memory)
        mine.paint(0, 5)
        # Something of a strip, and then the end, under its lock.
        mine.layers.canopy[STRIP_ROWS : STRIP_ROWS + 9] = 77
        WholeField(TALL, dying, shared_memory).paint(STRIP_ROWS + 5, STRIP_ROWS + 6)

    process = in_a_process(half_of_it)
    process.join()
    assert process.exitcode == -signal.SIGKILL
    mine = WholeField(TALL, lambda: painter, shared_memory)
    mine.paint(0, math.inf)
    assert same(mine.layers, own(painter))


def test_frames_do_not_depend_on_who_painted(shared_memory: int) -> None:
    def fly(norths: list[float]) -> list[npt.NDArray[np.uint8]]:
        camera = Camera(FieldScene(TALL, shared_memory), NADIR, name="uas")
        return [camera.render(over(TALL, north, 30, 15.0, 0.1, 0.05, 1.0), 66_667) for north in norths]

    alone = Camera(FieldScene(TALL), NADIR, name="uas")
    process = in_a_process(lambda: fly([10.0, 20.0]))
    process.join()
    for north, frame in zip((5.0, 15.0, 40.0), fly([5.0, 15.0, 40.0]), strict=True):
        assert np.array_equal(frame, alone.render(over(TALL, north, 30, 15.0, 0.1, 0.05, 1.0), 66_667))
