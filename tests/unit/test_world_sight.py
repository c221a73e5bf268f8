"""What is between two places of a world: a wall, a hill, somebody who walks by; and not who stands there themselves."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from sitl_emu.vehicles import load
from sitl_emu.world.description import read
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.home import Home
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.world import World

WALL = {"name": "wall", "north_m": 25.0, "east_m": 0.0, "box": {"size_m": [1.0, 20.0, 10.0]}}


class Hill:
    """10 m high, 20 m to the north."""

    def height_m(self, north_m: float, east_m: float) -> float:
        return 10.0 * math.exp(-(((north_m - 20.0) / 5.0) ** 2))

    def heights_m(self, north_m: Any, east_m: Any) -> Any:
        return np.vectorize(self.height_m)(north_m, east_m)


def test_a_wall_hides_what_is_behind_it_and_not_what_is_above_or_beside() -> None:
    world = World(read({"name": "x", "solids": [WALL]}, "x"), Path())
    here = (0.0, 0.0, -5.0)
    assert not world.sees(here, (50.0, 0.0, -5.0), 0.0) and not world.sees((50.0, 0.0, -5.0), here, 0.0)
    assert world.sees(here, (20.0, 0.0, -5.0), 0.0)
    assert world.sees(here, (50.0, 40.0, -5.0), 0.0) and world.sees((0.0, 0.0, -15.0), (50.0, 0.0, -15.0), 0.0)
    assert world.sees(here, here, 0.0)


def test_a_hill_does_too_and_level_ground_does_not() -> None:
    hilly = World(read({"name": "x"}, "x"), Path(), Hill())
    assert not hilly.sees((0.0, 0.0, -5.0), (40.0, 0.0, -5.0), 0.0)
    assert hilly.sees((0.0, 0.0, -11.0), (40.0, 0.0, -11.0), 0.0)
    assert World(read({"name": "x"}, "x"), Path()).sees((0.0, 0.0, 0.0), (500.0, 0.0, 0.0), 0.0)


def test_vehicles_are_in_nobodys_way() -> None:
    world = World(read({"name": "x", "solids": [WALL]}, "x"), Path())
    home = Home(47.397742, 8.545594, 489.4, 0.0)
    vehicles = [
        VehicleSimulator(
            load("iris"), home, 1, FlatGround(), start_north_m=north, name=str(north), obstacles=world.solids
        )
        for north in (0.0, 10.0, 20.0)
    ]
    Simulation(vehicles, world.solids)
    first, _, last = (simulator.pose() for simulator in vehicles)
    one, other = ((pose.north_m, pose.east_m, pose.down_m) for pose in (first, last))
    assert world.sees(one, other, 0.0)
