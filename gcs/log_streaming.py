"""Log streaming's client half: a ULog that an autopilot sends while it is written.

Source: https://docs.px4.io/main/en/dev_log/logging (log streaming) and
https://mavlink.io/en/messages/common.html#LOGGING_DATA. The chunks that a log can't be read without are acknowledged;
of the others some may be lost. Then the ULog message that was cut is left out, the log goes on with the next whole
one, and a dropout message says how long the gap was.
"""

import struct

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command

LOGGING_START, LOGGING_STOP = 2510, 2511
NO_MESSAGE_BEGINS = 255
"""LOGGING_DATA.first_message_offset of a chunk in which no ULog message begins."""
FILE_HEADER_BYTES = 16
MESSAGE_HEADER = struct.Struct("<HB")
SILENCE_US = 5_000_000
"""Without any chunk for so long, a stream has ended."""


class LogStreaming:
    """Starts a stream and puts it together; `log` is what there is so far, in whole messages."""

    def __init__(self, target_system: int, target_component: int = 1) -> None:
        self.target = (target_system, target_component)
        self.log = bytearray()
        self.done = False
        """The autopilot refused, fell silent, or was told to stop and has."""
        self.dropouts = 0
        self.refusal = ""
        """Why there is no stream, in words."""
        self._command = Command(target_system, target_component, LOGGING_START)
        self._stopping = False
        self._sequence: int | None = None
        """Of the last chunk."""
        self._heard_us = 0
        self._rest = bytearray()
        """The beginning of a message whose end has not come."""
        self._lost = False

    def stop(self) -> None:
        """End the stream."""
        if not self._stopping:
            self._stopping = True
            self._command = Command(*self.target, LOGGING_STOP)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears chunks, acknowledges those that want it, and hears the answers to the commands."""
        if self.done or msg.get_srcSystem() != self.target[0]:
            return []
        name = msg.get_type()
        if name == "COMMAND_ACK":
            self._command.on_message(now_us, msg)
        elif name in ("LOGGING_DATA", "LOGGING_DATA_ACKED"):
            self._on_chunk(now_us, msg)
            if name == "LOGGING_DATA_ACKED":
                return [mavlink.MAVLink_logging_ack_message(*self.target, msg.sequence)]
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends the commands; ends when nothing comes any more."""
        if self.done:
            return []
        started = self._sequence is not None
        if not self._command.done and (self._stopping or not started):
            return self._command.on_time(now_us)
        outcome = self._command.outcome
        if self._stopping:
            self.done = True
        elif not started and outcome is not None and not outcome.accepted:
            self.refusal, self.done = outcome.text, True
        elif started and now_us - self._heard_us > SILENCE_US:
            self.done = True
        return []

    def _on_chunk(self, now_us: int, msg: mavlink.MAVLink_message) -> None:
        data, begin = bytes(msg.data[: msg.length]), msg.first_message_offset
        if self._sequence is None:
            if msg.sequence != 0:
                return
        else:
            steps = (msg.sequence - self._sequence) & 0xFFFF
            if steps == 0 or steps >= 0x8000:
                return  # it came before
            if steps > 1 and not self._lost:
                self._lost = True
                self._rest.clear()
        self._sequence, gap_us = msg.sequence, now_us - self._heard_us
        self._heard_us = now_us
        if self._lost:
            if begin == NO_MESSAGE_BEGINS or begin > len(data):
                return
            self._lost = False
            self.dropouts += 1
            self.log += MESSAGE_HEADER.pack(2, ord("O")) + struct.pack("<H", min(max(gap_us // 1000, 1), 0xFFFF))
            data = data[begin:]
        self._rest += data
        self._take_whole_messages()

    def _take_whole_messages(self) -> None:
        rest, end = self._rest, 0
        if not self.log:
            if len(rest) < FILE_HEADER_BYTES:
                return
            end = FILE_HEADER_BYTES
        while end + MESSAGE_HEADER.size <= len(rest):
            size = MESSAGE_HEADER.size + MESSAGE_HEADER.unpack_from(rest, end)[0]
            if end + size > len(rest):
                break
            end += size
        self.log += rest[:end]
        del rest[:end]
