"""Commands that come from inside: what PX4's shell publishes as vehicle_command."""

import math

from sitl_emu.autopilot.shell.command import Vehicle
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink


def send(vehicle: Vehicle, command: int, *values: float) -> bool:
    """Give a command with its first parameters, the others NaN; whether it was accepted."""
    return bool(send_for_result(vehicle, command, *values) == mavlink.MAV_RESULT_ACCEPTED)


def send_for_result(vehicle: Vehicle, command: int, *values: float) -> int | None:
    """The same; MAV_RESULT, or None for no answer."""
    system, component = int(vehicle.parameters["MAV_SYS_ID"]), mavlink.MAV_COMP_ID_AUTOPILOT1
    param1, param2, param3, param4, param5, param6, param7 = (*values, *(math.nan,) * (7 - len(values)))
    order = VehicleCommand(command, param1, param2, param3, param4, param5, param6, param7)
    order = order._replace(
        source_system=system,
        source_component=component,
        target_system=system,
        target_component=component,
        from_external=False,
    )
    result = vehicle.commands.handle(vehicle.now_us, order)
    return None if result is None else result.result
