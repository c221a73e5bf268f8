"""Loose bodies: they fall as they should, never gain energy, come to rest, float, and are met, seen and pushed."""

import builtins
import gc
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.run.messages import LooseAt
from sitl_emu.world import bullet as bullet_of_ours
from sitl_emu.world.atmosphere import density_kg_m3, gravity_m_s2
from sitl_emu.world.description import Box, Cylinder, Hull, Loose, WorldError, loose_of, plain, read
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.loose import LooseBody
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.terrain import HeightMap
from sitl_emu.world.world import World
from tests.typed import present

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
GRAVITY = gravity_m_s2(HOME.lat_deg)
PARCEL = Loose("parcel", 0.0, 0.0, mass_kg=2.0, box=Box((0.4, 0.3, 0.2)))
DOWN = np.array([(0.0, 0.0, 1.0)])
SPUN = (3.0, -2.0, 1.0)


def world_of(terrain: HeightMap | None = None, **parts: object) -> World:
    world = World(read({"name": "x", **parts}, "x"), Path(), terrain)
    world.expect_releases()
    return world


def simulated(world: World, *simulators: VehicleSimulator) -> Simulation:
    return Simulation(simulators, world.solids, world.areas)


def run(simulation: Simulation, seconds: float) -> None:
    for _ in range(round(seconds / 0.004)):
        simulation.tick([None] * len(simulation.simulators))


def body_of(world: World, name: str = "parcel") -> LooseBody:
    assert world.solids is not None
    body = world.solids.loose_body(name)
    assert body is not None
    return body


def energy_j(body: LooseBody) -> float:
    """Of falling, moving and turning."""
    x, y, z = (sum(w * axis for w, axis in zip(body.spin, column, strict=True)) for column in _axes(body))
    ix, iy, iz = body.inertia
    moving = body.described.mass_kg * (0.5 * body.speed_m_s**2 - GRAVITY * body.down_m)
    return float(moving + 0.5 * (ix * x * x + iy * y * y + iz * z * z))


def _axes(body: LooseBody) -> list[tuple[float, float, float]]:
    w, x, y, z = body.q
    return [
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    ]


def test_a_fall_takes_the_time_it_must() -> None:
    world = world_of()
    simulation = simulated(world)
    simulation.release(PARCEL, (0.0, 0.0, -10.1), velocity=(1.5, 0.0, 0.0))
    body, time_s = body_of(world), 0.0
    while body.velocity[2] >= 0.0 and body.down_m < -0.11:
        simulation.tick([])
        time_s += 0.004
    assert time_s == pytest.approx(math.sqrt(2.0 * 10.0 / GRAVITY), abs=0.008), "two ticks"
    assert body.north_m == pytest.approx(1.5 * time_s, abs=0.01)


def test_it_tumbles_never_gains_energy_and_comes_to_rest() -> None:
    world = world_of()
    simulation = simulated(world)
    simulation.release(PARCEL, (0.0, 0.0, -10.0), velocity=(2.0, 0.0, 0.0), spin=SPUN)
    body = body_of(world)
    least, turned = energy_j(body), 0.0
    for _ in range(2500):
        simulation.tick([])
        now = energy_j(body)
        assert now <= least + 0.05, "but for what pushes it out of the ground by 2 mm, of 200 J"
        least, turned = min(least, now), turned + 0.004 * body.spin_rad_s
        if not world.solids or not world.solids.awake:
            break
    assert turned > 2.0 * math.pi and world.solids is not None and not world.solids.awake
    assert min(abs(-body.down_m - half) for half in (0.1, 0.15, 0.2)) < 0.005, "it lies on one of its sides"
    before = (body.north_m, body.east_m, body.down_m, body.q)
    run(simulation, 2.0)
    body.read()
    assert (body.north_m, body.east_m, body.down_m, body.q) == before, "at rest it is not stepped"


def test_the_same_fall_is_the_same_to_the_last_bit() -> None:
    ends = []
    for _ in range(2):
        world = world_of(
            solids=[{"name": "a", "north_m": 1, "east_m": 0, "roll_deg": 20, "box": {"size_m": [2, 2, 1]}}]
        )
        simulation = simulated(world)
        for number in range(3):
            one = Loose(f"p{number}", 0.0, 0.0, mass_kg=1.0, box=Box((0.3, 0.3, 0.3)))
            simulation.release(one, (1.0, 0.1 * number, -4.0 - number), spin=SPUN)
        run(simulation, 3.0)
        ends.append([(pose.place, pose.q) for pose in simulation.loose_poses()])
    assert ends[0] == ends[1]


