"""shutdown: ends PX4 (platforms/common/apps.cpp)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from autopilot.shell.command import SUCCESS, Output
from autopilot.shell.vehicle_command import send
from sitl_emu.core import dialect as mavlink

if TYPE_CHECKING:
    from autopilot.autopilot import Autopilot

SHUTDOWN = 2.0


def main(autopilot: "Autopilot", arguments: Sequence[str]) -> Output:
    """Not while armed, unlike PX4."""
    yield "Exiting in shutdown_main\n"
    send(autopilot, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, SHUTDOWN)
    return SUCCESS
