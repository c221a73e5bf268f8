"""system_time: the date (PX4: systemcmds/system_time)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, info, usage

COMMANDS = (("get", "seconds since 1970"),)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`system_time get`."""
    if list(arguments) != ["get"]:
        yield usage("system_time", COMMANDS)
        return FAILURE
    unix_s = (vehicle.mavlink.context.boot_unix_us + vehicle.now_us) // 1_000_000
    yield info("system_time", f"Unix epoch time: {unix_s}")
    return SUCCESS
