"""What every MAVLink component aboard has in common: who it is, its heartbeat, frames in and out, acks.

https://mavlink.io/en/services/heartbeat.html and command.html. A component sits at the far end of a wire of the
autopilot (autopilot/mavlink/wire.py), as a camera does on a serial port: bytes in by `on_datagram`, bytes out by
`outbox`. It knows nothing of the vehicle but what MAVLink tells it, so it would work beside a real PX4 as well.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing

HEARTBEAT_EVERY_US = 1_000_000
HEARTBEAT_PHASE_US = 960_000
"""Shortly before the autopilot's, which come at whole seconds: there are clients that take the last heartbeat of any
component for the vehicle's mode (MAVSDK's follow_me)."""
AUTOPILOT = 1
"""Component id of the autopilot."""
COMMANDS = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT})
MAVLINK_VERSION = 3
NEVER_US = 1 << 62
"""When something is due that is not."""


class Command(NamedTuple):
    """A COMMAND_LONG or COMMAND_INT: its parameters 1 to 4 mean the same in both, and no more are used here."""

    number: int
    params: tuple[float, float, float, float]
    source_system: int
    source_component: int
    addressed: bool
    """Sent to this very component, and not to all of them."""
    confirmation: int = 0
    """How often it was sent before, where who sends it counts: MAVSDK does not, and COMMAND_INT can't."""

    def whole(self, index: int) -> int:
        """Parameter `index` (1 to 4) as a whole number; 0 for one that is not given."""
        value = self.params[index - 1]
        return round(value) if math.isfinite(value) else 0


class Component:
    """A component's identity and its frames."""

    def __init__(self, system_id: int, component_id: int, mav_type: int) -> None:
        """`system_id` is the vehicle's; `mav_type` is the heartbeat's MAV_TYPE."""
        self.system_id, self.component_id = system_id, component_id
        self.outbox: list[bytes] = []
        self._encoder: Any = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._decoder: Any = mavlink.MAVLink(None)
        self._heartbeat = mavlink.MAVLink_heartbeat_message(
            mav_type, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, MAVLINK_VERSION
        )
        self._heartbeat_us = 0
        self._beats = self._beats_seen = 0
        self._silent_since_s = 0.0

    def send(self, message: Any) -> None:
        """Queue a message."""
        self.outbox.append(bytes(message.pack(self._encoder)))
        self._encoder.seq = (self._encoder.seq + 1) & 255

    def beat(self, now_us: int) -> int:
        """Send the heartbeat when it is due; when it will be due next."""
        if now_us >= self._heartbeat_us:
            self._heartbeat_us = now_us + HEARTBEAT_EVERY_US - (now_us - HEARTBEAT_PHASE_US) % HEARTBEAT_EVERY_US
            self._beats += 1
            self.send(self._heartbeat)
        return self._heartbeat_us

    def keep_alive(self, clock_s: float) -> None:
        """Send a heartbeat where there was none in the last second of a clock that simulated time has fallen behind.

        Whoever counts a component as lost (QGroundControl) looks at a clock. To be called as often as one likes.
        """
        if self._beats != self._beats_seen:
            self._beats_seen, self._silent_since_s = self._beats, clock_s
        elif clock_s - self._silent_since_s >= HEARTBEAT_EVERY_US * 1e-6:
            self._silent_since_s = clock_s
            self.send(self._heartbeat)

    def messages(self, data: bytes, wanted: frozenset[int]) -> Iterator[Any]:
        """The wanted messages of a datagram, decoded; nothing is spent on others, and garbage is skipped."""
        for frame in framing.split(data):
            if framing.message_id(frame) in wanted:
                try:
                    yield self._decoder.decode(bytearray(frame))
                except (mavlink.MAVError, ValueError, UnicodeError, IndexError):
                    continue

    def fields(self, data: bytes, message_id: int) -> Iterator[tuple[Any, ...]]:
        """The fields in wire order of each message of one kind in a datagram: for what comes often. CRC unchecked."""
        unpacker = mavlink.mavlink_map[message_id].unpacker
        for frame in framing.split(data):
            if frame[0] == framing.STX_V2 and framing.message_id(frame) == message_id:
                header, length = framing.HEADER_V2_BYTES, frame[1]
                yield unpacker.unpack(frame[header : header + length].ljust(unpacker.size, b"\0")[: unpacker.size])

    def command(self, message: Any) -> Command | None:
        """The command of a COMMAND_LONG or COMMAND_INT if it is for this component, or for all of this system."""
        if message.target_system not in (0, self.system_id) or message.target_component not in (0, self.component_id):
            return None
        params = (message.param1, message.param2, message.param3, message.param4)
        return Command(
            message.command,
            params,
            message.get_srcSystem(),
            message.get_srcComponent(),
            message.target_component == self.component_id,
            message.confirmation if message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_LONG else 0,
        )

    def acknowledge(self, command: Command, result: int) -> None:
        """COMMAND_ACK to whom the command came from."""
        self.send(
            mavlink.MAVLink_command_ack_message(
                command.number, result, 0, 0, command.source_system, command.source_component
            )
        )

    def ask_autopilot(self, message_id: int) -> None:
        """MAV_CMD_REQUEST_MESSAGE to the vehicle's autopilot."""
        self.send(
            mavlink.MAVLink_command_long_message(
                self.system_id, AUTOPILOT, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, message_id, 0, 0, 0, 0, 0, 0
            )
        )


def text(value: str, size: int) -> bytes:
    """A char[] field."""
    return value.encode("ascii", "replace")[:size]
