"""Where to let a parcel go: by the textbook where that has an answer, and as parcels of the simulator fall."""

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.missions.companion.release_point import Fall, Parcel, Wind, fall, release_point
from sitl_emu.world.atmosphere import density_kg_m3
from sitl_emu.world.description import Box, Loose, read
from sitl_emu.world.loose import LooseBody
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.world import World
from tests.typed import present

G = 9.80665
STILL = Wind(0.0, 0.0)
DATA = present(vehicles.load("responder").release).parcel
PARCEL = Parcel(DATA.mass_kg, DATA.drag_m2, 0.5 * DATA.size_m[2])


def simulated(
    parcel: Parcel, height_m: float, velocity: tuple[float, float, float], wind: Wind, place: tuple[float, float]
) -> tuple[float, float, float]:
    """North, east (m) and time (s) at which a loose body, let go at a place, meets the simulator's ground."""
    blows = {
        "north_m_s": wind.north_m_s,
        "east_m_s": wind.east_m_s,
        "profile_exponent": wind.exponent,
        "reference_height_m": wind.at_height_m,
    }
    world = World(read({"name": "x", "wind": blows}, "x"), Path())
    world.expect_releases()
    simulation = Simulation([], world.solids)
    box = Box((DATA.size_m[0], DATA.size_m[1], 2.0 * parcel.half_height_m))
    made = Loose("parcel", 0.0, 0.0, mass_kg=parcel.mass_kg, box=box, drag_m2=parcel.drag_m2)
    simulation.release(made, (*place, -height_m), velocity=velocity)
    body = present(world.solids).loose_body("parcel")
    assert isinstance(body, LooseBody)
    time_s, fell = 0.0, velocity[2]
    while body.velocity[2] >= fell - 0.5:  # the ground takes most of its speed
        fell, before = body.velocity[2], (body.north_m, body.east_m, time_s)
        simulation.tick([])
        time_s += 0.004
        assert time_s < 30.0
    return before


def test_without_air_it_is_a_parabola() -> None:
    falls = fall(Parcel(2.0, 0.0), 20.0, (8.0, -3.0, 0.0), STILL)
    time_s = math.sqrt(40.0 / G)
    assert falls.time_s == pytest.approx(time_s, abs=1e-4)
    assert (falls.north_m, falls.east_m) == pytest.approx((8.0 * time_s, -3.0 * time_s), abs=1e-3)
    assert falls.velocity_m_s == pytest.approx((8.0, -3.0, G * time_s), abs=1e-3)


def test_straight_down_it_is_the_textbooks_fall_with_drag() -> None:
    """V = v_t tanh(g t / v_t), h = v_t² / g · ln cosh(g t / v_t)."""
    terminal = math.sqrt(2.0 * 2.0 * G / (1.225 * 0.045))
    falls = fall(Parcel(2.0, 0.045), 50.0, (0.0, 0.0, 0.0), STILL)
    assert terminal**2 / G * math.log(math.cosh(G * falls.time_s / terminal)) == pytest.approx(50.0, abs=1e-3)
    assert falls.velocity_m_s[2] == pytest.approx(terminal * math.tanh(G * falls.time_s / terminal), abs=1e-3)


def test_a_parcel_on_the_ground_stays() -> None:
    assert fall(PARCEL, 0.05, (3.0, 0.0, 0.0), Wind(9.0, 0.0)) == Fall(0.0, 0.0, 0.0, (3.0, 0.0, 0.0))


def test_a_delay_is_flown_through() -> None:
    now = release_point((0.0, 0.0), PARCEL, 10.0, (4.0, 2.0, 0.0), STILL)
    later = release_point((0.0, 0.0), PARCEL, 10.0, (4.0, 2.0, 0.0), STILL, delay_s=0.5)
    assert later == pytest.approx((now[0] - 2.0, now[1] - 1.0))


@given(
    height=st.floats(2.0, 40.0),
    velocity=st.tuples(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0), st.floats(-2.0, 2.0)),
    wind=st.builds(Wind, st.floats(-12.0, 12.0), st.floats(-12.0, 12.0), st.floats(2.0, 40.0), st.floats(0.0, 0.3)),
    mass=st.floats(0.2, 2.0),
)
@settings(max_examples=60, deadline=None)
def test_let_go_there_the_simulators_parcel_lands_on_the_place(
    height: float, velocity: tuple[float, float, float], wind: Wind, mass: float
) -> None:
    place, parcel = (12.0, -7.0), PARCEL._replace(mass_kg=mass)
    air = density_kg_m3(World(read({"name": "x"}, "x"), Path()).home.alt_amsl_m)
    point = release_point(place, parcel, height, velocity, wind, air_kg_m3=air)
    north, east, time_s = simulated(parcel, height, velocity, wind, point)
    assert math.dist((north, east), place) < 0.15, "two ticks of 10 m/s, and what a step of 4 ms leaves"
    assert time_s == pytest.approx(fall(parcel, height, velocity, wind, air).time_s, abs=0.02)
