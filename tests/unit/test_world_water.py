"""Water and foliage: what rays and range finders meet of them, and what becomes of vehicles that come down in water."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.simulator_api import DistanceSensor
from sitl_emu.world import foliage, marching, polygons, rays
from sitl_emu.world.camera import Pose
from sitl_emu.world.contacts import Impact, told
from sitl_emu.world.description import Cover, read
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.lens import Mount
from sitl_emu.world.ranging import Noise, Scan, ScanningLidar
from sitl_emu.world.rays import GROUND
from sitl_emu.world.sensors.lidar import Lidar
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.terrain import HeightMap
from sitl_emu.world.world import World

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
LEVEL_M = 1.0
LAKE = {
    "name": "lake", "polygon_m": [[-50, -50], [50, -50], [50, 50], [-50, 50]],
    "level_m": LEVEL_M, "current_east_m_s": 0.8,
}  # fmt: skip
WOOD = {
    "name": "wood", "kind": "canopy", "polygon_m": [[0, 0], [40, 0], [40, 40], [0, 40]],
    "height_m": 9.0, "base_m": 3.0, "density": 0.7,
}  # fmt: skip
DOWN = np.array([(0.0, 0.0, 1.0)])


def shore() -> HeightMap:
    """It rises to the north, half a metre on ten, and is dry from 20 m north on."""
    return HeightMap(np.repeat(0.05 * np.arange(-60.0, 61.0, 1.0)[:, None], 121, axis=1), -60.0, -60.0, 1.0)


def world_of(terrain: HeightMap | None = None, **parts: object) -> World:
    return World(read({"name": "x", **parts}, "x"), Path(), terrain)


def below(world: World, north_m: float, east_m: float, from_m: float = 30.0) -> tuple[str, float]:
    hits = world.raycast(np.array([(north_m, east_m, -from_m)]), DOWN, 0.0, 100.0)
    return hits.name[0], round(from_m - float(hits.range_m[0]), 3)


def range_finder(world: World) -> Lidar:
    """The iris's kind, without noise."""
    data = vehicles.load("m600").sensors.lidar
    assert data is not None
    return Lidar(dataclasses.replace(data, noise_m=0.0), world.terrain, 1, "x", world.solids, world.areas)


def measured_m(shot: DistanceSensor) -> float:
    return shot.current_distance / 100.0


# --- rays ----------------------------------------------------------------------------------------------------------


def test_water_lies_where_the_ground_is_below_its_level() -> None:
    world = world_of(shore(), water=[LAKE])
    assert below(world, 0.0, 0.0) == ("lake", LEVEL_M) and below(world, 19.9, 0.0) == ("lake", LEVEL_M)
    assert below(world, 20.1, 0.0) == (GROUND, 1.005) and below(world, -55.0, 0.0) == (GROUND, -2.75)
    assert world.areas is not None
    assert world.areas.water_at(0.0, 0.0, -0.5) is not None and world.areas.water_at(0.0, 0.0, -1.5) is None


def test_solids_that_stand_in_water_are_met_above_it() -> None:
    pier = {"name": "pier", "north_m": 0, "east_m": 0, "box": {"size_m": [2, 2, 3]}}
    stone = {"name": "stone", "north_m": 5, "east_m": 0, "box": {"size_m": [1, 1, 0.3]}}
    world = world_of(water=[LAKE], solids=[pier, stone])
    assert below(world, 0.0, 0.0) == ("pier", 3.0) and below(world, 5.0, 0.0) == ("lake", LEVEL_M)


def leafy(north: np.ndarray, east: np.ndarray, density: float) -> np.ndarray:
    """Whether the cells at these places have leaves, as `marching.leaves` has it, with integers of 32 bits."""
    row = np.floor(north / foliage.CELL_M).astype(np.int64).astype(np.uint32)
    column = np.floor(east / foliage.CELL_M).astype(np.int64).astype(np.uint32)
    mixed = (row * np.uint32(0x9E3779B1)) ^ (column * np.uint32(0x85EBCA77))
    mixed = (mixed ^ (mixed >> np.uint32(15))) * np.uint32(0x2C1B3C6D)
    mixed = (mixed ^ (mixed >> np.uint32(12))) * np.uint32(0x297A2D39)
    mixed ^= mixed >> np.uint32(15)
    return np.asarray(mixed < density * 2.0**32)


