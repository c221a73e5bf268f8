"""land_detector: which kind runs (PX4: modules/land_detector)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`land_detector status`."""
    if list(arguments) != ["status"]:
        return (yield from default_command("land_detector", True, arguments))
    yield info("land_detector", f"running ({vehicle.topics.vehicle_status.vehicle_kind.traits.land_detector})")
    return SUCCESS
