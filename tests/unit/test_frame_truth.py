"""What the renderer says is to be seen in a frame: boxes of things and areas, what hides them, what is cut."""

from typing import Any

import numpy as np
import pytest

from sitl_emu.world.render.burning import EMBERS_S
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.scene import MeshScene, View
from sitl_emu.world.render.truth import Area, Seen, mask_of, masked_regions, things_in
from tests.unit.test_render import DOWN, NOWHERE, world_of

WIDTH, HEIGHT, FOCAL = 320, 240, 160.0
BOXES = {"building": "house", "shed": "shed"}
WATER = Area("water_body", ("water",), gap_m=3.0, least_m2=4.0)


def seen_from(up: float, time_s: float = 0.0, **fields: Any) -> tuple[MeshScene, View, Pinhole]:
    """Straight down on the origin."""
    scene = MeshScene(world_of(**fields), NOWHERE)
    at = np.array((0.0, 0.0, -up))
    camera = Pinhole(at, DOWN, FOCAL, WIDTH, HEIGHT)
    return scene, scene.renderer(WIDTH, HEIGHT, FOCAL).look(at, DOWN, time_s), camera


def solid(name: str, north: float, east: float, up: float, label: str = "building", side: float = 4.0) -> Any:
    return {"name": name, "north_m": north, "east_m": east, "above_ground_m": up, "label": label,
            "box": {"size_m": [side, side, 1.0]}}  # fmt: skip


def test_a_box_is_where_the_lens_puts_it() -> None:
    scene, view, camera = seen_from(21.0, solids=[solid("a", 5.0, -6.0, 0.0)])
    (a,) = things_in(scene, view, camera, BOXES)
    # Its top is 20 m below, 8 px a metre, its foot 21 m; the picture's middle is (160, 120), north is up
    left, top, right, bottom = 160 - 8 * 8, 120 - 8 * 7, 160 - 4 * FOCAL / 21, 120 - 3 * FOCAL / 21
    assert np.allclose(a.box, (left, top, right, bottom), atol=1.01)
    assert a.whole_box is not None and np.allclose(a.whole_box, (left, top, right, bottom), atol=2.0)
    assert (a.name, a.label, a.is_cut, a.is_ignored) == ("a", "house", False, False)
    assert a.hidden == 0.0 and abs(a.pixels - 34 * 33) < 20


def test_what_stands_above_hides_a_share() -> None:
    scene, view, camera = seen_from(21.0, solids=[solid("low", 0, 0, 0.0), solid("roof", 0, 2, 1.2, "shed")])
    low, roof = sorted(things_in(scene, view, camera, BOXES), key=lambda each: each.name)
    assert roof.hidden == 0.0
    assert low.hidden == pytest.approx(0.53, abs=0.05)  # the nearer roof hides a little more than its half
    assert low.whole_box is not None and low.whole_box[2] > low.box[2] + 10
    assert low.pixels == int((view.objects == scene.names.index("low")).sum())


def test_what_reaches_beyond_the_picture_is_cut() -> None:
    scene, view, camera = seen_from(21.0, solids=[solid("a", 0.0, 20.0, 0.0)])
    (a,) = things_in(scene, view, camera, BOXES)
    assert a.is_cut and a.box[2] == WIDTH
    assert a.whole_box is not None and a.whole_box[2] > WIDTH
    assert a.hidden == 0.0  # what lies beyond the picture is cut, not hidden


def regions_in(scene: MeshScene, view: View, camera: Pinhole, area: Area) -> list[Seen]:
    return [seen for seen, _ in masked_regions(scene, view, camera, [area])]


def pond(name: str, south: float, west: float, north: float, east: float, level: float = 0.5) -> Any:
    corners = [[south, west], [south, east], [north, east], [north, west]]
    return {"name": name, "polygon_m": corners, "level_m": level}


def test_waters_that_nearly_touch_are_one_region() -> None:
    ponds = [pond("a", 0, -9, 4, -4), pond("b", 0, -2, 4, 4), pond("c", 0, 10, 4, 14)]
    scene, view, camera = seen_from(20.0, water=ponds)
    regions = sorted(regions_in(scene, view, camera, WATER), key=lambda each: each.box)
    assert len(regions) == 2
    both, alone = regions
    metre = FOCAL / 19.5
    assert np.allclose(both.box, (160 - 9 * metre, 120 - 4 * metre, 160 + 4 * metre, 120), atol=1.5)
    assert alone.box[0] == pytest.approx(160 + 10 * metre, abs=1.5)
    assert not any(each.is_ignored or each.is_cut for each in regions)


def test_of_a_lake_larger_than_the_picture_it_is_the_part_that_is_seen() -> None:
    scene, view, camera = seen_from(20.0, water=[pond("lake", -90, -90, 90, 90)])
    (lake,) = regions_in(scene, view, camera, WATER)
    assert (lake.box, lake.is_cut, lake.whole_box) == ((0.0, 0.0, WIDTH, HEIGHT), True, None)


def test_a_puddle_is_ignored_but_told() -> None:
    scene, view, camera = seen_from(20.0, water=[pond("puddle", 0, 0, 1.5, 1.5)])
    (puddle,) = regions_in(scene, view, camera, WATER)
    assert puddle.is_ignored


def test_fire_is_where_the_ground_burns_or_glows() -> None:
    """A front that has gone 5 m to the north in 50 s: what it left 30 s ago is cold."""
    fire = Area("fire_region", ("fire",), gap_m=3.0, least_m2=1.5, burns=True)
    front = {"name": "front", "polygon_m": [[-4, -6], [-4, 6], [0, 6], [0, -6]], "spread_m_s": 0.1, "burns_s": 20.0}
    wind = {"north_m_s": 3.0, "east_m_s": 0.0}
    scene, view, camera = seen_from(20.0, 50.0, fires=[front], wind=wind)
    mask = mask_of(scene, view, camera, fire, 50.0)
    north_m = (HEIGHT / 2 - np.arange(HEIGHT) - 0.5) * 20.0 / FOCAL
    burning = north_m[mask[:, WIDTH // 2]]
    assert burning.max() == pytest.approx(5.0, abs=0.3)
    assert burning.min() == pytest.approx(5.0 - 0.1 * (20.0 + EMBERS_S), abs=0.3)


def test_loose_pieces_are_ignored_and_make_no_ruin_larger() -> None:
    ruin = Area("debris_field", ("debris slab",), gap_m=1.0, least_m2=3.0, ignored=("debris rubble",))
    pieces = [solid("slab", 0.0, 0.0, 0.0, "debris slab"), solid("stone", 0.0, 2.8, 0.0, "debris rubble", 1.0)]
    scene, view, camera = seen_from(20.0, solids=pieces)
    heap, stone = regions_in(scene, view, camera, ruin)
    assert (heap.is_ignored, stone.is_ignored) == (False, True)
    assert heap.box[2] < stone.box[0]


def test_nothing_in_view_is_no_region() -> None:
    scene, view, camera = seen_from(20.0, solids=[solid("a", 0, 0, 0)])
    assert regions_in(scene, view, camera, WATER) == []
