"""Command protocol: COMMAND_LONG and COMMAND_INT in, COMMAND_ACK out (https://mavlink.io/en/services/command.html).

The only writer of COMMAND_ACK. What is malformed is refused here; commands that concern a link (message requests and
intervals) are decided by their services here, all others by their owner in the autopilot. PX4 v1.18
(mavlink_receiver.cpp, handle_message_command_both) acts on every repetition and answers each.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, Final, Protocol

from sitl_emu.autopilot.commands.table import COMMANDS, UNKNOWN
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.mavlink.command_params import sets_unused, used_params
from sitl_emu.autopilot.mavlink.encoder import AUTOPILOT_COMPONENT
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import finite_or_nan, is_for
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

LOCAL_FRAMES = frozenset({1, 4, 7, 8, 9, 12, 20, 21})
"""MAV_FRAMEs in which COMMAND_INT's x and y are in units of 0.1 mm; in all others they are 1e-7 degrees."""
NOT_GIVEN: Final = 0x7FFFFFFF
"""x and y of a COMMAND_INT that leaves both out."""
NAN_AS_INTEGER: Final = 0x7FF80000
"""x and y of a sender that takes the bits of a number that is none for an integer."""
NOT_GIVEN_AS_FLOATS = (2147483520.0, 2147483904.0)
"""The floats around NOT_GIVEN: what a COMMAND_LONG has in param5 and param6 that was meant to be a COMMAND_INT."""
DENIED: int = mavlink.MAV_RESULT_DENIED
TAKEN_FROM_OUR_ADDRESS: Final = frozenset(
    {
        mavlink.MAV_CMD_DO_SET_MODE,
        mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE,
        mavlink.MAV_CMD_INJECT_FAILURE,
        mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_REQUEST_MESSAGE,
    }
)
"""What PX4 decides on before it asks who speaks; of the others it takes none from what bears its own address."""


class LinkCommands(Protocol):
    """A service that decides on commands about the link they came on."""

    COMMANDS: ClassVar[frozenset[int]]

    def handle_command(self, now_us: int, command: VehicleCommand, link: Link) -> CommandResult | None:
        """Decide, act on the link, and say the result; None gives no ack."""
        ...


class Command:
    """Turns command messages into VehicleCommands and results into acks."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT}
    )
    HAS_TIMER = True

    def __init__(
        self,
        links: Callable[[], tuple[Link, ...]],
        of_link: tuple[LinkCommands, ...],
        handle: Callable[[int, VehicleCommand], CommandResult | None],
        topics: Topics,
        system_id: int,
        traits: Traits,
    ) -> None:
        """Answers go out on `links`; later ones come in `topics`.

        `of_link` decides on link matters, `handle` on the rest.
        """
        self._links = links
        self._of_link = {number: service for service in of_link for number in service.COMMANDS}
        self._handle = handle
        self._topics = topics
        self._system_id = system_id
        self._traits = traits

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Decide and answer; nothing is said to a command for somebody else."""
        command = vehicle_command(message)
        if has_mistaken_place(message):  # PX4 says so whoever it is for
            self._answer(now_us, command, CommandResult(DENIED))
            return
        if not is_for(message, self._system_id, broadcast=True):
            return
        if sets_unused(used_params(command.command, self._traits, in_plan=False), numbers(message)):
            self._answer(now_us, command, CommandResult(DENIED))
            return
        is_ours = (command.source_system, command.source_component) == (self._system_id, AUTOPILOT_COMPONENT)
        if is_ours and command.command not in TAKEN_FROM_OUR_ADDRESS:
            return
        service = self._of_link.get(command.command)
        if service is not None:
            result = service.handle_command(now_us, command, link)
        else:
            result = self._handle(now_us, command)
        if result is not None:
            self._answer(now_us, command, result)

    def on_time(self, now_us: int) -> None:
        """Send the answers that came later."""
        if not self._topics.vehicle_command_acks:
            return
        for ack in self._topics.vehicle_command_acks:
            result = CommandResult(ack.result, ack.progress, ack.result_param2)
            self._answer(now_us, ack.command, result)
        self._topics.vehicle_command_acks = ()

    def _answer(self, now_us: int, command: VehicleCommand, result: CommandResult) -> None:
        tell(self._topics, now_us, command, result)
        send_ack(self._links(), command, result)


def has_mistaken_place(message: Any) -> bool:
    """Whether the place of a command was meant for the other message, or for a number that is none."""
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_INT:
        return bool(message.x == message.y == NAN_AS_INTEGER)
    low, high = NOT_GIVEN_AS_FLOATS
    return bool(low <= message.param5 <= high and low <= message.param6 <= high)


def numbers(message: Any) -> tuple[float, float, float, float, float, float, float]:
    """The seven parameters of a COMMAND_LONG or COMMAND_INT, a place in degrees or metres."""
    first = (message.param1, message.param2, message.param3, message.param4)
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
        return *first, message.param5, message.param6, message.param7
    x, y, z = message.x, message.y, message.z
    if x == y == NOT_GIVEN:
        return *first, math.nan, math.nan, z
    if not COMMANDS.get(message.command, UNKNOWN).scaled:
        return *first, float(x), float(y), z
    scale = 1e-4 if message.frame in LOCAL_FRAMES else 1e-7
    return *first, x * scale, y * scale, z


def vehicle_command(message: Any) -> VehicleCommand:
    """The command of a COMMAND_LONG or COMMAND_INT.

    Infinite parameters count as not given (NaN), as they do wherever PX4 asks whether a number is finite. It does not
    ask that of an interval.
    """
    is_int = message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_INT
    first, second, third, fourth, fifth, sixth, seventh = map(finite_or_nan, numbers(message))
    if message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
        second = message.param2
    return VehicleCommand(
        message.command,
        first,
        second,
        third,
        fourth,
        fifth,
        sixth,
        seventh,
        message.frame if is_int else mavlink.MAV_FRAME_GLOBAL,
        message.get_srcSystem(),
        message.get_srcComponent(),
        message.target_system,
        message.target_component,
        True,
        0 if is_int else message.confirmation,
    )


def send_ack(links: Iterable[Link], command: VehicleCommand, result: CommandResult) -> None:
    """Answer whom a command came from, on every link where that component was heard.

    As PX4 does (Mavlink::handleAndGetCurrentCommandAck): who speaks on two links hears the answer on both, and whom a
    link has no more room to note hears none.
    """
    asker = (command.source_system, command.source_component)
    for link in links:
        if link.heard(*asker):
            link.send_fields(
                mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
                command.command,
                result.result,
                result.progress,
                result.result_param2,
                *asker,
            )