def test_the_air_brakes_it_and_takes_it_along() -> None:
    world = world_of(wind={"north_m_s": 6.0})
    simulation = simulated(world)
    sail = Loose("parcel", 0.0, 0.0, mass_kg=1.0, drag_m2=1.0, box=Box((0.3, 0.3, 0.3)))
    simulation.release(sail, (0.0, 0.0, -100.0))
    run(simulation, 8.0)
    falls = math.sqrt(2.0 * GRAVITY / density_kg_m3(HOME.alt_amsl_m))
    assert body_of(world).velocity == pytest.approx((6.0, 0.0, falls), abs=0.02)


def slope() -> HeightMap:
    """One metre on five, up to the north."""
    return HeightMap(np.repeat(0.2 * np.arange(-60.0, 61.0)[:, None], 121, axis=1), -60.0, -60.0, 1.0)


@pytest.mark.parametrize(("friction", "slides"), [(0.6, False), (0.05, True)])
def test_on_a_slope_friction_decides(friction: float, slides: bool) -> None:
    crate = {"name": "crate", "north_m": 0, "east_m": 0, "mass_kg": 10, "friction": friction, "pitch_deg": 11.31}
    world = world_of(slope(), loose=[crate | {"box": {"size_m": [1, 1, 0.4]}}])
    simulation = simulated(world)
    run(simulation, 3.0)
    body = body_of(world, "crate")
    assert (body.north_m < -1.0) is slides and abs(body.east_m) < 0.05
    if not slides:
        assert abs(body.north_m) < 0.15
    assert -body.down_m - world.ground(body.north_m, body.east_m) == pytest.approx(0.2 * math.sqrt(1.04), abs=0.03)


def test_it_lands_on_roofs_and_on_others() -> None:
    house = {"name": "house", "north_m": 0, "east_m": 0, "box": {"size_m": [8, 8, 5]}}
    world = world_of(solids=[house])
    simulation = simulated(world)
    flat = Loose("flat", 0.0, 0.0, mass_kg=5.0, box=Box((1.0, 1.0, 0.2)))
    simulation.release(flat, (0.0, 0.0, -6.0))
    run(simulation, 2.0)
    simulation.release(PARCEL, (0.0, 0.0, -6.0))
    run(simulation, 2.0)
    assert -body_of(world, "flat").down_m == pytest.approx(5.1, abs=0.01)
    assert -body_of(world).down_m == pytest.approx(5.3, abs=0.01)


def test_a_hull_falls_about_its_middle() -> None:
    corners = tuple((n, e, u) for n in (1.0, 1.6) for e in (-0.3, 0.3) for u in (0.0, 0.4))
    world = world_of()
    simulation = simulated(world)
    simulation.release(Loose("parcel", 0.0, 0.0, mass_kg=3.0, hull=Hull(corners)), (0.0, 0.0, -1.0))
    run(simulation, 1.5)
    body = body_of(world)
    assert body.shape.volume_m3 == pytest.approx(0.6 * 0.6 * 0.4, rel=0.05)
    assert (body.north_m, body.east_m, body.down_m) == pytest.approx((0.0, 0.0, -0.2), abs=0.01)
    with pytest.raises(WorldError, match="loose 'flat': its hull has no volume"):
        simulation.release(Loose("flat", 0.0, 0.0, mass_kg=3.0, hull=Hull(corners[:3])), (0.0, 0.0, -1.0))


def test_a_barrel_floats_with_the_current_and_a_stone_sinks() -> None:
    pond = {
        "name": "pond", "polygon_m": [[-90, -90], [90, -90], [90, 90], [-90, 90]],
        "level_m": 3.0, "current_east_m_s": 0.7,
    }  # fmt: skip
    world = world_of(water=[pond])
    simulation = simulated(world)
    barrel = Loose("barrel", 0.0, 0.0, mass_kg=60.0, cylinder=Cylinder(0.3, 0.9))
    stone = Loose("stone", 0.0, 0.0, mass_kg=60.0, box=Box((0.3, 0.3, 0.3)))
    simulation.release(barrel, (0.0, 0.0, -4.0))
    simulation.release(stone, (5.0, 0.0, -4.0))
    run(simulation, 8.0)
    draught = 60.0 / 1000.0 / (math.pi * 0.09)
    assert -body_of(world, "barrel").down_m == pytest.approx(3.0 + 0.45 - draught, abs=0.02)
    assert body_of(world, "barrel").velocity == pytest.approx((0.0, 0.7, 0.0), abs=0.02)
    assert -body_of(world, "stone").down_m == pytest.approx(0.15, abs=0.02)


