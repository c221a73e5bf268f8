"""Commands of the autopilot to others: COMMAND_LONG out on every link, repeated until a COMMAND_ACK comes.

As PX4's MavlinkCommandSender (v1.18): sent on all links at once (by a stream on its own alone), again with the next
confirmation, at most three times more; an ack for it from its target, on any of them, ends that. So a mission's camera
items reach the camera wherever it is. Of commands that are given in one moment the first alone is repeated, as PX4
tells them apart by their time.

Of PX4's links one begins each round of repetitions when 0.5 s have passed, and the others join when they have passed
once more; which one begins is chance, often that to SIH's display. Here nobody begins early: all join.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.mavlink.encoder import AUTOPILOT_COMPONENT
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import is_for
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

RETRY_US: Final = 500_000
FIRST_RETRY_US = 2 * RETRY_US
RETRIES: Final = 3
TRACKED: Final = 3
"""PX4 repeats the newest three only."""
NEVER_US = 1 << 62


@dataclass
class Sent:
    """A command under way."""

    command: VehicleCommand
    given_us: int
    links: list[Link]
    again_us: int
    retries: int = 0
    answered: bool = False
    """Kept until it would be repeated, as links may still come to send it."""


class CommandSender:
    """Sends what waits in `outgoing`."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_ACK})
    HAS_TIMER = True

    def __init__(
        self, links: Callable[[], Iterable[Link]], outgoing: OutgoingCommands, system_id: int, topics: Topics
    ) -> None:
        """`links` tells all links there are; what is sent is told to the log through `topics`."""
        self._topics = topics
        self._links = links
        self._outgoing = outgoing
        self._system_id = system_id
        self._under_way: list[Sent] = []
        self._again_us = NEVER_US

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """An ack of the command's target ends it, unless it answers somebody else (handle_message_command_ack).

        Whoever answers, and whatever: the log has it.
        """
        if not is_for(message, self._system_id, broadcast=True):
            return
        asked = VehicleCommand(
            message.command, source_system=message.target_system, source_component=message.target_component
        )
        result = CommandResult(message.result, message.progress, message.result_param2)
        tell(self._topics, now_us, asked, result, from_outside=True)
        listener = self._outgoing.on_answer.get(message.command)
        if listener is not None:
            listener(now_us, message)
        for sent in self._under_way:
            command = sent.command
            if (
                link in sent.links
                and not sent.answered
                and command.command == message.command
                and command.target_system in (0, message.get_srcSystem())
                and command.target_component in (0, message.get_srcComponent())
            ):
                sent.answered = True
                return

    def send(self, now_us: int, command: VehicleCommand, link: Link) -> None:
        """Send a command on one link, and see that it is answered."""
        _write(command, 0, link)
        for sent in self._under_way:
            if sent.given_us == now_us:
                if link not in sent.links:
                    sent.links.append(link)
                return
        again_us = now_us + FIRST_RETRY_US
        self._under_way = [*self._under_way[1 - TRACKED :], Sent(command, now_us, [link], again_us)]
        self._again_us = min(self._again_us, again_us)

    def on_time(self, now_us: int) -> None:
        """New commands, and those to be repeated."""
        if self._outgoing.waiting:
            waiting = self._outgoing.waiting[:]
            self._outgoing.waiting.clear()
            for command in waiting:
                for link in self._links():
                    self.send(now_us, command, link)
                own = command._replace(source_system=self._system_id, source_component=AUTOPILOT_COMPONENT)
                tell(self._topics, now_us, own)
        if now_us >= self._again_us:
            self._repeat(now_us)

    def _repeat(self, now_us: int) -> None:
        for sent in self._under_way[:]:
            if now_us < sent.again_us:
                continue
            if sent.answered or sent.retries == RETRIES:
                self._under_way.remove(sent)
                continue
            sent.retries += 1
            sent.again_us = now_us + RETRY_US
            for link in sent.links:
                _write(sent.command, sent.retries, link)
        self._again_us = min((sent.again_us for sent in self._under_way), default=NEVER_US)


def _write(command: VehicleCommand, confirmation: int, link: Link) -> None:
    link.send_fields(
        mavlink.MAVLINK_MSG_ID_COMMAND_LONG,
        *command[1:8],
        command.command,
        command.target_system,
        command.target_component,
        confirmation,
    )
