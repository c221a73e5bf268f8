"""Vehicles for autopilots of ours: a model whose airframe names only parameters that PX4 has."""

import vehicles
from autopilot import parameters
from vehicles import Vehicle, VehicleError


def load(model: str) -> Vehicle:
    """A vehicle by its name or its folder. Raises VehicleError; its airframe may be wrong, too."""
    vehicle = vehicles.load(model)
    known = parameters.table()
    for name in vehicle.airframe:
        if name not in known:
            raise VehicleError(f"{vehicle.model}/{vehicles.AIRFRAME}: {name}: PX4 v1.18 knows no such parameter")
    return vehicle
