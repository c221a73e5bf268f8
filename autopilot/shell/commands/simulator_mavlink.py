"""simulator_mavlink: the link to a simulator outside (PX4: modules/simulation/simulator_mavlink, which has no module's
answers); it runs where PX4's own simulator does not."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, info, warning
from sitl_emu.autopilot.shell.commands import simulator_sih

NAME = "simulator_mavlink"


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`simulator_mavlink status`."""
    if list(arguments) != ["status"]:
        yield info(NAME, f"Usage: {NAME} status")
        return FAILURE
    if simulator_sih.runs(vehicle):
        yield warning(NAME, "Simulator not running")
        return FAILURE
    yield info(NAME, "running")
    return SUCCESS
