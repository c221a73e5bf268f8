"""COM_THROW_EN: a multicopter that is armed in the hand and thrown; its motors start when it falls.

PX4's MulticopterThrowLaunch (src/modules/commander/MulticopterThrowLaunch, v1.18). Until then its outputs are locked
(actuator_armed.lockdown), it does not disarm itself, and its heartbeat looks like that of a terminated flight.
"""

import math
from enum import Enum, auto

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Note, SendEvent
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics


class State(Enum):
    """How far the throw is."""

    DISABLED = auto()
    """Also who was armed already when the parameter was set."""
    IDLE = auto()
    ARMED = auto()
    UNSAFE = auto()
    """Thrown, and still rising."""
    FLYING = auto()


class ThrowLaunch:
    """Watches for the throw, at the commander's rate."""

    def __init__(self, topics: Topics, parameters: Parameters, send_event: SendEvent, note: Note) -> None:
        self._topics, self._parameters = topics, parameters
        self._send_event, self._note = send_event, note
        self.state = State.DISABLED

    @property
    def in_progress(self) -> bool:
        """It is wanted, and does not fly yet."""
        return self.state not in (State.DISABLED, State.FLYING)

    def update(self, *, armed: bool) -> None:
        """One step at most; faster than COM_THROW_SPEED is thrown."""
        if not self._parameters["COM_THROW_EN"]:
            self.state = State.DISABLED
            return
        local = self._topics.vehicle_local_position
        if not armed and self.state is not State.IDLE:
            self._send_event("mc_throw_launch_not_ready", Severity.CRITICAL)
            self.state = State.IDLE
        if self.state is State.IDLE and armed:
            self._send_event("mc_throw_launch_ready", Severity.CRITICAL)
            self.state = State.ARMED
        elif self.state is State.ARMED:
            if math.hypot(local.vx, local.vy, local.vz) > self._parameters["COM_THROW_SPEED"]:
                self._note(Severity.INFO, "[commander] Throw detected, motors will start once falling")
                self.state = State.UNSAFE
        elif self.state is State.UNSAFE and local.vz > 0.0:
            self._note(Severity.INFO, "[commander] Throw and fall detected, starting motors")
            self.state = State.FLYING
