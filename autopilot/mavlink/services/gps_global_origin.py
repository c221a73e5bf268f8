"""SET_GPS_GLOBAL_ORIGIN: where on Earth the local frame begins, for vehicles that know their place by vision alone.

https://mavlink.io/en/messages/common.html#SET_GPS_GLOBAL_ORIGIN. As PX4: it does what DO_SET_GLOBAL_ORIGIN does, and
the stream of GPS_GLOBAL_ORIGIN tells what came of it.
"""

from collections.abc import Callable
from typing import Any, ClassVar

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink


class GpsGlobalOrigin:
    """Gives the command, and tells the origin."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN})
    HAS_TIMER = False

    def __init__(
        self,
        handle_command: Callable[[int, VehicleCommand], CommandResult | None],
        system_id: int,
    ) -> None:
        """`handle_command` decides on it; `system_id` is ours."""
        self._handle_command = handle_command
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """The message has a target system alone, and 0 is not us (handle_message_set_gps_global_origin)."""
        if message.target_system != self._system_id:
            return
        place = (message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3)
        command = VehicleCommand(mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN, 0.0, 0.0, 0.0, 0.0, *place, from_external=False)
        self._handle_command(now_us, command)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