def leaves_at(cover: Cover, terrain: HeightMap, points: np.ndarray) -> np.ndarray:
    """Whether there are leaves at points (n, 3)."""
    north, east = points[:, 0], points[:, 1]
    up = -points[:, 2] - terrain.heights_m(north, east)
    there = (up >= cover.base_m) & (up <= cover.height_m)
    return np.asarray(there & leafy(north, east, cover.density) & polygons.inside(cover.polygon_m, north, east))


def test_as_many_cells_have_leaves_as_the_density_says() -> None:
    places = np.random.default_rng(1).uniform(-500.0, 500.0, (2, 40_000))
    for density in (0.0, 0.3, 0.9, 1.0):
        assert leafy(places[0], places[1], density).mean() == pytest.approx(density, abs=0.01)


def test_a_ray_from_above_meets_leaves_or_goes_through_a_gap() -> None:
    world = world_of(cover=[WOOD])
    middle = [below(world, north, east) for north in np.arange(1.25, 39.0, 1.0) for east in np.arange(1.25, 39.0, 1.0)]
    assert set(middle) == {("wood", 9.0), (GROUND, 0.0)}
    assert middle.count(("wood", 9.0)) / len(middle) == pytest.approx(0.7, abs=0.05)
    assert below(world, 41.0, 5.0) == (GROUND, 0.0)


def test_under_the_crowns_one_looks_through() -> None:
    world = world_of(cover=[WOOD])
    level = np.array([(0.0, 1.0, 0.0)])
    through = world.raycast(np.array([(20.0, -10.0, -2.0)]), level, 0.0, 200.0)
    against = world.raycast(np.array([(20.0, -10.0, -6.0)]), level, 0.0, 200.0)
    assert through.name == [""] and against.name == ["wood"]
    assert 10.0 <= against.range_m[0] < 20.0


@settings(max_examples=60, deadline=None)
@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 1.0))
def test_where_a_ray_meets_foliage_there_are_leaves_and_none_before(
    north_m: float, east_m: float, n: float, e: float, d: float
) -> None:
    cover = Cover("wood", "canopy", ((0.0, 0.0), (40.0, 0.0), (40.0, 40.0)), 9.0, 3.0, 0.7)
    direction = np.array([(n, e, d)]) / math.hypot(n, e, d)
    origin = np.array([(north_m, east_m, -20.0)])
    reach = np.array([300.0])
    box = foliage.box_of(cover, shore())
    (met,) = foliage.meet(cover, box, shore(), origin, direction, reach)
    place, course = (tuple(one[0].tolist()) for one in (origin, direction))
    assert foliage.may_meet(box, place, course, 300.0) or met == math.inf

    def leaves(at: np.ndarray) -> np.ndarray:
        return leaves_at(cover, shore(), origin + at[:, None] * direction)

    if math.isfinite(met):
        assert leaves(np.array([met]))[0]
    a_step = np.arange(0.0, foliage.STEP_M, 0.01)
    for at in np.arange(0.0, min(met - 2 * foliage.STEP_M, 60.0), 0.37):
        assert not leaves(at + a_step).all(), "only what is thinner than a step is passed by"


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_many_rays_come_to_the_same_bits_as_each_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = world_of(shore(), cover=[WOOD], water=[LAKE])
    origins, directions = (
        rng.uniform((-70, -70, -20), (70, 70, 0), (2 * marching.MANY, 3)),
        rng.normal(size=(2 * marching.MANY, 3)),
    )
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    together = world.raycast(origins, directions, 0.0, 90.0)
    alone = [world.raycast(origins[k : k + 1], directions[k : k + 1], 0.0, 90.0) for k in range(len(origins))]
    assert together.range_m.tolist() == [float(each.range_m[0]) for each in alone]
    assert together.name == [each.name[0] for each in alone]