def test_rays_truth_and_contacts_know_where_it_is() -> None:
    world = world_of(loose=[{"name": "box", "north_m": 0, "east_m": 0, "above_ground_m": 8, "mass_kg": 4,
                             "label": "crate", "box": {"size_m": [1, 1, 1]}}])  # fmt: skip
    simulation, down = simulated(world), np.array([(0.0, 0.0, 1.0)])

    def top_m() -> float:
        hits = world.raycast(np.array([(0.0, 0.0, -20.0)]), down, 0.0, 50.0)
        assert hits.name == ["box"]
        return 20.0 - float(hits.range_m[0])

    assert top_m() == pytest.approx(9.0)
    run(simulation, 3.0)
    assert top_m() == pytest.approx(1.0, abs=0.01)
    (crate,) = world.truth(0.0)["loose"]
    assert (crate["name"], crate["label"]) == ("box", "crate") and crate["place_m"][2] == pytest.approx(0.5, abs=0.01)
    assert world.solids is not None
    sphere = world.solids.add_body(vehicles.load("iris").body or pytest.fail("the iris has a body"))
    assert {each.other for each in world.contacts(sphere, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0, 0.0), 0.0)} == {"box"}


def test_a_vehicle_and_a_barrel_share_their_momentum() -> None:
    world = world_of()
    iris = VehicleSimulator(vehicles.load("iris"), HOME, 1, FlatGround(), name="iris", obstacles=world.solids)
    iris.dynamics.shift(0.0, 0.0, -50.0)
    iris.dynamics.push((0.0, 0.0, 0.0), (4.0 * iris.vehicle.mass_kg, 0.0, 0.0))
    simulation = simulated(world, iris)
    ball = Loose("parcel", 0.0, 0.0, mass_kg=3.0, box=Box((0.4, 0.4, 0.4)))
    simulation.release(ball, (1.0, 0.0, iris.dynamics.down_m))
    before = 4.0 * iris.vehicle.mass_kg
    for _ in range(250):
        simulation.tick([None])
        if met := simulation.impacts():
            break
    assert [(impact.vehicle, impact.other, impact.crash) for impact in met] == [("iris", "parcel", True)]
    assert body_of(world).velocity[0] > 0.5
    after = iris.vehicle.mass_kg * iris.dynamics.vn_m_s + 3.0 * body_of(world).velocity[0]
    assert after == pytest.approx(before, rel=0.05), "drag takes a little on the way"


def test_who_walks_pushes_what_lies_in_the_way() -> None:
    walker = {
        "label": "person", "north_m": 0, "east_m": 4, "radius_m": 0.3, "height_m": 1.8,
        "path": [{"at_s": 3, "north_m": 0, "east_m": 4}, {"at_s": 9, "north_m": 0, "east_m": -2}],
    }  # fmt: skip
    light = {"name": "parcel", "north_m": 0, "east_m": 0, "mass_kg": 1, "box": {"size_m": [0.4, 0.4, 0.4]}}
    world = world_of(things=[walker], loose=[light])
    simulation = simulated(world)
    run(simulation, 2.5)
    assert world.solids is not None and not world.solids.awake
    run(simulation, 6.5)
    assert body_of(world).east_m < -1.5


# --- what is told --------------------------------------------------------------------------------------------------


def test_a_wrong_release_is_told() -> None:
    simulation = simulated(world_of())
    simulation.release(PARCEL, (0.0, 0.0, -1.0))
    with pytest.raises(WorldError, match="release: name = 'parcel': another has this name"):
        simulation.release(PARCEL, (0.0, 0.0, -1.0))
    with pytest.raises(WorldError, match="'x': give one of box, cylinder, hull, mesh"):
        simulation.release(Loose("x", 0.0, 0.0, mass_kg=1.0), (0.0, 0.0, -1.0))
    with pytest.raises(WorldError, match="not made ready"):
        Simulation([]).release(PARCEL, (0.0, 0.0, -1.0))


