"""Commands that the autopilot gives to other components, waiting for the links to send them.

PX4: vehicle_command with from_external false, which the MAVLink module sends as COMMAND_LONG
(streams/COMMAND_LONG.hpp).
"""

from collections.abc import Callable
from typing import Any

from sitl_emu.autopilot.topics import VehicleCommand

KEPT = 32


class OutgoingCommands:
    """What waits; any module may give a command, `mavlink/services/command_sender.py` takes them."""

    def __init__(self) -> None:
        self.waiting: list[VehicleCommand] = []
        self.on_answer: dict[int, Callable[[int, Any], None]] = {}
        """Who wants the COMMAND_ACKs of a command: called with the time and the message."""

    def give(self, command: VehicleCommand) -> None:
        """Queue a command for the component that its target names; too many are dropped."""
        if len(self.waiting) < KEPT:
            self.waiting.append(command)
