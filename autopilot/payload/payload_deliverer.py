"""The gripper: opens and closes on MAV_CMD_DO_GRIPPER, in PD_GRIPPER_TO seconds.

PX4's payload_deliverer (src/modules/payload_deliverer, v1.18): it closes when the autopilot starts. An action is
answered IN_PROGRESS and, when its time is over, ACCEPTED; asked for again meanwhile it is rejected, and once it is done
accepted at once. PD_GRIPPER_TYPE -1: there is none. A winch nobody answers for. A mission's items come as
topics.navigator_commands; the mission looks for no answer. What the module commands itself names nobody, and goes out
on every link, as do its answers.
"""

import math
from typing import ClassVar

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later, obey_navigator, tell
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Gripper, Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

RELEASE: int = mavlink.GRIPPER_ACTION_RELEASE
GRAB: int = mavlink.GRIPPER_ACTION_GRAB
NO_GRIPPER = -1
UNKNOWN_PROGRESS = 255


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
        self._own: VehicleCommand | None = None
        """The last one that it gave itself."""
        self._commands_seen = 0
        self._is_new = int(parameters["PD_GRIPPER_TYPE"]) != NO_GRIPPER
        if self._is_new:
            self._take_position()

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
        answer_later(self._topics, own, self.handle_command(now_us, own))

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """DO_GRIPPER: param2 is the GRIPPER_ACTION; the gripper's number (param1) does not matter."""
        if int(self._parameters["PD_GRIPPER_TYPE"]) == NO_GRIPPER:
            return CommandResult(mavlink.MAV_RESULT_FAILED)
        action = round(command.param2) if math.isfinite(command.param2) else None
        if self._asked is not None and action == self.action:
            return CommandResult(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        if action == self.action and self._done:
            return CommandResult(mavlink.MAV_RESULT_ACCEPTED)
        if action not in (RELEASE, GRAB):
            return CommandResult(mavlink.MAV_RESULT_DENIED)
        self.action, self._done, self._since_us, self._asked = action, False, now_us, command
        self._take_position()
        return CommandResult(mavlink.MAV_RESULT_IN_PROGRESS, UNKNOWN_PROGRESS)

    def update(self, now_us: int) -> None:
        """At 50 Hz: what the mission commands; an action ends by its time, as there is no sensor."""
        if self._is_new:
            self._is_new = False
            self.command_itself(now_us, GRAB)
        self._commands_seen = obey_navigator(self, now_us, self._topics, self._commands_seen)
        if self._done or now_us - self._since_us <= float(self._parameters["PD_GRIPPER_TO"]) * 1e6:
            return
        self._done = True
        if self._asked is not None:
            done = CommandResult(mavlink.MAV_RESULT_ACCEPTED)
            if self._asked.from_external or self._asked is self._own:
                answer_later(self._topics, self._asked, done)
            else:
                tell(self._topics, now_us, self._asked, done)
            self._asked = None

    def _take_position(self) -> None:
        self._topics.gripper = Gripper(1.0 if self.action == GRAB else -1.0)
