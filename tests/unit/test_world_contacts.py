"""Bodies that meet: impulses, friction, crashes, and how seldom it is looked."""

import math
from pathlib import Path

import pytest

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.world.contacts import Impact
from sitl_emu.world.description import read
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.world import World

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
NOWHERE = (0.0, 0.0, 0.0)


def in_the_air(name: str, east_m: float, model: str = "iris", world: World | None = None) -> VehicleSimulator:
    obstacles = world.solids if world is not None else None
    made = VehicleSimulator(
        vehicles.load(model), HOME, 1, FlatGround(), start_east_m=east_m, name=name, obstacles=obstacles
    )
    made.dynamics.shift(0.0, 0.0, -100.0)
    return made


def push(simulator: VehicleSimulator, north_m_s: float = 0.0, east_m_s: float = 0.0, down_m_s: float = 0.0) -> None:
    mass = simulator.vehicle.mass_kg
    simulator.dynamics.push(NOWHERE, (mass * north_m_s, mass * east_m_s, mass * down_m_s))


def until_impact(simulation: Simulation, ticks: int = 2500) -> list[Impact]:
    for _ in range(ticks):
        simulation.tick([None] * len(simulation.simulators))
        if met := simulation.impacts():
            return met
    raise AssertionError("nothing met")


def energy(simulator: VehicleSimulator) -> float:
    """Of moving and turning, without falling."""
    body, (ix, iy, iz) = simulator.dynamics, simulator.vehicle.inertia_kg_m2
    moving = simulator.vehicle.mass_kg * (body.vn_m_s**2 + body.ve_m_s**2)
    return 0.5 * (moving + ix * body.p_rad_s**2 + iy * body.q_rad_s**2 + iz * body.r_rad_s**2)


@pytest.mark.parametrize(("closing_m_s", "crash"), [(0.8, False), (6.0, True)])
def test_two_that_meet_bounce_and_above_a_speed_both_are_wrecks(closing_m_s: float, crash: bool) -> None:
    one, other = in_the_air("one", 0.0, "m600"), in_the_air("other", 1.85, "m600")
    push(other, east_m_s=-closing_m_s)
    simulation = Simulation([one, other])
    before = energy(one) + energy(other)
    met = until_impact(simulation)
    assert [(impact.vehicle, impact.other, impact.crash) for impact in met] == [
        ("one", "other", crash),
        ("other", "one", crash),
    ]
    assert met[0].speed_m_s == pytest.approx(closing_m_s, rel=0.15), "drag takes a little on the way"
    assert one.dynamics.ve_m_s + other.dynamics.ve_m_s == pytest.approx(-met[0].speed_m_s, rel=0.05), "momentum stays"
    assert energy(one) + energy(other) < before
    for _ in range(50):
        simulation.tick([None, None])
    assert one.dynamics.ve_m_s < other.dynamics.ve_m_s, "they part"
    assert (one.dynamics.wrecked, other.dynamics.wrecked) == (crash, crash)


def test_an_accelerometer_feels_it() -> None:
    one, other = in_the_air("one", 0.0), in_the_air("other", 2.0)
    push(other, east_m_s=-4.0)
    simulation = Simulation([one, other])
    until_impact(simulation)
    simulation.tick([None, None])
    assert one.dynamics.ay_m_s2 < -100.0, "2.4 m/s within 4 ms"
    simulation.tick([None, None])
    assert abs(one.dynamics.ay_m_s2) < 5.0


def test_who_pass_each_other_do_not_meet() -> None:
    one, other = in_the_air("one", 0.0), in_the_air("other", 8.0)
    other.dynamics.shift(0.9, 0.0, 0.0)
    push(other, east_m_s=-10.0)
    simulation = Simulation([one, other])
    for _ in range(500):
        simulation.tick([None, None])
    assert other.dynamics.east_m < -5.0 and simulation.impacts() == []


@pytest.mark.parametrize("speed_m_s", [3.0, 12.0, 35.0])
def test_nobody_gets_through_a_wall(speed_m_s: float) -> None:
    """Whatever the speed: looked for in the direction of motion, and no step is longer than the wall is thick."""
    wall = {"name": "wall", "north_m": 25.5, "east_m": 0.0, "box": {"size_m": [1.0, 50.0, 400.0]}}
    world = World(read({"name": "x", "solids": [wall]}, "x"), Path())
    flying = in_the_air("iris", 0.0, world=world)
    flying.dynamics.shift(22.0, 0.0, 0.0)
    push(flying, north_m_s=speed_m_s)
    simulation = Simulation([flying], world.solids)
    met = until_impact(simulation)
    assert met[0].other == "wall" and met[0].crash
    assert flying.dynamics.north_m == pytest.approx(25.0 - 0.2795, abs=0.02 + 0.004 * speed_m_s)
    for _ in range(250):
        simulation.tick([None])
        assert flying.dynamics.north_m < 25.0


