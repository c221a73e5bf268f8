"""shutdown: ends PX4 (platforms/common/apps.cpp)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle
from sitl_emu.autopilot.shell.vehicle_command import send
from sitl_emu.core import dialect as mavlink

SHUTDOWN = 2.0


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """Not while armed, unlike PX4."""
    yield "Exiting NOW.\n"
    send(vehicle, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, SHUTDOWN)
    return SUCCESS
