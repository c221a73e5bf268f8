"""dataman: what is kept of plans (PX4: modules/dataman, which counts reads and writes instead)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autopilot.shell.command import SUCCESS, Output, info
from autopilot.shell.commands.module import default_command

if TYPE_CHECKING:
    from autopilot.autopilot import Autopilot


def main(autopilot: "Autopilot", arguments: Sequence[str]) -> Output:
    """`dataman status`."""
    if list(arguments) != ["status"]:
        return (yield from default_command("dataman", True, arguments))
    dataman = autopilot.dataman
    yield info("dataman", f"mission items: {len(dataman.mission.items)}, current: {dataman.current_seq}")
    yield info("dataman", f"fence items: {len(dataman.fence.items)}")
    yield info("dataman", f"rally points: {len(dataman.rally.items)}")
    return SUCCESS
