"""sleep: lets vehicle time pass (PX4: platforms/common/apps.cpp)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, WAIT, Output, Vehicle, integer, warning

SECOND_US = 1_000_000


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`sleep SECONDS`, whole ones."""
    if len(arguments) != 1:
        yield warning("px4", "Usage: sleep <seconds>")
        return FAILURE
    duration_us = SECOND_US * max(0, integer(arguments[0]))
    yield f"Sleeping for {arguments[0]} s; ({duration_us} us).\n"
    end_us = vehicle.now_us + duration_us
    while vehicle.now_us < end_us:
        yield WAIT
    return SUCCESS
