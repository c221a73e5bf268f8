"""A parcel leaves its vehicle when an output says so, falls from where it hung, and is told of until it lies still."""

import math
from pathlib import Path
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion, rotated, rotation
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.description import WorldError, read
from sitl_emu.world.loose import LooseBody
from sitl_emu.world.parcels import AT_REST, IN_WATER, RELEASED, ParcelTold
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.world import World
from tests.typed import present

LADEN = vehicles.with_parcel(vehicles.load("responder"), {})
ROTORS = (0.45,) * 4
POND = {"name": "pond", "level_m": 1.0, "polygon_m": [[-50, -50], [-50, 50], [50, 50], [50, -50]]}


def flying(world: World, *fleet: Vehicle, up_m: float = 20.0) -> Simulation:
    """Vehicles beside one another in the air, at rest."""
    world.expect_releases()
    made = []
    for place, vehicle in enumerate(fleet):
        simulator = VehicleSimulator(
            vehicle, world.home, 1, world.terrain, world.wind, 0.0, 4.0 * place, "uas", world.solids, world.areas
        )
        simulator.dynamics.down_m = -up_m
        made.append(simulator)
    return Simulation(made, world.solids, world.areas)


def world_of(**parts: object) -> World:
    return World(read({"name": "x", **parts}, "x"), Path())


def outputs(*given: float, armed: int = 128) -> HilActuatorControls:
    return HilActuatorControls(0, 1, ROTORS + given + (0.0,) * (12 - len(given)), armed)


def run(simulation: Simulation, seconds: float, *given: float) -> list[ParcelTold]:
    for _ in range(round(seconds / 0.004)):
        simulation.tick([outputs(*given)] * len(simulation.simulators))
    return simulation.parcels_told()


@pytest.mark.parametrize(
    ("given", "opens"),
    [((1.0, 0.0), False), ((0.0, 0.0), False), ((1.0, 1.0), False), ((-1.0, 0.0), True), ((1.0, -1.0), True)],
)
def test_gripper_or_actuator_opens_it_and_nothing_else(given: tuple[float, float], opens: bool) -> None:
    simulation = flying(world_of(), LADEN)
    told = run(simulation, 0.1, *given)
    assert [each.what for each in told] == ([RELEASED] if opens else [])
    assert len(simulation.loose_poses()) == opens


def test_it_falls_from_where_it_hung_as_it_moved_and_turned_there() -> None:
    world = world_of()
    simulation = flying(world, LADEN)
    body: Any = simulation.simulators[0].dynamics
    body.q, body.vn_m_s, body.ve_m_s = quaternion(0.2, -0.3, 0.8), 5.0, -2.0
    body.p_rad_s, body.q_rad_s, body.r_rad_s = 1.0, -0.5, 0.3
    run(simulation, 0.004, 1.0)
    simulation.tick([outputs(-1.0)])
    hung = rotated(rotation(body.q), present(LADEN.parcel).centre_m)
    (pose,), velocity = simulation.loose_poses(), body.velocity_at(hung)
    for at, own, arm in zip(pose.place, (body.north_m, body.east_m, body.down_m), hung, strict=True):
        assert at == pytest.approx(own + arm)
    assert pose.q == pytest.approx(body.q)
    assert world.solids is not None and isinstance(falls := world.solids.loose_body("parcel of uas"), LooseBody)
    assert falls.velocity == pytest.approx(velocity)
    assert falls.spin == pytest.approx(rotated(rotation(body.q), (body.p_rad_s, body.q_rad_s, body.r_rad_s)))
    assert (pose.described.mass_kg, present(pose.described.box).size_m) == (2.0, (0.24, 0.16, 0.12))


def test_without_it_the_vehicle_accelerates_by_what_it_lost() -> None:
    simulation = flying(world_of(), LADEN)
    body = simulation.simulators[0].dynamics
    run(simulation, 0.3, 1.0)
    before = body.az_m_s2
    run(simulation, 0.008, -1.0)
    assert body.az_m_s2 / before == pytest.approx(6.3 / 4.3, rel=0.01)


def test_where_it_rests_is_told_once() -> None:
    simulation = flying(world_of(), LADEN)
    told = run(simulation, 0.1, 1.0) + run(simulation, 12.0, -1.0)
    assert [each.what for each in told] == [RELEASED, AT_REST]
    assert told[0].time_us == 104_000 and told[0].name == "parcel of uas"
    (pose,) = simulation.loose_poses()
    assert told[1][4:7] == pytest.approx(pose.place)
    assert 0.055 < -told[1].down_m < 0.125, "on the ground, on one of its sides"
    assert math.dist(told[1][4:6], told[0][4:6]) < 5.0


def test_what_falls_into_water_is_told() -> None:
    simulation = flying(world_of(water=[POND]), LADEN, up_m=10.0)
    told = run(simulation, 3.0, -1.0)
    assert [each.what for each in told][:2] == [RELEASED, IN_WATER]
    assert told[1].water == "pond" and told[1].text.endswith("(pond)")


def test_two_have_their_own_and_the_same_seed_gives_the_same_places() -> None:
    ends = []
    for _ in range(2):
        simulation = flying(world_of(wind={"north_m_s": 5.0, "gust_m_s": 1.5}), LADEN, LADEN)
        told = run(simulation, 10.0, -1.0)
        assert sorted(each.name for each in told if each.what == AT_REST) == ["parcel of uas", "parcel of uas 2"]
        ends.append(told)
    assert ends[0] == ends[1]


def test_a_vehicle_without_one_drops_nothing_and_an_unready_world_says_so() -> None:
    assert run(flying(world_of(), vehicles.load("responder")), 0.1, -1.0) == []
    world = world_of()
    simulator = VehicleSimulator(LADEN, world.home, 1, world.terrain)
    with pytest.raises(WorldError, match="this world was not made ready"):
        Simulation([simulator]).tick([outputs(-1.0)])
    assert math.isfinite(simulator.dynamics.down_m)
