"""What flies into something: a wall, another vehicle, a roof to land on. Whole vehicles in worlds with solids."""

import math
from pathlib import Path

import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.world.description import read
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.world import World
from tests.flight.pilot import Pilot

WALL_NORTH_M, ROOF_M = 30.0, 3.0
HALL = {
    "name": "hall",
    "solids": [
        {"name": "wall", "north_m": WALL_NORTH_M + 0.5, "east_m": 0, "box": {"size_m": [1.0, 40.0, 20.0]}},
        {"name": "shed", "north_m": 0, "east_m": 12.0, "box": {"size_m": [6.0, 6.0, ROOF_M]}},
    ],
}
IRIS_REACH_M = 0.1515 + 0.128
"""From its centre to the propellers' foremost point."""


def offboard(pilot: Pilot, vn_m_s: float, ve_m_s: float = 0.0) -> None:
    """Fly with this velocity, at a height that is held."""
    pilot.every(
        20.0,
        lambda: mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0b110111000111, 0, 0, 0, vn_m_s, ve_m_s, 0, 0, 0, 0, 0, 0
        ),
    )
    pilot.run(1.0)
    pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 6, 0)


def test_an_iris_at_5_m_s_crashes_at_the_wall() -> None:
    pilot = Pilot("iris", world=World(read(HALL, "hall"), Path()))
    pilot.take_off(5.0)
    offboard(pilot, 5.0)
    impacts = pilot.until_impact()
    crash = impacts[0]
    assert (crash.vehicle, crash.other, crash.crash) == ("iris", "wall", True)
    assert crash.speed_m_s == pytest.approx(5.0, abs=0.5)
    reach = IRIS_REACH_M * math.cos(math.radians(10.0))
    assert pilot.truth.north_m + reach == pytest.approx(WALL_NORTH_M, abs=0.1)
    pilot.run(5.0)
    assert pilot.truth.north_m < WALL_NORTH_M and -pilot.truth.down_m < 0.5, "it lies before the wall"
    assert max(pilot.simulator.dynamics.motor_speeds()) < 0.01, "its propellers stand still"


def test_it_lands_on_a_roof_and_lidar_and_camera_see_the_roof_there() -> None:
    world = World(read(HALL, "hall"), Path())
    pilot = Pilot("iris", world=world)
    pilot.take_off(8.0)
    home = pilot.topics.home_position
    pilot.command(
        mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, math.nan,
        home.lat, home.lon + 12.0 / (111_319.49 * math.cos(math.radians(home.lat))), home.alt + 8.0,
    )  # fmt: skip
    pilot.until(lambda: abs(pilot.truth.east_m - 12.0) < 0.5, 40.0)
    pilot.run(4.0)
    above = np.array([(pilot.truth.north_m, pilot.truth.east_m, pilot.truth.down_m)])
    hit = world.raycast(above, np.array([(0.0, 0.0, 1.0)]), 0.0, 100.0)
    assert hit.name == ["shed"]
    assert -pilot.truth.down_m - float(hit.range_m[0]) == pytest.approx(ROOF_M, abs=1e-6)
    looking_down = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    depth = MeshScene(world, Path()).renderer(640, 480, 320.0).depth(above[0], looking_down, 0.0)
    assert -pilot.truth.down_m - depth[240, 320] == pytest.approx(ROOF_M, abs=0.1)
    assert -pilot.truth.down_m - pilot.topics.distance_sensor.current_distance == pytest.approx(ROOF_M, abs=0.1)
    pilot.command(mavlink.MAV_CMD_NAV_LAND)
    pilot.until_disarmed()
    gear_m = pilot.simulator.vehicle.gear.height_m if pilot.simulator.vehicle.gear else 0.0
    assert -pilot.truth.down_m - gear_m == pytest.approx(ROOF_M, abs=0.1)
    assert pilot.simulation.impacts() == [], "a landing is no crash"
