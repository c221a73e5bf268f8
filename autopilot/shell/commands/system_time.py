"""system_time: the date (PX4: systemcmds/system_time)."""

from collections.abc import Sequence
from datetime import UTC, datetime

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, error, info, usage

COMMANDS = (("get", "the date, and how long the autopilot runs"),)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`system_time get`; `set` is unknown, as the simulation gives the date."""
    if arguments[:1] != ["get"]:
        yield error("system_time", f"system_time: {'Unknown subcommand' if arguments else 'not enough arguments'}")
        yield usage("system_time", COMMANDS)
        return FAILURE
    unix_s = (vehicle.mavlink.context.boot_unix_us + vehicle.now_us) // 1_000_000
    yield info("system_time", f"Unix epoch time: {unix_s}")
    yield info("system_time", f"System time: {datetime.fromtimestamp(unix_s, UTC):%a %Y-%m-%d %H:%M:%S} UTC")
    yield info("system_time", f"Uptime (since boot): {vehicle.now_us // 1_000_000} s")
    return SUCCESS
