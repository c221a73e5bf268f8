"""Who answers which MAV_CMD: each owner of state lists its COMMANDS and decides on them.

`mavlink/services/command.py` answers what concerns a link (message requests and intervals), hands the rest here, and
writes the COMMAND_ACK. Nobody else writes acks. What takes its time (a gripper, a calibration that is cancelled) is
answered at once, and again by `answer_later`.
"""

import math
from collections.abc import Iterable
from typing import Final, NamedTuple, Protocol

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Note
from sitl_emu.autopilot.topics import CommandRecord, CommandTold, Topics, VehicleCommand, VehicleCommandAck

TOLD_KEPT = 32
GIVEN_KEPT = 8
MAV_RESULT_ACCEPTED = 0
MAV_RESULT_TEMPORARILY_REJECTED = 1
MAV_RESULT_DENIED = 2
MAV_RESULT_UNSUPPORTED = 3
MAV_RESULT_FAILED = 4
MAV_RESULT_IN_PROGRESS: Final = 5


class CommandResult(NamedTuple):
    """What COMMAND_ACK says; `result` is a MAV_RESULT. None instead of one: no ack at all."""

    result: int
    progress: int = 0
    result_param2: int = 0


class CommandOwner(Protocol):
    """A module that decides on some commands."""

    @property
    def COMMANDS(self) -> frozenset[int]:  # noqa: N802, as the constant that it is in most of them
        """Their numbers."""
        ...

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide, act, and say the result; None gives no ack."""
        ...


def obey_navigator(owner: CommandOwner, now_us: int, topics: Topics, seen: int) -> int:
    """Let an owner act on its commands among the navigator's after number `seen`; the number of the newest of all."""
    records = topics.navigator_commands
    if not records or records[-1].number == seen:
        return seen
    for record in records:
        if record.number > seen and record.command.command in owner.COMMANDS:
            result = owner.handle_command(now_us, record.command)
            if result is not None:
                tell(topics, now_us, record.command, result)
    return records[-1].number


def give_inside(topics: Topics, now_us: int, command: VehicleCommand) -> None:
    """Give a command to the autopilot's own modules, on no link."""
    records = topics.navigator_commands
    number = records[-1].number + 1 if records else 1
    topics.navigator_commands = (*records[1 - GIVEN_KEPT :], CommandRecord(number, now_us, command))


def nearest(value: float) -> int:
    """As lroundf reads a parameter: the nearest whole number, halves away from zero; 0 for what is none."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value)) if math.isfinite(value) else 0


def tell(
    topics: Topics,
    now_us: int,
    command: VehicleCommand,
    result: CommandResult | None = None,
    from_outside: bool = False,
) -> None:
    """Tell the log of a command, or of the answer to one."""
    told = topics.commands_told
    number = told[-1].number + 1 if told else 1
    topics.commands_told = (*told[1 - TOLD_KEPT :], CommandTold(number, now_us, command, result, from_outside))


def answer_later(topics: Topics, command: VehicleCommand, result: CommandResult) -> None:
    """Answer a command once more, after `handle_command` has returned its first answer, or none."""
    topics.vehicle_command_acks = (*topics.vehicle_command_acks, VehicleCommandAck(command, *result))


class VehicleCommands:
    """The table from MAV_CMD to its owner."""

    def __init__(self, owners: Iterable[CommandOwner], note: Note = lambda severity, line: None) -> None:
        """`note` writes into the log."""
        self._note = note
        self.owners: dict[int, CommandOwner] = {number: owner for owner in owners for number in owner.COMMANDS}

    def handle(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Let the owner decide; a command without an owner is UNSUPPORTED, which PX4's commander says in the log."""
        owner = self.owners.get(command.command)
        if owner is None:
            self._note(Severity.WARNING, f"[commander] command {command.command} unsupported")
            return CommandResult(MAV_RESULT_UNSUPPORTED)
        return owner.handle_command(now_us, command)
