"""Channels as if from a radio-control receiver, streamed until they are let go.

Source: https://mavlink.io/en/messages/common.html#RC_CHANNELS_OVERRIDE: up to 18 channels in µs. UINT16_MAX leaves a
channel as it is; 0 lets one of the first eight go, UINT16_MAX - 1 one of the others. (PX4 counts no channel behind the
last that is set.)
"""

from collections.abc import Mapping

from sitl_emu.core import dialect as mavlink

PERIOD_US = 50_000
CHANNELS = 18
FIRST_CHANNELS = 8
IGNORED = 65535
LET_GO_FIRST, LET_GO = 0, 65534


class RcOverride:
    """Streams `channels` (number from 1: µs), which may be replaced at any time, until it is stopped."""

    def __init__(self, system: int, channels: Mapping[int, int], component: int = 1) -> None:
        """Raises ValueError for a channel that does not exist."""
        self.target = (system, component)
        self.channels = channels
        self.done = False
        self._stopping = False
        self._due_us: int | None = None
        wrong = [number for number in channels if not 1 <= number <= CHANNELS]
        if wrong:
            raise ValueError(f"radio channel {wrong[0]}; there are 1 to {CHANNELS}")

    def stop(self) -> None:
        """Lets the channels go, with one more message."""
        self._stopping = True

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Nobody answers."""
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The channels when they are due."""
        if self.done:
            return []
        if self._stopping:
            self.done = True
            return [self._message(dict.fromkeys(self.channels))]
        if self._due_us is not None and now_us < self._due_us:
            return []
        self._due_us = now_us + PERIOD_US
        return [self._message(self.channels)]

    def _message(self, channels: Mapping[int, int | None]) -> mavlink.MAVLink_message:
        values = [IGNORED] * CHANNELS
        for number, value in channels.items():
            let_go = LET_GO_FIRST if number <= FIRST_CHANNELS else LET_GO
            values[number - 1] = let_go if value is None else value
        return mavlink.MAVLink_rc_channels_override_message(*self.target, *values)