@settings(max_examples=100, deadline=None)
@given(st.floats(-70.0, 70.0), st.floats(-70.0, 70.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.3, 1.0))
def test_a_ray_meets_the_ground_where_it_first_is_below_it(
    north_m: float, east_m: float, n: float, e: float, d: float
) -> None:
    length = math.hypot(n, e, d)
    if length < 1e-3:
        return
    terrain, reach_m = shore(), 80.0
    origin, direction = np.array([(north_m, east_m, -5.0)]), np.array([(n, e, d)]) / length
    (met,) = rays.meet_terrain(terrain, origin, direction, reach_m)
    at = np.arange(0.0, min(met, reach_m) - 1e-6, reach_m / rays.MARCH_STEPS)
    places = origin + at[:, None] * direction
    is_below = -places[:, 2] < terrain.heights_m(places[:, 0], places[:, 1])
    assert not is_below[1:].any(), "where it starts does not count"
    if math.isfinite(met):
        ((north, east, down),) = origin + met * direction
        assert abs(-down - terrain.height_m(north, east)) < 1e-3


# --- a laser range finder ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("tilt_deg", "heard"), [(0.0, True), (14.0, True), (16.0, False), (30.0, False)])
def test_water_mirrors_a_slanted_laser_away(tilt_deg: float, heard: bool) -> None:
    shot = range_finder(world_of(water=[LAKE])).read(0, 0.0, 0.0, -8.0, quaternion(math.radians(tilt_deg), 0.0, 0.0))
    if heard:
        assert measured_m(shot) == pytest.approx(7.0 / math.cos(math.radians(tilt_deg)), abs=0.006)
    else:
        assert shot.current_distance == shot.max_distance + 1, "nothing in range, and never what lies on its bottom"


def test_a_laser_measures_crowns_and_through_gaps_the_ground() -> None:
    lidar = range_finder(world_of(cover=[WOOD]))
    level = (1.0, 0.0, 0.0, 0.0)
    found = {measured_m(lidar.read(0, 20.25, each, -11.5, level)) for each in range(1, 39)}
    assert found == {2.5, 11.5}
    assert measured_m(lidar.read(0, 20.0, 20.0, -2.5, level)) == 2.5, "below the crowns"


def test_a_scan_over_water_hears_it_below_alone() -> None:
    world = world_of(water=[LAKE])
    scan = Scan(columns=36, rows=45, lowest_deg=-88.0, highest_deg=0.0, nearest_m=0.5, farthest_m=100.0)
    lidar = ScanningLidar(world, scan, Mount(0.0, 0.0, 0.0, 0.0), Noise(0.0, 1, "x"))
    points = lidar.measure(Pose(0.0, 0.0, -11.0, (1.0, 0.0, 0.0, 0.0)), 0)
    over_lake = points[np.hypot(points[:, 0], points[:, 1]) < 40.0]
    assert len(over_lake) == 36 * 7, "the rows of 74 degrees and more below the level"
    assert np.allclose(over_lake[:, 2], 10.0, atol=1e-3) and np.hypot(*over_lake[:, :2].T).max() < 3.0


# --- vehicles ------------------------------------------------------------------------------------------------------


def over(world: World, model: str = "iris", up_m: float = 0.0) -> tuple[VehicleSimulator, Simulation]:
    """A vehicle above the origin's ground."""
    simulator = VehicleSimulator(vehicles.load(model), HOME, 1, world.terrain, name=model, areas=world.areas)
    simulator.dynamics.shift(0.0, 0.0, -up_m)
    return simulator, Simulation([simulator], world.solids, world.areas)


