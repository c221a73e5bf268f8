"""Arming with somebody's leave: COM_ARM_AUTH_REQ makes the autopilot ask system COM_ARM_AUTH_ID before it arms.

PX4's ArmAuthorization (src/modules/commander/Arming/ArmAuthorization, v1.18). It gives ARM_AUTHORIZATION_REQUEST and
waits COM_ARM_AUTH_TO seconds for the COMMAND_ACK, of which result_param2 tells for how many seconds leave is given, or
what was wrong. By COM_ARM_AUTH_MET 0 the arming command itself is answered when that is known; by 1 it is rejected, and
to be repeated.
"""

from enum import Enum, auto
from typing import Final

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

ARM_AUTHORIZATION_REQUEST: int = mavlink.MAV_CMD_ARM_AUTHORIZATION_REQUEST
TWO_ARMING_REQUESTS: Final = 1
"""COM_ARM_AUTH_MET."""
DENIED_BECAUSE = {
    mavlink.MAV_ARM_AUTH_DENIED_REASON_INVALID_WAYPOINT: "Denied, waypoint {} have a invalid value",
    mavlink.MAV_ARM_AUTH_DENIED_REASON_TIMEOUT: "Denied by timeout in authorizer",
    mavlink.MAV_ARM_AUTH_DENIED_REASON_AIRSPACE_IN_USE: "Denied because airspace is in use",
    mavlink.MAV_ARM_AUTH_DENIED_REASON_BAD_WEATHER: "Denied because of bad weather",
}
"""Of COMMAND_ACK.progress; MAV_ARM_AUTH_DENIED_REASON_NONE: the authorizer tells it itself."""


class Leave(Enum):
    """Whether the vehicle may be armed."""

    GIVEN = auto()
    REFUSED = auto()
    AWAITED = auto()


class ArmAuthorization:
    """Asks, and keeps the answer for as long as it holds."""

    def __init__(self, parameters: Parameters, outgoing: OutgoingCommands, say: Say) -> None:
        self._parameters, self._outgoing, self._say = parameters, outgoing, say
        self._waits = self._given = False
        self._until_us = 0
        outgoing.on_answer[ARM_AUTHORIZATION_REQUEST] = self._on_answer

    @property
    def waits(self) -> bool:
        """An answer is awaited."""
        return self._waits

    @property
    def given(self) -> bool:
        """There is leave, as of the last look at the time."""
        return self._given

    def leave(self, now_us: int) -> Leave:
        """For who wants to arm now; asks if nobody has."""
        self.update(now_us)
        if not self._parameters["COM_ARM_AUTH_REQ"] or self._given:
            return Leave.GIVEN
        twice = int(self._parameters["COM_ARM_AUTH_MET"]) == TWO_ARMING_REQUESTS
        if self._waits:
            return Leave.REFUSED
        authorizer = int(self._parameters["COM_ARM_AUTH_ID"])
        request = VehicleCommand(ARM_AUTHORIZATION_REQUEST, *(0.0,) * 7, target_system=authorizer)
        self._outgoing.give(request)
        self._waits = True
        self._until_us = now_us + int(self._parameters["COM_ARM_AUTH_TO"] * 1e6)
        if twice:
            self._say(Severity.INFO, "Arm auth: Requesting authorization...")
        return Leave.REFUSED if twice else Leave.AWAITED

    def update(self, now_us: int) -> None:
        """Leave ends, and so does waiting."""
        if now_us <= self._until_us:
            return
        self._given = False
        if self._waits:
            self._waits = False
            self._say(Severity.CRITICAL, "Arm auth: No response")

    def _on_answer(self, now_us: int, ack: mavlink.MAVLink_message) -> None:
        to_me = ack.target_system == int(self._parameters["MAV_SYS_ID"])
        if not (self._waits and to_me) or ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            return
        self._waits = False
        if ack.result == mavlink.MAV_RESULT_ACCEPTED:
            self._given = True
            self._until_us = now_us + max(0, ack.result_param2) * 1_000_000
            self._say(Severity.INFO, f"Arm auth: Authorized for the next {ack.result_param2} seconds")
        elif ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            self._say(Severity.CRITICAL, "Arm auth: Temporarily rejected")
        elif ack.progress != mavlink.MAV_ARM_AUTH_DENIED_REASON_NONE:
            reason = DENIED_BECAUSE.get(ack.progress, "Denied").format(ack.result_param2)
            self._say(Severity.CRITICAL, f"Arm auth: {reason}")
