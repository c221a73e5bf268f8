"""perf: performance counters (PX4: systemcmds/perf), of which none are kept here: modules take no simulated time."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, usage
from sitl_emu.autopilot.shell.options import NOT_UNDERSTOOD

COMMANDS = (("reset", "counts anew"), ("latency", "how late its timer was"))


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`perf`, `perf reset` and `perf latency`: nothing to print."""
    if not arguments or arguments[0] in dict(COMMANDS):
        return SUCCESS
    yield usage("perf", COMMANDS)
    return NOT_UNDERSTOOD
