"""A `VehicleCommand` from as many parameters as a test cares for."""

import math

from sitl_emu.autopilot.topics import VehicleCommand


def vehicle_command(number: int, *params: float, rest: float = math.nan) -> VehicleCommand:
    """A command of up to seven parameters; those that are not named are `rest`."""
    param1, param2, param3, param4, param5, param6, param7 = (*params, *(rest,) * (7 - len(params)))
    return VehicleCommand(number, param1, param2, param3, param4, param5, param6, param7)
