"""Where a scenario's vehicles start: their simulators, at rest."""

from sitl_emu.run import models
from sitl_emu.run.configs import ModelData, StartPlace
from sitl_emu.run.scenario_parts.part import Place
from sitl_emu.world.simulator import VehicleSimulator
from sitl_emu.world.world import World


def simulator(
    name: str, model: ModelData, start: str | StartPlace | Place, world: World, seed: int
) -> VehicleSimulator:
    """A vehicle's simulator; `start`: a place of the world by its name, or numbers."""
    place = world.places[start] if isinstance(start, str) else start
    return VehicleSimulator(
        models.as_set(model),
        world.home._replace(heading_deg=place.heading_deg),
        seed=seed,
        terrain=world.terrain,
        wind=world.wind,
        start_north_m=place.north_m,
        start_east_m=place.east_m,
        name=name,
        obstacles=world.solids,
        areas=world.areas,
    )
