"""logger: what is logged, and logging without arming (PX4: modules/logger)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`logger status`, `logger on`, `logger off`."""
    logger = vehicle.logger
    command = arguments[0] if arguments else ""
    if command == "status":
        for line in logger.status():
            yield info("logger", line)
        return SUCCESS
    if command == "on":
        logger.on()
        return SUCCESS
    if command == "off":
        logger.off()
        return SUCCESS
    return (yield from default_command("logger", True, arguments))
