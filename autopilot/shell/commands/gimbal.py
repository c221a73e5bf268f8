"""gimbal: whether it runs (PX4: modules/gimbal, which reads its arguments itself)."""

from collections.abc import Sequence

from sitl_emu.autopilot.payload.gimbal import Gimbal
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, error, info, usage
from sitl_emu.autopilot.shell.commands.module import was_started

COMMANDS = (("status", "whether it runs"),)
NOT_UNDERSTOOD = -1


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`gimbal status`."""
    if list(arguments[:1]) == ["status"]:
        yield "running\n" if was_started(Gimbal)(vehicle) else info("gimbal", "not running")
        return SUCCESS
    yield error("gimbal", "unrecognized command" if arguments else "missing command")
    yield usage("gimbal", COMMANDS)
    return NOT_UNDERSTOOD