def ticked(simulation: Simulation, ticks: int) -> list[Impact]:
    met = list[Impact]()
    for _ in range(ticks):
        simulation.tick([None])
        met += simulation.impacts()
    return met


def test_who_comes_down_in_water_is_wrecked_sinks_and_drifts() -> None:
    world = world_of(FlatGround(-6.0), water=[LAKE | {"level_m": -4.0}])  # type: ignore[arg-type]
    iris, simulation = over(world, up_m=3.0)
    met = ticked(simulation, 500)
    assert [(impact.other, impact.crash, impact.in_water) for impact in met] == [("lake", True, True)]
    assert told(met[0], ["iris"]).startswith("iris came down in water (lake) at 4.")
    assert iris.dynamics.wrecked and iris.dynamics.vd_m_s == pytest.approx(0.52, abs=0.05)
    assert iris.dynamics.ve_m_s == pytest.approx(0.8, abs=0.1), "with the current"
    assert ticked(simulation, 1000) == []
    assert iris.dynamics.down_m == pytest.approx(6.0, abs=0.3), "it lies on the bottom"


def test_a_puddle_is_no_water_to_sink_in() -> None:
    gear_m = vehicles.load("iris").gear
    assert gear_m is not None
    world = world_of(water=[LAKE | {"level_m": 0.5 * gear_m.height_m}])
    simulator, simulation = over(world)
    assert ticked(simulation, 250) == [] and not simulator.dynamics.wrecked


def test_a_rover_in_deep_water_drives_no_more() -> None:
    world = world_of(shore(), water=[LAKE])
    rover, simulation = over(world, "rover")
    assert [impact.did for impact in ticked(simulation, 1)] == ["came down in water (lake)"] and rover.dynamics.wrecked


def test_a_shore_is_drawn_where_the_ground_rises_out_of_the_water() -> None:
    (area,) = world_of(shore(), water=[LAKE]).truth(0.0)["areas"]
    assert max(north for north, _ in area["outline_m"]) == pytest.approx(20.0, abs=0.5)
    assert min(north for north, _ in area["outline_m"]) == pytest.approx(-50.0, abs=0.5)
    assert world_of(water=[LAKE | {"level_m": -1.0}]).truth(0.0).get("areas") is None, "it lies under the ground"


def test_two_ponds_and_an_island_in_one() -> None:
    side = np.hypot(*np.mgrid[-30:31, -30:31]) / 10.0
    ground_m = np.where(side < 0.5, 1.0, -1.0) + np.where(np.mgrid[-30:31, -30:31][0] > 20, 2.0, 0.0)
    ground_m[-5:] = -1.0
    world = world_of(HeightMap(ground_m, -30.0, -30.0, 1.0), water=[LAKE | {"level_m": 0.0}])
    big, small = sorted(world.truth(0.0)["areas"], key=lambda area: area["outline_m"][0][0])[:2]
    ((island,), ()) = big["islands_m"], small["islands_m"]
    assert np.hypot(*np.array(island).T) == pytest.approx(4.5, abs=1.2)
    assert {big["name"], small["name"]} == {"lake"}


def test_the_truth_names_water_fires_and_plants() -> None:
    fire = {"name": "blaze", "polygon_m": [[0, 0], [4, 0], [4, 4], [0, 4]], "spread_m_s": 0.5, "burns_s": 9}
    world = world_of(water=[LAKE], fires=[fire], cover=[WOOD | {"label": "beech"}], wind={"north_m_s": 2.0})
    water, burning, wood = world.truth(10.0)["areas"]
    assert (water["kind"], water["name"], water["label"]) == ("water", "lake", "water")
    assert water["level_m"] == LAKE["level_m"]
    assert (burning["kind"], burning["front_m_s"], burning["burns_s"]) == ("fire", [0.5, 0.0], 9.0)
    assert max(north for north, _ in burning["outline_m"]) == 9.0
    assert (wood["kind"], wood["label"]) == ("canopy", "beech")
    assert "areas" not in world_of().truth(0.0)
