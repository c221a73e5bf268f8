"""Log streaming: MAV_CMD_LOGGING_START and _STOP, the ULog in LOGGING_DATA (https://docs.px4.io/main/en/dev_log/logging).

PX4: mavlink_ulog.cpp, and its logger's loop, which reads commands one after the other. There is one stream, to whom
started it. Chunks that must be acknowledged go one by one, each again every 50 ms, 50 times; while the logger waits for
an acknowledgement it hears no command, so commands that come then are answered late, and a client that
acknowledges nothing holds the logger up for 2.5 s. File logging does not suffer from that here, as it does in PX4.
"""

import math
import struct
from collections import deque
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import (
    MAV_RESULT_ACCEPTED,
    MAV_RESULT_DENIED,
    MAV_RESULT_IN_PROGRESS,
    MAV_RESULT_TEMPORARILY_REJECTED,
    MAV_RESULT_UNSUPPORTED,
    CommandResult,
    answer_later,
    nearest,
    tell,
)
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.logger.log_stream import Chunk
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink import rates
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

LEAST_BYTES_PER_S: Final = 5000.0
"""A link with less gets no stream."""
ACK_TIMEOUT_US: Final = 50_000
ACK_MAX_TRIES: Final = 50
"""ulog_stream_ack.ACK_TIMEOUT and ACK_MAX_TRIES."""
COMMANDS_KEPT: Final = 8
"""Length of PX4's queue of vehicle_command."""
DATA = struct.Struct("<HBBBB249s")
"""LOGGING_DATA and LOGGING_DATA_ACKED in wire order: sequence, target, length, first_message_offset, data."""


class LogStreaming:
    """The stream, and who gets it."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_LOGGING_ACK})
    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.LOG_STREAMING)
    HAS_TIMER = True

    def __init__(self, topics: Topics, say: Say, logger: Logger | None) -> None:
        """`logger` None: PX4's logger does not run, so nobody answers."""
        self._topics, self._say = topics, say
        self._logger = logger
        self._link: Link | None = None
        """Where the stream goes; None: nowhere, whatever the logger does."""
        self._target = (0, 0)
        self._tries = 0
        self._resend_us = 0
        self._give_up_us = 0
        """When the logger stops waiting for the acknowledgement."""
        self._commands: deque[VehicleCommand] = deque(maxlen=COMMANDS_KEPT)
        """Commands that the waiting logger has not read."""

    # --- commands ------------------------------------------------------------------------------------------

    def handle_command(self, now_us: int, command: VehicleCommand, link: Link) -> CommandResult | None:
        """Decide, or let it wait for the logger. The log has what PX4 hands on (handle_message_command_both)."""
        logger = self._logger
        if command.command == mavlink.MAV_CMD_LOGGING_START:
            rate = rates.DATA_RATE_BYTES_PER_S.get(link.mode, math.inf)
            if rate < LEAST_BYTES_PER_S:
                text = "Not enough bandwidth to enable log streaming\t"
                self._say(Severity.CRITICAL, text, "mavlink_log_not_enough_bw", round(rate))
                return CommandResult(MAV_RESULT_DENIED)
            if logger is not None and logger.stream is None:
                self._link, self._target = link, (command.source_system, command.source_component)
        tell(self._topics, now_us, command)
        if logger is None or not logger.runs:
            return None
        if self._waits:
            self._commands.append(command)
            return None
        first, *more = self._decide(now_us, command, logger)
        for result in more:
            answer_later(self._topics, command, result)
        return first

    @property
    def _waits(self) -> bool:
        """Whether the logger waits for an acknowledgement."""
        return self._logger is not None and self._logger.stream is not None and self._logger.stream.blocked

    def _decide(self, now_us: int, command: VehicleCommand, logger: Logger) -> list[CommandResult]:
        if command.command == mavlink.MAV_CMD_LOGGING_STOP:
            if logger.stream is None:
                return [CommandResult(MAV_RESULT_ACCEPTED)]
            logger.end_stream()
            self._link = None
            return [CommandResult(MAV_RESULT_IN_PROGRESS), CommandResult(MAV_RESULT_ACCEPTED)]
        if nearest(command.param1) != 0:
            return [CommandResult(MAV_RESULT_UNSUPPORTED)]
        if not logger.can_stream:
            return [CommandResult(MAV_RESULT_TEMPORARILY_REJECTED)]
        logger.begin_stream(now_us)
        self._begin_chunk(now_us)
        return [CommandResult(MAV_RESULT_ACCEPTED)]

    def _read_commands(self, now_us: int) -> None:
        """The logger goes on: it reads what came meanwhile, until it has to wait again."""
        while self._commands and not self._waits and self._logger is not None:
            command = self._commands.popleft()
            for result in self._decide(now_us, command, self._logger):
                answer_later(self._topics, command, result)

    # --- the stream ----------------------------------------------------------------------------------------

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """LOGGING_ACK on the stream's link, whomever it is for: on to the next chunk (handle_message_logging_ack)."""
        if self._logger is None or link is not self._link:
            return
        stream = self._logger.stream
        if stream is None or not stream.reliable or stream.reliable[0].sequence != message.sequence:
            return
        stream.acknowledge()
        if stream.blocked:
            self._begin_chunk(now_us)
        else:
            self._read_commands(now_us)

    def on_time(self, now_us: int) -> None:
        """Send what is ready; again what is not acknowledged; give up."""
        logger = self._logger
        if logger is None or (stream := logger.stream) is None:
            return
        if not stream.blocked:
            while stream.ready:
                self._send(stream.ready.popleft())
            return
        if now_us >= self._give_up_us:
            logger.end_stream()
            self._link = None
            self._read_commands(now_us)
        elif now_us >= self._resend_us:
            self._resend_us += ACK_TIMEOUT_US
            self._tries += 1
            if self._tries <= ACK_MAX_TRIES:
                self._send(stream.reliable[0])

    def _begin_chunk(self, now_us: int) -> None:
        """The logger publishes a chunk and waits for its acknowledgement."""
        assert self._logger is not None and self._logger.stream is not None
        self._tries, self._resend_us = 1, now_us + ACK_TIMEOUT_US
        self._give_up_us = now_us + ACK_TIMEOUT_US * ACK_MAX_TRIES
        self._send(self._logger.stream.reliable[0])

    def _send(self, chunk: Chunk) -> None:
        link = self._link
        if link is None:
            return
        message_id = mavlink.MAVLINK_MSG_ID_LOGGING_DATA
        if chunk.reliable:
            message_id = mavlink.MAVLINK_MSG_ID_LOGGING_DATA_ACKED
        head = (chunk.sequence, *self._target, len(chunk.data), chunk.first_message_offset)
        link.send_payload(link.codec(message_id), DATA.pack(*head, chunk.data))
