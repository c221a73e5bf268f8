"""SET_MODE: the old way to change the mode, which QGroundControl still uses; acked as MAV_CMD_DO_SET_MODE."""

from collections.abc import Callable
from typing import Any, ClassVar

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.command import send_ack
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink


class SetMode:
    """Turns SET_MODE into the command."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SET_MODE})
    HAS_TIMER = False

    def __init__(
        self,
        links: Callable[[], tuple[Link, ...]],
        handle: Callable[[int, VehicleCommand], CommandResult | None],
        topics: Topics,
        system_id: int,
    ) -> None:
        """`handle` decides; the answers go to those of `links` where the asker was heard, and to the log."""
        self._links = links
        self._handle = handle
        self._topics = topics
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """base_mode and two bytes of custom_mode become the first three parameters (handle_message_set_mode)."""
        if message.target_system not in (0, self._system_id):
            return
        command = VehicleCommand(
            mavlink.MAV_CMD_DO_SET_MODE,
            float(message.base_mode),
            float(message.custom_mode >> 16 & 255),
            float(message.custom_mode >> 24 & 255),
            *(0.0,) * 4,
            source_system=message.get_srcSystem(),
            source_component=message.get_srcComponent(),
            target_system=message.target_system,
            confirmation=1,
        )
        result = self._handle(now_us, command)
        if result is not None:
            tell(self._topics, now_us, command, result)
            send_ack(self._links(), command, result)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
