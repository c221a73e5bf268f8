"""logger: what is logged, and logging without arming (PX4: modules/logger)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, info, usage, warning
from sitl_emu.autopilot.shell.commands.module import COMMANDS, default_command


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`logger status`, `logger on`, `logger off`."""
    logger = vehicle.logger
    command = arguments[0] if arguments else ""
    if not logger.runs and command in ("on", "off"):
        yield warning("logger", "logger not running\n")
        yield usage("logger", COMMANDS)
        return FAILURE
    if logger.runs and command == "status":
        for line in logger.status():
            yield info("logger", line)
        return SUCCESS
    if command == "on":
        logger.on()
        return SUCCESS
    if command == "off":
        logger.off()
        return SUCCESS
    return (yield from default_command("logger", logger.runs, arguments))
