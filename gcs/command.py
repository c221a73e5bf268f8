"""A command, sent until it is acknowledged.

Source: https://mavlink.io/en/services/command.html: a lost COMMAND_LONG is sent again with `confirmation` counted up;
COMMAND_ACK with IN_PROGRESS puts the limit off; the ack comes from the component that was asked. MAVLink leaves times
and tries to the client: here 0.5 s for each try, as MAVSDK has it, and 10 tries. One command of a kind at a time per
target.

A temporary rejection of a command that was sent more than once may be of the repetition: who carries the first out
refuses the second for that, as PX4's payload_deliverer does (payload_deliverer.cpp), and the ack that said so was lost.
It is asked again then, as often as where no answer comes.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink

TIMEOUT_US = 500_000
TRIES = 10
PROGRESS_TIMEOUT_US = 10_000_000

COMPONENT_ARM_DISARM = 400
NAV_RETURN_TO_LAUNCH = 20
DO_REPOSITION = 192
DO_GRIPPER = 211
PREFLIGHT_CALIBRATION = 241
GRIPPER_RELEASE, GRIPPER_GRAB = 0, 1
REPOSITION_CHANGE_MODE = 1
FRAME_GLOBAL = 0
FRAME_GLOBAL_RELATIVE_ALT = 3

RESULTS = {
    0: "accepted",
    1: "temporarily rejected",
    2: "denied",
    3: "unsupported",
    4: "failed",
    5: "in progress",
    6: "cancelled",
    7: "only COMMAND_LONG is accepted",
    8: "only COMMAND_INT is accepted",
    9: "unsupported frame",
    10: "not in control",
}
NOT_BEGUN = (2, 3, 4, 7, 8, 9, 10)
"""Results with which nothing has begun. Failed (4) is what PX4 answers where no gripper is set up."""


class CommandOutcome(NamedTuple):
    """How a command ended. `result` is the MAV_RESULT, None when nobody answered."""

    accepted: bool
    result: int | None
    text: str


class Command:
    """One COMMAND_LONG, or COMMAND_INT when it was given a place, until its COMMAND_ACK."""

    def __init__(
        self,
        target_system: int,
        target_component: int,
        command: int,
        params: Sequence[float] = (),
        place: tuple[int, int, float] | None = None,
        frame: int = FRAME_GLOBAL,
        timeout_us: int = TIMEOUT_US,
        tries: int = TRIES,
    ) -> None:
        """`params`: param1 on, missing ones are 0. `place`: (lat, lon in 1e-7 deg, altitude in m of `frame`)."""
        self.target_system, self.target_component = target_system, target_component
        self.command = command
        self.params = (*params, *(0.0,) * 7)[: 4 if place else 7]
        self.place, self.frame = place, frame
        self.timeout_us, self.tries = timeout_us, tries
        self.sent = 0
        self.progress: int | None = None
        self.outcome: CommandOutcome | None = None
        self._is_rejected = False
        self._due_us: int | None = None

    @property
    def done(self) -> bool:
        """True when it was answered or given up."""
        return self.outcome is not None

    @property
    def may_have_begun(self) -> bool:
        """Whether what was asked may have begun: it was sent, and not answered that it is not done."""
        return bool(self.sent) and (self.outcome is None or self.outcome.result not in NOT_BEGUN)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the COMMAND_ACK of the component that was asked."""
        if (
            self.outcome is None
            and self.sent
            and msg.get_type() == "COMMAND_ACK"
            and msg.command == self.command
            and msg.get_srcSystem() == self.target_system
            and self.target_component in (0, msg.get_srcComponent())
        ):
            result: int = msg.result
            if result == mavlink.MAV_RESULT_IN_PROGRESS:
                self.progress = msg.progress
                self._due_us = now_us + PROGRESS_TIMEOUT_US
            elif result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED and self.sent > 1:
                self._is_rejected = True
            else:
                text = RESULTS.get(result, f"result {result}")
                self.outcome = CommandOutcome(result == mavlink.MAV_RESULT_ACCEPTED, result, text)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends the command, again after each time limit."""
        if self.outcome is not None or (self._due_us is not None and now_us < self._due_us):
            return []
        if self.sent >= self.tries:
            result = mavlink.MAV_RESULT_TEMPORARILY_REJECTED if self._is_rejected else None
            text = f"no answer to {self.tries} tries" if result is None else RESULTS[result]
            self.outcome = CommandOutcome(False, result, text)
            return []
        self._due_us = now_us + self.timeout_us
        self.sent += 1
        return [self._message()]

    def _message(self) -> mavlink.MAVLink_message:
        target = (self.target_system, self.target_component)
        if self.place:
            fields: list[Any] = [*target, self.frame, self.command, 0, 0, *self.params, *self.place]
            return mavlink.MAVLink_command_int_message(*fields)
        return mavlink.MAVLink_command_long_message(*target, self.command, self.sent - 1, *self.params)


def arm(system: int, tries: int = TRIES) -> Command:
    """Arms an autopilot."""
    return Command(system, 1, COMPONENT_ARM_DISARM, (1,), tries=tries)


def disarm(system: int) -> Command:
    """Disarms an autopilot; refused in the air."""
    return Command(system, 1, COMPONENT_ARM_DISARM, (0,))


def reposition(system: int, lat_deg: float, lon_deg: float, alt_amsl_m: float, speed_m_s: float = -1.0) -> Command:
    """Sends a vehicle to a place in Hold; heading, and a speed of -1, as the autopilot likes."""
    place = (round(lat_deg * 1e7), round(lon_deg * 1e7), alt_amsl_m)
    return Command(system, 1, DO_REPOSITION, (speed_m_s, REPOSITION_CHANGE_MODE, 0, math.nan), place)


def gripper(system: int, *, open_it: bool) -> Command:
    """Opens or closes the gripper."""
    return Command(system, 1, DO_GRIPPER, (1, GRIPPER_RELEASE if open_it else GRIPPER_GRAB))
