"""MAV_CMD_REQUEST_MESSAGE: sends a message once.

As PX4 (MavlinkReceiver::handle_request_message_command): the message goes out on the link of the request; a message
that PX4 has no stream for, or has nothing to say in, is DENIED.
"""

from collections.abc import Callable
from typing import ClassVar

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import (
    MAV_RESULT_ACCEPTED,
    MAV_RESULT_DENIED,
    CommandResult,
    nearest,
)
from sitl_emu.autopilot.mavlink import silent_streams
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services import message_interval
from sitl_emu.autopilot.mavlink.stream import Stream
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

ACCEPTED_IN_SILENCE = frozenset({292})
"""Accepted without anything being sent, as measured: ESC_EEPROM (request_message/292)."""
OF_SERVICES = frozenset({mavlink.MAVLINK_MSG_ID_MISSION_CURRENT})
"""Sent by services in PX4, so that there is no stream to ask."""


class MessageRequest:
    """Decides on REQUEST_MESSAGE."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.MESSAGE_REQUEST)

    def __init__(self, stream: Callable[[str], Stream | None]) -> None:
        """`stream` finds a stream by message name."""
        self._stream = stream

    def handle_command(self, now_us: int, command: VehicleCommand, link: Link) -> CommandResult:
        """Send the message whose id is param1."""
        message_id = nearest(command.param1) & 0xFFFF
        if message_id == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            message_interval.send_interval(link, message_interval.message_id_of(command.param2))
            return CommandResult(MAV_RESULT_ACCEPTED)
        if message_id in ACCEPTED_IN_SILENCE:
            return CommandResult(MAV_RESULT_ACCEPTED)
        table = mavlink.mavlink_map.get(message_id)
        name = "" if table is None or message_id in OF_SERVICES else table.msgname
        stream = self._stream(name)
        if stream is None and name not in silent_streams.SILENT:
            return CommandResult(MAV_RESULT_DENIED)
        was_there = message_id in link.requested_once or link.interval_us(message_id) is not None
        if not was_there:
            link.requested_once.add(message_id)
        if stream is None:
            return CommandResult(MAV_RESULT_DENIED)
        if not was_there and stream.begin(now_us, link):
            return CommandResult(MAV_RESULT_DENIED)  # nothing is new after that
        payloads = stream.requested(now_us, link, command.param2)
        for payload in payloads or ():
            link.send_payload(stream.codec, payload)
        if payloads:
            stream.sent(now_us, link)
        return CommandResult(MAV_RESULT_DENIED if payloads is None else MAV_RESULT_ACCEPTED)
