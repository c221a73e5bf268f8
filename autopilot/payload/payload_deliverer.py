"""The gripper: opens and closes on MAV_CMD_DO_GRIPPER, in PD_GRIPPER_TO seconds.

PX4's payload_deliverer (src/modules/payload_deliverer, v1.18): it closes when the autopilot starts. An action is
answered IN_PROGRESS and, when its time is over, ACCEPTED; asked for again meanwhile it is rejected, and once it is done
accepted at once. Another action cancels it: who asked for it is answered CANCELLED first. It looks for time that is
over ten times a second, and when it is commanded. PD_GRIPPER_TYPE -1: there is none; parameters count that are there
when it first has one. A winch nobody answers for. A mission's items come as topics.navigator_commands; the mission
looks for no answer. What the module commands itself names nobody, and goes out on every link, as do its answers.
"""

from typing import ClassVar

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later, obey_navigator, tell
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Gripper, Topics, VehicleCommand
from sitl_emu.core import c_types
from sitl_emu.core import dialect as mavlink

RELEASE: int = mavlink.GRIPPER_ACTION_RELEASE
GRAB: int = mavlink.GRIPPER_ACTION_GRAB
NO_GRIPPER = -1
UNKNOWN_PROGRESS = 255
RUN_US = 100_000
"""PayloadDeliverer::init."""


class PayloadDeliverer:
    """Owner of DO_GRIPPER; writer of gripper."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.PAYLOAD_DELIVERER)

    def __init__(self, topics: Topics, parameters: Parameters, outgoing: OutgoingCommands) -> None:
        self._topics = topics
        self._parameters = parameters
        self._outgoing = outgoing
        self.action = GRAB
        """What the gripper did last, or is doing."""
        self._done = False
        self._since_us = 0
        self._asked: VehicleCommand | None = None
        """The command that is being done."""
        self._own: VehicleCommand | None = None
        """The last one that it gave itself."""
        self._commands_seen = 0
        self._due_us = 0
        self._timeout_us: float | None = None
        """How long an action takes; None: there is no gripper."""
        self._is_new = False
        """Whether it has not closed yet."""
        self._configure()

    @property
    def state(self) -> str:
        """PX4's name for it (Gripper::get_state_str)."""
        if self.action == GRAB:
            return "GRABBED" if self._done else "GRABBING"
        return "RELEASED" if self._done else "RELEASING"

    def command_itself(self, now_us: int, action: int) -> None:
        """A GRIPPER_ACTION, as of send_gripper_vehicle_command, which leaves out whom it is for and whose it is."""
        self._own = own = VehicleCommand(
            mavlink.MAV_CMD_DO_GRIPPER, 0.0, float(action), 0.0, 0.0, 0.0, 0.0, 0.0, from_external=False
        )
        self._outgoing.give(own)
        result = self.handle_command(now_us, own)
        if result is not None:
            self._answer(now_us, own, result)

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """DO_GRIPPER: param2 is the GRIPPER_ACTION; the gripper's number (param1) does not matter.

        None where another command is to be answered first: both answers are on their way then.
        """
        if self._timeout_us is None:
            return CommandResult(mavlink.MAV_RESULT_FAILED)
        self._end_action(now_us, self._timeout_us)
        action = c_types.rounded(command.param2)
        if self._asked is None:
            return self._act(now_us, command, action)
        if action == self.action:
            return CommandResult(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        self._answer(now_us, self._asked, CommandResult(mavlink.MAV_RESULT_CANCELLED))
        self._answer(now_us, command, self._act(now_us, command, action))
        return None

    def update(self, now_us: int) -> None:
        """At 50 Hz: what the mission commands; at 10 Hz: an action ends by its time, as there is no sensor."""
        if self._is_new:
            self._is_new = False
            self.command_itself(now_us, GRAB)
        self._commands_seen = obey_navigator(self, now_us, self._topics, self._commands_seen)
        if now_us < self._due_us:
            return
        self._due_us = now_us + RUN_US
        if self._timeout_us is None:
            self._configure()
        else:
            self._end_action(now_us, self._timeout_us)

    def _configure(self) -> None:
        """Takes the parameters, where they say that there is a gripper."""
        if int(self._parameters["PD_GRIPPER_TYPE"]) != NO_GRIPPER:
            self._timeout_us = float(self._parameters["PD_GRIPPER_TO"]) * 1e6
            self._is_new = True
            self._take_position()

    def _act(self, now_us: int, command: VehicleCommand, action: int) -> CommandResult:
        """Begin an action, if it is one that is not done already."""
        if action == self.action and self._done:
            return CommandResult(mavlink.MAV_RESULT_ACCEPTED)
        if action not in (RELEASE, GRAB):
            return CommandResult(mavlink.MAV_RESULT_DENIED)
        self.action, self._done, self._since_us, self._asked = action, False, now_us, command
        self._take_position()
        return CommandResult(mavlink.MAV_RESULT_IN_PROGRESS, UNKNOWN_PROGRESS)

    def _end_action(self, now_us: int, timeout_us: float) -> None:
        """When its time is over."""
        if self._asked is None or now_us - self._since_us < timeout_us:
            return
        self._answer(now_us, self._asked, CommandResult(mavlink.MAV_RESULT_ACCEPTED))
        self._done, self._asked = True, None

    def _answer(self, now_us: int, command: VehicleCommand, result: CommandResult) -> None:
        """To whoever gave a command; of a mission's only the log is told."""
        if command.from_external or command is self._own:
            answer_later(self._topics, command, result)
        else:
            tell(self._topics, now_us, command, result)

    def _take_position(self) -> None:
        self._topics.gripper = Gripper(1.0 if self.action == GRAB else -1.0)
