"""TIMESYNC: how far a component's clock is ahead of ours, and answers to those who ask the same of us.

Source: https://mavlink.io/en/services/timesync.html: `ts1` is the time of who asks, `tc1` that of who answers, both in
ns; a question has tc1 0. Half of the way there and back is taken for the way back, so the sample that took least time
is the best one: its offset counts.
"""

from collections import deque

from sitl_emu.core import dialect as mavlink

PERIOD_US = 200_000
SAMPLES = 32
"""Of the last six seconds, in which two quartz clocks drift apart by less than 1 ms."""


class Timesync:
    """Asks one component five times a second, for as long as it is told the time."""

    def __init__(self, system: int, component: int = 1) -> None:
        self.source = (system, component)
        self._samples: deque[tuple[int, int]] = deque(maxlen=SAMPLES)
        self._due_us: int | None = None

    @property
    def offset_us(self) -> int | None:
        """What is to be added to our time to get theirs; None before the first answer."""
        return min(self._samples)[1] if self._samples else None

    @property
    def round_trip_us(self) -> int | None:
        """There and back, of the best sample."""
        return min(self._samples)[0] if self._samples else None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Answers a question; takes an answer to ours."""
        if msg.get_type() != "TIMESYNC" or (msg.get_srcSystem(), msg.get_srcComponent()) != self.source:
            return []
        if msg.tc1 == 0:
            # An answer at time 0 would be a question again
            return [mavlink.MAVLink_timesync_message(max(1, now_us) * 1000, msg.ts1)]
        sent_us = msg.ts1 // 1000
        round_trip_us = now_us - sent_us
        if msg.ts1 % 1000 == 0 and 0 <= round_trip_us <= PERIOD_US * SAMPLES:
            self._samples.append((round_trip_us, msg.tc1 // 1000 - (sent_us + now_us) // 2))
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks when it is time to."""
        if self._due_us is not None and now_us < self._due_us:
            return []
        self._due_us = now_us + PERIOD_US
        return [mavlink.MAVLink_timesync_message(0, now_us * 1000)]