@pytest.mark.parametrize(
    "part",
    [
        {"solids": [{"name": "a", "north_m": 0, "east_m": 0, "box": {"size_m": [1, 1, 1]}}]},
        {"things": [{"label": "person", "north_m": 0, "east_m": 0, "radius_m": 0.3, "height_m": 1.8}]},
        {"loose": [{"name": "a", "north_m": 0, "east_m": 0, "mass_kg": 1, "box": {"size_m": [1, 1, 1]}}]},
    ],
)
def test_without_pybullet_one_line_says_what_to_do(monkeypatch: pytest.MonkeyPatch, part: dict[str, Any]) -> None:
    imported = builtins.__import__

    def absent(name: str, *rest: Any) -> Any:
        if name == "pybullet":
            raise ImportError
        return imported(name, *rest)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(WorldError) as told:
        World(read({"name": "x", **part}, "x"), Path())
    assert "pip install pybullet" in str(told.value) and "python3.11" in str(told.value)
    assert "\n" not in str(told.value)


def test_pybullet_is_loaded_without_a_word() -> None:
    script = "from sitl_emu.world import bullet; bullet.load('solids'); print('after')"
    told = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, check=True)
    assert (told.stdout, told.stderr) == ("after\n", "")


def test_a_pose_is_kept_as_it_was_given() -> None:
    world = world_of()
    q = quaternion(0.3, -0.2, 1.0)
    simulated(world).release(PARCEL, (1.0, 2.0, -3.0), q)
    assert world.solids is not None
    (pose,) = world.solids.loose_poses()
    assert pose.place == pytest.approx((1.0, 2.0, -3.0)) and pose.q == pytest.approx(q)


def test_another_process_sees_what_was_released_here() -> None:
    """As a camera's does: it has the world file, and is told the poses."""
    walker = {
        "label": "person", "north_m": 0, "east_m": 4, "radius_m": 0.3, "height_m": 1.8,
        "path": [{"at_s": 0, "north_m": 0, "east_m": 4}, {"at_s": 9, "north_m": 0, "east_m": 13}],
    }  # fmt: skip
    here, there = world_of(), World(read({"name": "x", "things": [walker]}, "x"), Path())
    simulation, scene = simulated(here), there.scene()
    assert isinstance(scene, MeshScene)
    renderer, looking_down = scene.renderer(64, 64, 32.0), np.array(((0.0, -1, 0), (1, 0, 0), (0, 0, 1)))
    renderer.look(np.array((3.0, 2.0, -8.0)), looking_down, 0.0)
    corners = tuple((n, e, u) for n in (1.0, 1.6) for e in (-0.3, 0.3) for u in (0.0, 0.4))
    simulation.release(PARCEL, (3.0, 2.0, -5.0), spin=SPUN)
    simulation.release(Loose("lump", 0.0, 0.0, mass_kg=9.0, hull=Hull(corners)), (-5.0, 0.0, -2.0))
    for seconds in (0.2, 4.0):
        run(simulation, seconds)
        told = [LooseAt(plain(pose.described), pose.place, pose.q) for pose in simulation.loose_poses()]
        there.put_loose([LoosePose(loose_of(each.described), each.place, each.q) for each in told])
        for name in ("parcel", "lump"):
            body = body_of(here, name)
            seen = renderer.look(np.array((body.north_m, body.east_m, body.down_m - 2.0)), looking_down, seconds)
            assert scene.names[seen.objects[32, 32]] == name
            hit = there.raycast(np.array([(body.north_m, body.east_m, body.down_m - 2.0)]), DOWN, seconds, 9.0)
            assert hit.name == [name] and seen.depth_m[32, 32] == pytest.approx(hit.range_m[0], abs=0.03)
    walks = renderer.look(np.array((0.0, 8.0, -4.0)), looking_down, 4.0)
    assert scene.moves and scene.names[walks.objects[32, 32]] == "person", "whoever moves is where it was"


def test_a_world_that_is_dropped_gives_back_what_bullet_holds_for_it() -> None:
    """30 MB each, and Bullet has room for 1024 at a time."""
    bullet = bullet_of_ours.load("a test")
    solids = present(world_of().solids)
    client = solids._client
    assert bullet.isConnected(client)
    del solids
    gc.collect()
    assert not bullet.isConnected(client)
