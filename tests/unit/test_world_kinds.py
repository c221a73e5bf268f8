"""Generated worlds: the same from the same seed, files that can be read again, and what their options do."""

import math
from pathlib import Path

import numpy as np
import pytest

from sitl_emu.run import preview, worlds
from sitl_emu.world import kinds
from sitl_emu.world.description import WorldError, load
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.world import World

KINDS = ["urban_flood", "debris_field", "wildfire_perimeter"]
LABELS = {
    "urban_flood": {"building", "roof", "water", "car", "truck", "person", "stop_sign"},
    "debris_field": {"debris slab", "debris wall", "debris rubble", "car", "truck", "person", "stop_sign"},
    "wildfire_perimeter": {"fire", "canopy", "grass", "car", "truck", "person", "stop_sign"},
}


def made(kind: str, seed: int = 1, **options: object) -> World:
    generated = kinds.kind(kind).generate(seed, options)
    return World(generated.description, Path(), generated.terrain)


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_makes_one_world_and_another_another(kind: str, tmp_path: Path) -> None:
    one, again, other = made(kind), made(kind), made(kind, 2)
    assert one.description == again.description and one.description != other.description
    heights = [world.ground(33.0, 71.0) for world in (one, again, other)]
    assert heights[0] == heights[1] != heights[2]
    kept = worlds.keep(one, tmp_path)
    assert load(kept) == one.description, "a run's folder keeps it"
    assert worlds.kept(str(kept)).ground(33.0, 71.0) == pytest.approx(heights[0], abs=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_everything_in_it_has_a_label_and_is_seen(kind: str) -> None:
    scene = MeshScene(made(kind), Path())
    assert LABELS[kind] <= set(scene.labels)
    corners = np.array(scene.world.description.area_m)
    n, e = corners.mean(axis=0)
    looking_down = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    place = np.array((n, e, -scene.world.terrain.height_m(n, e) - 100.0))
    view = scene.renderer(640, 480, 320.0).look(place, looking_down, 20.0)
    seen = {scene.labels[number] for number in np.unique(view.objects)}
    few = {"stop_sign", "person", "car", "truck"}
    assert LABELS[kind] - few <= seen and seen & few
    assert view.picture.std() > 15.0


@pytest.mark.parametrize("size_m", [100, 140, 200, 400])
def test_a_town_of_any_size_is_built_and_houses_keep_off_each_other(size_m: float) -> None:
    described = made("urban_flood", size_m=size_m, cars=0).description
    houses = [(one.north_m, one.east_m, one.box.size_m) for one in described.solids if one.name.startswith("house")
              and one.box is not None]  # fmt: skip
    assert len(houses) > 10
    for index, (n, e, size) in enumerate(houses):
        for other_n, other_e, other in houses[:index]:
            assert abs(n - other_n) > 0.49 * (size[0] + other[0]) or abs(e - other_e) > 0.49 * (size[1] + other[1])


@pytest.mark.parametrize("kind", KINDS)
def test_options_count_and_wrong_ones_are_named(kind: str) -> None:
    none, many = made(kind, persons=0), made(kind, persons=9)
    persons = [[thing for thing in world.description.things if thing.label == "person"] for world in (none, many)]
    assert [len(each) for each in persons] == [0, 9]
    with pytest.raises(WorldError, match=f"world {kind}: size_m: 5; must be a number from"):
        made(kind, size_m=5)
    with pytest.raises(WorldError, match=f"world {kind} has no option 'siz'; it knows size_m"):
        made(kind, siz=5)
    with pytest.raises(WorldError, match=r"persons: 1\.5; must be a whole number"):
        made(kind, persons=1.5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [8, 23, 24])
def test_nothing_stands_where_vehicles_start(kind: str, seed: int) -> None:
    """Trees hung over some starts, cars stood on others."""
    world = made(kind, seed, size_m=100)
    pads = [place for name, place in world.description.places.items() if name.startswith("home")]
    assert len(pads) == 4
    above = np.array([(pad.north_m, pad.east_m, -world.ground(pad.north_m, pad.east_m) - 40.0) for pad in pads])
    for aside in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)):
        down = world.raycast(above + aside, np.tile((0.0, 0.0, 1.0), (4, 1)), 0.0, 60.0)
        assert down.range_m == pytest.approx(40.0, abs=0.5), down.name