def test_a_rover_stops_at_a_wall_and_stays_on_its_wheels() -> None:
    wall = {"name": "wall", "north_m": 5.5, "east_m": 0.0, "heading_deg": 10.0, "box": {"size_m": [1.0, 20.0, 2.0]}}
    world = World(read({"name": "x", "solids": [wall]}, "x"), Path())
    for model in ("rover", "sihsim_rover_ackermann"):
        rover = VehicleSimulator(vehicles.load(model), HOME, 1, FlatGround(), name=model, obstacles=world.solids)
        push(rover, north_m_s=2.0)
        simulation = Simulation([rover], world.solids)
        height = rover.dynamics.down_m
        for _ in range(1000):
            push(rover, north_m_s=2.0 - rover.dynamics.vn_m_s)
            simulation.tick([None])
            if met := simulation.impacts():
                break
        for _ in range(100):
            simulation.tick([None])
        assert [(impact.other, impact.crash) for impact in met] == [("wall", False)]
        assert rover.dynamics.north_m < 5.0 and rover.dynamics.down_m == pytest.approx(height, abs=0.01)


def test_a_person_who_walks_into_a_standing_vehicle_pushes_it() -> None:
    walker = {
        "label": "person", "north_m": 0, "east_m": 3, "radius_m": 0.3, "height_m": 1.8,
        "path": [{"at_s": 0, "north_m": 0, "east_m": 3}, {"at_s": 4, "north_m": 0, "east_m": -1}],
    }  # fmt: skip
    world = World(read({"name": "x", "things": [walker]}, "x"), Path())
    iris = VehicleSimulator(vehicles.load("iris"), HOME, 1, FlatGround(), name="iris", obstacles=world.solids)
    simulation = Simulation([iris], world.solids)
    met = until_impact(simulation)
    assert met[0].other == "person" and met[0].time_us == pytest.approx(2.3e6, abs=0.2e6)


def test_a_fall_wrecks_and_a_landing_does_not() -> None:
    for height_m, wrecked in ((0.3, False), (3.0, True)):
        iris = VehicleSimulator(vehicles.load("iris"), HOME, 1, FlatGround(), name="iris")
        iris.dynamics.shift(0.0, 0.0, -height_m)
        simulation = Simulation([iris])
        for _ in range(500):
            simulation.tick([None])
        met = simulation.impacts()
        assert [(impact.other, impact.crash) for impact in met] == ([("ground", True)] if wrecked else [])
        if wrecked:
            assert met[0].speed_m_s == pytest.approx(math.sqrt(2 * 9.81 * height_m), rel=0.15), "less what drag takes"


def test_px4s_own_vehicles_fall_unharmed_as_in_sih() -> None:
    hexacopter = VehicleSimulator(vehicles.load("sihsim_hex"), HOME, 1, FlatGround(), name="hex")
    hexacopter.dynamics.shift(0.0, 0.0, -20.0)
    simulation = Simulation([hexacopter])
    for _ in range(1000):
        simulation.tick([None])
    assert simulation.impacts() == [] and not hexacopter.dynamics.wrecked


def test_a_wreck_tells_once_what_it_lies_against() -> None:
    """What keeps pushing it there, as gusts do, is no new meeting."""
    wall = {"name": "wall", "north_m": 25.5, "east_m": 0.0, "box": {"size_m": [1.0, 50.0, 400.0]}}
    world = World(read({"name": "x", "solids": [wall]}, "x"), Path())
    flying = in_the_air("iris", 0.0, world=world)
    flying.dynamics.shift(22.0, 0.0, 0.0)
    push(flying, north_m_s=8.0)
    simulation = Simulation([flying], world.solids)
    assert until_impact(simulation)[0].crash
    for _ in range(500):
        simulation.tick([None])
        push(flying, north_m_s=0.5)
    assert simulation.impacts() == []


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (
            {"solids": [{"name": "shed", "north_m": 1, "east_m": 0, "box": {"size_m": [6, 6, 4]}}]},
            "would start in shed, ",
        ),
        (
            {"water": [{"name": "pond", "polygon_m": [[-9, -9], [-9, 9], [9, 9], [9, -9]], "level_m": 2}]},
            "in pond, 0.0 m",
        ),
        ({"solids": [{"name": "pad", "north_m": 0, "east_m": 9, "box": {"size_m": [4, 4, 1]}}]}, ""),
    ],
)
def test_who_starts_in_something_is_named_with_it(part: dict[str, object], told: str) -> None:
    world = World(read({"name": "x", **part}, "x"), Path())
    standing = VehicleSimulator(vehicles.load("iris"), HOME, 1, FlatGround(), name="a", obstacles=world.solids)
    said = Simulation([standing], world.solids, world.areas).begins_in(["uas"])
    assert told in said and (said.startswith("uas would start in") if told else not said)


def test_who_starts_in_another_is_named_with_it() -> None:
    one, near, apart = (in_the_air(name, east_m) for name, east_m in (("one", 0.0), ("near", 0.2), ("apart", 3.0)))
    assert Simulation([one, apart]).begins_in(["uas", "ugv"]) == ""
    assert Simulation([one, near]).begins_in(["uas", "ugv"]) == "ugv would start in uas"


def test_a_wreck_stays_one_when_a_motor_that_had_failed_comes_back() -> None:
    one, other = in_the_air("one", 0.0), in_the_air("other", 2.0)
    one.motor_off[0] = True
    push(other, east_m_s=-6.0)
    simulation = Simulation([one, other])
    assert until_impact(simulation)[0].crash
    one.motor_off[0] = False
    full = HilActuatorControls(0, 1, (1.0,) * 4, 128)
    for _ in range(250):
        simulation.tick([full, full])
    assert max(one.dynamics.motor_speeds()) < 0.01
