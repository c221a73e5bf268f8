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
    order = _order(vehicle, command, *values)
    order = order._replace(target_system=order.source_system, target_component=order.source_component)
    acks_before = len(vehicle.topics.vehicle_command_acks)
    result = vehicle.commands.handle(vehicle.now_us, order)
    if result is not None:
        return result.result
    to_nobody = vehicle.topics.vehicle_command_acks[acks_before:]
    return to_nobody[-1].result if to_nobody else None


def broadcast(vehicle: Vehicle, command: int, *values: float) -> None:
    """Give a command that is for others to all of them, with its first parameters, the others NaN."""
    vehicle.outgoing.give(_order(vehicle, command, *values))


def _order(vehicle: Vehicle, command: int, *values: float) -> VehicleCommand:
    param1, param2, param3, param4, param5, param6, param7 = (*values, *(math.nan,) * (7 - len(values)))
    return VehicleCommand(
        command, param1, param2, param3, param4, param5, param6, param7,
        source_system=int(vehicle.parameters["MAV_SYS_ID"]), source_component=mavlink.MAV_COMP_ID_AUTOPILOT1,
        from_external=False,
    )  # fmt: skip
