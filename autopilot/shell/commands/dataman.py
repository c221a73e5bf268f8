"""dataman: what is kept of plans (PX4: modules/dataman, which counts reads and writes instead)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`dataman status`."""
    if list(arguments) != ["status"]:
        return (yield from default_command("dataman", True, arguments))
    dataman = vehicle.dataman
    yield info("dataman", f"mission items: {len(dataman.mission.items)}, current: {dataman.current_seq}")
    yield info("dataman", f"fence items: {len(dataman.fence.items)}")
    yield info("dataman", f"rally points: {len(dataman.rally.items)}")
    return SUCCESS
