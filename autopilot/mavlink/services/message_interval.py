"""SET_MESSAGE_INTERVAL, GET_MESSAGE_INTERVAL: change and ask the rate of a stream on the link of the command.

As measured on PX4 v1.18 (interval/set/*) and in its MavlinkReceiver::set_message_interval: a negative interval stops a
stream, 0 (or NaN) goes back to the link mode's default, message 0 is refused, a message without a stream FAILs,
and so does a command with parameters that PX4 does not know (3, 4, and 7: where to send the answer). An interval goes
by way of a rate in float32, which makes some a microsecond shorter. What is stopped that never ran is there from then
on, without an interval (Mavlink::configure_stream), as what was requested once. REQUEST_DATA_STREAM has no effect.
"""

import math
from collections.abc import Callable
from typing import ClassVar

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_ACCEPTED, MAV_RESULT_FAILED, CommandResult
from sitl_emu.autopilot.mavlink import rates, silent_streams
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.stream import Stream
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, truncated

GET_MESSAGE_INTERVAL: int = mavlink.MAV_CMD_GET_MESSAGE_INTERVAL
STOPPED = -1
DEFAULT = REQUESTED = 0
SMALLEST_INTERVAL_US = 1e-5
SMALLEST_HZ = 1e-6
NOT_CONFIGURABLE = frozenset({mavlink.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE, mavlink.MAVLINK_MSG_ID_MISSION_CURRENT})
"""Sent by services in PX4, so that there is no stream to configure or to ask of."""


class MessageInterval:
    """Decides on the two commands."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.MESSAGE_INTERVAL)

    def __init__(self, stream: Callable[[str], Stream | None]) -> None:
        """`stream` finds a stream by message name."""
        self._stream = stream

    def handle_command(self, now_us: int, command: VehicleCommand, link: Link) -> CommandResult:
        """param1 is the message id, param2 the interval in µs."""
        message_id = message_id_of(command.param1)
        if command.command == GET_MESSAGE_INTERVAL:
            send_interval(link, message_id)
            return CommandResult(MAV_RESULT_ACCEPTED)
        known = not any(map(_is_set, (command.param3, command.param4, command.param7)))
        accepted = known and message_id != 0 and self.set(now_us, message_id, _interval_us(command.param2), link)
        return CommandResult(MAV_RESULT_ACCEPTED if accepted else MAV_RESULT_FAILED)

    def set(self, now_us: int, message_id: int, interval_us: int, link: Link) -> bool:
        """Send a message every `interval_us` on a link (0: default, -1: never); whether it can be configured.

        Another negative one, of an interval that no int32 holds (36 minutes), sends whatever is new, as in PX4 on x86.
        Of the number 16 bits count (get_stream_name), so that 65536 is HEARTBEAT, which 0 is not.
        """
        message_id &= 0xFFFF
        if message_id == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            was_there = link.statustext_interval_us != STOPPED
            link.statustext_interval_us = interval_us if interval_us > 0 else STOPPED if was_there else REQUESTED
            return True
        table = mavlink.mavlink_map.get(message_id)
        name = "" if table is None else table.msgname
        stream, silent = self._stream(name), name in silent_streams.SILENT
        if message_id in NOT_CONFIGURABLE or (stream is None and not silent):
            return False
        was_there = message_id in link.requested_once or link.interval_us(message_id) is not None
        link.requested_once.discard(message_id)
        if interval_us == DEFAULT:
            silent_hz = silent_streams.RATES.get(link.mode, {}).get(name)
            hz = silent_hz if silent else rates.default_hz(link.mode, name)
            interval_us = STOPPED if hz is None else rates.interval_us(hz)
        if not was_there and stream is not None:
            stream.begin(now_us, link)
        if interval_us == STOPPED and not was_there:
            link.requested_once.add(message_id)
        if stream is None:
            link.silent_intervals_us.pop(message_id, None)
            if interval_us != STOPPED:
                link.silent_intervals_us[message_id] = interval_us
        elif interval_us == STOPPED:
            link.unschedule(message_id)
        else:
            link.schedule(now_us, stream, interval_us)
        return True


def message_id_of(value: float) -> int:
    """The message that a parameter names, cut off as C does: half a message more than -1 is message 0."""
    return truncated(float32(value + 0.5))


def _is_set(value: float) -> bool:
    return math.isfinite(value) and int(value + 0.5) != 0


def _interval_us(value: float) -> int:
    """DEFAULT, STOPPED, or µs. Above 1e12 PX4's rate is too small to be one, below 1 no interval is left: both stop."""
    if math.isnan(value) or abs(value) <= SMALLEST_INTERVAL_US:
        return DEFAULT
    hz = float32(1e6 / value)
    return rates.interval_us(hz) or STOPPED if hz > SMALLEST_HZ else STOPPED


def send_interval(link: Link, message_id: int) -> None:
    """Send MESSAGE_INTERVAL: the stream's interval, -1 if it is off or unlimited, 0 if it is there and does not run."""
    interval_us = None if message_id in NOT_CONFIGURABLE else link.interval_us(message_id) or None
    if message_id == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
        interval_us = link.statustext_interval_us
    if interval_us is None:
        interval_us = REQUESTED if message_id in link.requested_once else STOPPED
    link.send_fields(mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL, interval_us, message_id & 0xFFFF)
