"""Where the vehicles of `launch` and `world` stand: side by side, from the home of their world eastwards."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.contacts import Contacts
from sitl_emu.world.ground import FlatGround, Terrain
from sitl_emu.world.home import Home
from sitl_emu.world.obstacles import Areas, Obstacles
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.wind import Wind

if TYPE_CHECKING:
    from sitl_emu.world.world import World

SPACING_M = 3.0
ROOM_M = 0.5
"""All but the first stand at least so far from anything; ours, less than half of `SPACING_M`."""
MOST_PASSED = 100
"""In a row so many places are passed over at most; ours: 300 m, farther than any town of ours reaches."""
NO_ROOM = (
    "vehicles stand in a row, 3 m apart, from the world's place `home` eastwards: take fewer, or a world with room"
)
"""What to do about one that stands in something."""


class Site(NamedTuple):
    """A world, and the place in it where the first vehicle stands."""

    home: Home
    """The world's origin, and the heading of all vehicles."""
    terrain: Terrain
    seed: int
    """Of the world, and of the noise of all sensors."""
    wind: Wind | None = None
    north_m: float = 0.0
    east_m: float = 0.0
    solids: Obstacles | None = None
    """What stands there."""
    areas: Areas | None = None
    """Its water and foliage."""
    world: "World | None" = None
    """The world itself; None where there is nothing to see."""

    def row(self, vehicles: Sequence[Vehicle]) -> list[float]:
        """How far east of the first place each vehicle stands, m: the first in it, each other at the next free one.

        Free is where it would be in no water and `ROOM_M` from all solids. After `MOST_PASSED` that are not it stands
        in one all the same, and whoever begins with it is told (`Simulation.begins_in`).
        """
        places, at, passed = list[float](), 0, 0
        for vehicle in vehicles:
            while places and passed < MOST_PASSED and not self._is_free(vehicle, at * SPACING_M):
                at, passed = at + 1, passed + 1
            places.append(at * SPACING_M)
            at += 1
        return places

    def _is_free(self, vehicle: Vehicle, offset_m: float) -> bool:
        if self.solids is None and self.areas is None:
            return True
        simulator = self.simulator(vehicle, offset_m, vehicle.model)
        return not Contacts([simulator], self.solids, self.areas).near(0, ROOM_M)

    def simulator(self, vehicle: Vehicle, offset_m: float, name: str) -> VehicleSimulator:
        """The simulator of a vehicle so far east of the first place, at rest; its `name` chooses its noise."""
        east_m = self.east_m + offset_m
        return VehicleSimulator(
            vehicle,
            self.home,
            self.seed,
            self.terrain,
            self.wind,
            self.north_m,
            east_m,
            name,
            self.solids,
            self.areas,
        )


def plain(home: Home, seed: int) -> Site:
    """A level plain without end and without wind; nothing is loaded for it."""
    return Site(home, FlatGround(), seed)


def in_world(name: str, seed: int, say: Callable[[str], None], *, parcels: bool = False) -> Site:
    """The place `home` of a world, or its first; `say`: what of a Gazebo world is not there. Raises WorldError.

    `parcels`: whether vehicles will let some go in it.
    """
    from sitl_emu.run import worlds

    world = worlds.build(name, seed, {})
    for line in worlds.not_read(world):
        say(line)
    if parcels:
        worlds.expect_parcels(world)
    home = world.places.get("home") or next(iter(world.places.values()))
    origin = world.home._replace(heading_deg=home.heading_deg)
    return Site(origin, world.terrain, seed, world.wind, home.north_m, home.east_m, world.solids, world.areas, world)
