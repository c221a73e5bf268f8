"""Where the vehicles of `launch` and `world` stand: side by side, from the home of their world eastwards."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.ground import FlatGround, Terrain
from sitl_emu.world.home import Home
from sitl_emu.world.obstacles import Areas, Obstacles
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.wind import Wind

if TYPE_CHECKING:
    from sitl_emu.world.world import World

SPACING_M = 3.0
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

    def simulator(self, vehicle: Vehicle, place: int, name: str) -> VehicleSimulator:
        """The simulator of a vehicle at the `place`th place of the row, at rest; its `name` chooses its noise."""
        east_m = self.east_m + place * SPACING_M
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