def test_no_house_stood_in_another() -> None:
    floors = [np.mean(land.polygon_m, axis=0) for land in made("debris_field").description.ground.land
              if land.use == "concrete"]  # fmt: skip
    apart = [math.dist(a, b) for k, a in enumerate(floors) for b in floors[:k]]
    assert len(floors) == 7 and min(apart) > 16.4  # two diagonals of 6.5 by 5 m


def test_floods_stand_in_the_low_streets_and_persons_keep_their_heads_above_water() -> None:
    world = made("urban_flood", seed=3)
    (flood,) = world.description.water
    size = world.description.area_m[2][0]
    assert world.ground(8.0, size - 8.0) < flood.level_m < world.ground(size - 8.0, 8.0)
    for thing in world.description.things:
        if thing.label == "person":
            head = world.ground(thing.north_m, thing.east_m) + thing.above_ground_m + thing.height_m
            assert head > flood.level_m + 0.4


def test_persons_on_roofs_stand_there_for_physics_too() -> None:
    world = made("urban_flood")
    high = [thing for thing in world.description.things if thing.label == "person" and thing.above_ground_m > 5.0]
    assert high
    for thing in high:
        above = np.array([(thing.north_m, thing.east_m, -60.0)])
        hits = world.raycast(above, np.array([(0.0, 0.0, 1.0)]), 0.0, 100.0)
        top = world.ground(thing.north_m, thing.east_m) + thing.above_ground_m + thing.height_m
        assert hits.name == [thing.name] and 60.0 - float(hits.range_m[0]) == pytest.approx(top, abs=0.01)


def test_a_preview_is_pictures_a_map_and_the_truth(tmp_path: Path) -> None:
    said: list[str] = []
    preview.preview("debris_field", 1, {"rubble": 20, "ruins": 1}, tmp_path / "seen", 0.0, said.append)
    pictures = {path.name for path in (tmp_path / "seen").glob("*.png")}
    assert pictures == {
        "nadir_05m.png", "nadir_15m.png", "nadir_30m.png", "nadir_60m.png", "oblique.png", "street.png", "map.png"
    }  # fmt: skip
    assert {"truth.json", "world.yaml", "terrain.npy"} <= {path.name for path in (tmp_path / "seen").iterdir()}
    assert len(said) == 1
    with pytest.raises(worlds.WorldError, match="there is no world 'moon'"):
        preview.preview("moon", 1, {}, tmp_path / "moon", 0.0, said.append)


def test_things_of_ones_own_stand_in_a_generated_world() -> None:
    mine = [{"label": "stop_sign", "north_m": 30, "east_m": 40, "radius_m": 0.3, "height_m": 2.3, "name": "mine"}]
    world = worlds.build("debris_field", 1, {"rubble": 5, "ruins": 1, "persons": 0, "things": mine})
    own = worlds.build("debris_field", 1, {"rubble": 5, "ruins": 1, "persons": 0})
    assert world.description.things[:-1] == own.description.things
    assert world.description.things[-1].name == "mine" and world.description.solids == own.description.solids
    with pytest.raises(worlds.WorldError, match=r"world flat: things\[0\]: the field 'radius_m' is missing"):
        worlds.build("flat", 1, {"things": [{"label": "car", "north_m": 1, "east_m": 2}]})
    with pytest.raises(worlds.WorldError, match="world flat: things = 5 must be a list"):
        worlds.build("flat", 1, {"things": 5})
    assert worlds.build("corn_field", 1, {"things": mine}).description.things[-1].name == "mine"
