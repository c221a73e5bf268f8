"""Command protocol: COMMAND_LONG and COMMAND_INT in, COMMAND_ACK out (https://mavlink.io/en/services/command.html).

The only writer of COMMAND_ACK. Commands that concern a link (message requests and intervals) are decided by their
services here, all others by their owner in the autopilot. PX4 (mavlink_receiver.cpp, handle_message_command_both)
acts on every repetition and answers each.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from autopilot.commands import CommandResult
from autopilot.mavlink.encoder import AUTOPILOT_COMPONENT
from autopilot.mavlink.link import Link
from autopilot.mavlink.services.service import finite_or_nan, is_for
from autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

LOCAL_FRAMES = frozenset({1, 2, 4, 7, 8, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21})
"""MAV_FRAMEs in which COMMAND_INT's x and y are no latitude and longitude."""
NOT_GIVEN = 0x7FFFFFFF
"""x or y of a COMMAND_INT that is left out."""


class LinkCommands(Protocol):
    """A service that decides on commands about the link they came on."""

    COMMANDS: frozenset[int]

    def handle_command(self, now_us: int, command: VehicleCommand, link: Link) -> CommandResult | None:
        """Decide, act on the link, and say the result; None gives no ack."""
        ...


class Command:
    """Turns command messages into VehicleCommands and results into acks."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT})
    HAS_TIMER = True

    def __init__(
        self,
        links: tuple[Link, ...],
        of_link: tuple[LinkCommands, ...],
        handle: Callable[[int, VehicleCommand], CommandResult | None],
        topics: Topics,
        system_id: int,
    ) -> None:
        """Answers go out on `links`; later ones come in `topics`.

        `of_link` decides on link matters, `handle` on the rest.
        """
        self._links = links
        self._of_link = {number: service for service in of_link for number in service.COMMANDS}
        self._handle = handle
        self._topics = topics
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Decide and answer; nothing is said to a command for somebody else."""
        if not is_for(message, self._system_id, broadcast=True):
            return
        command = vehicle_command(message)
        service = self._of_link.get(command.command)
        if service is not None:
            result = service.handle_command(now_us, command, link)
        elif (command.source_system, command.source_component) == (self._system_id, AUTOPILOT_COMPONENT):
            return  # PX4 takes no orders from what bears its own address
        else:
            result = self._handle(now_us, command)
        if result is not None:
            send_ack(self._links, link, command, result)

    def on_time(self, now_us: int) -> None:
        """Send the answers that came later."""
        if not self._topics.vehicle_command_acks:
            return
        for ack in self._topics.vehicle_command_acks:
            send_ack(self._links, None, ack.command, CommandResult(ack.result, ack.progress, ack.result_param2))
        self._topics.vehicle_command_acks = ()


def vehicle_command(message: Any) -> VehicleCommand:
    """The command of a COMMAND_LONG or COMMAND_INT, latitude and longitude in degrees in param5 and param6.

    Infinite parameters count as not given (NaN), as they do wherever PX4 asks whether a number is finite.
    """
    confirmation = 0
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_INT:
        frame = message.frame
        param5, param6, param7 = _scaled(message.x, frame), _scaled(message.y, frame), message.z
    else:
        frame = mavlink.MAV_FRAME_GLOBAL
        param5, param6, param7 = message.param5, message.param6, message.param7
        confirmation = message.confirmation
    return VehicleCommand(
        message.command,
        finite_or_nan(message.param1),
        finite_or_nan(message.param2),
        finite_or_nan(message.param3),
        finite_or_nan(message.param4),
        finite_or_nan(param5),
        finite_or_nan(param6),
        finite_or_nan(param7),
        frame,
        message.get_srcSystem(),
        message.get_srcComponent(),
        message.target_system,
        message.target_component,
        True,
        confirmation,
    )


def _scaled(value: int, frame: int) -> float:
    if value == NOT_GIVEN:
        return math.nan
    return value * 1e-4 if frame in LOCAL_FRAMES else value * 1e-7


def send_ack(links: Iterable[Link], origin: Link | None, command: VehicleCommand, result: CommandResult) -> None:
    """Answer whom a command came from: on the link it came on, and on every other where that component was heard.

    As PX4 does (Mavlink::task_main, is_target_known): who speaks on two links hears the answer on both.
    """
    asker = (command.source_system, command.source_component)
    for link in links:
        if link is origin or link.heard(*asker):
            link.send_fields(
                mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
                command.command,
                result.result,
                result.progress,
                result.result_param2,
                *asker,
            )
