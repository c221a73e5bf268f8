"""The vehicle_command service (PX4: src/modules/uxrce_dds_client/vehicle_command_srv.cpp).

A request is a command as /fmu/in/vehicle_command brings it, and its reply the first answer to a command of that number.
As in PX4 one request is waited for at a time, the newest; one for another system is not answered, and no one else's
command of the same number is told from it.
"""

from typing import Final

from sitl_emu.autopilot.topics import CommandTold, Topics

ASKED_BYTES: Final = 16
"""What DDS's side puts before a request to know who asked, and finds again before its reply."""


class VehicleCommandSrv:
    """The service's state: who waits for which answer."""

    def __init__(self, topics: Topics) -> None:
        """`topics.commands_told` has the answers."""
        self._topics = topics
        self._asked, self._command, self._after = b"", 0, 0

    def on_request(self, asked: bytes, command: int) -> None:
        """A command is about to be given; `asked`: who asks."""
        self._asked, self._command = asked, command
        self._after = max((each.number for each in self._topics.commands_told), default=0)

    def answered(self, told: CommandTold) -> bytes | None:
        """Whether an answer is the one that is waited for: who asked, who waits no longer; None where it is not."""
        if not self._asked or told.result is None or told.number <= self._after:
            return None
        if told.command.command != self._command:
            return None
        asked, self._asked = self._asked, b""
        return asked
