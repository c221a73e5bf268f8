"""TIMESYNC: answers other clocks with ours, and learns from their answers what their times are by our clock.

https://mavlink.io/en/services/timesync.html. As PX4 (mavlink_timesync.cpp, lib/timesync/Timesync.cpp), on each link by
itself: the stream of the same name asks, and after 500 answers that were there soon enough the times that components
state of what they have seen count, until then the moment in which it comes in.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import TimesyncStatus, Topics
from sitl_emu.core import dialect as mavlink

ALPHA_GAIN_INITIAL, ALPHA_GAIN_FINAL = 0.05, 0.003
BETA_GAIN_INITIAL, BETA_GAIN_FINAL = 0.05, 0.003
CONVERGENCE_WINDOW = 500
MAX_RTT_SAMPLE_US = 10_000
MAX_DEVIATION_SAMPLE_US = 100_000
MAX_CONSECUTIVE_HIGH_DEVIATION = 10
"""All of lib/timesync/Timesync.hpp."""
SLOTS = ("timesync_status", "timesync_status_1", "timesync_status_2")
"""Topics of the first links that answer; PX4 logs three."""


class TimeOffset:
    """What is to be added to the times of one link's other side to get ours (PX4's Timesync)."""

    def __init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self._sequence = self._high_deviation_count = 0
        self._offset_us = self._skew_us = 0.0

    @property
    def converged(self) -> bool:
        """Whether it has heard enough."""
        return self._sequence >= CONVERGENCE_WINDOW

    def sync_stamp(self, now_us: int, time_us: int) -> int:
        """Our time of what the other side says of its own; now, while nobody knows."""
        return time_us + int(self._offset_us) if self.converged else now_us

    def update(self, now_us: int, remote_us: int, originate_us: int) -> TimesyncStatus:
        """An answer: its sender's time, and ours when it was asked."""
        round_trip_us = now_us - originate_us
        offset_us = int((originate_us + now_us - 2 * remote_us) / 2)
        if 0 <= round_trip_us < MAX_RTT_SAMPLE_US:
            self._hear(offset_us)
        return TimesyncStatus(now_us, remote_us, offset_us, int(self._offset_us), round_trip_us)

    def _hear(self, offset_us: int) -> None:
        if self.converged and abs(int(self._offset_us) - offset_us) > MAX_DEVIATION_SAMPLE_US:
            self._high_deviation_count += 1
            if self._high_deviation_count > MAX_CONSECUTIVE_HIGH_DEVIATION:
                self._reset()
            return
        self._add_sample(offset_us)
        self._sequence += 1
        self._high_deviation_count = 0

    def _add_sample(self, offset_us: int) -> None:
        """Smoothed twice, so that it does not lag behind clocks that run apart."""
        if self._sequence == 0:
            self._offset_us = float(offset_us)
            return
        alpha, beta = self._gains()
        before_us = self._offset_us
        self._offset_us = alpha * offset_us + (1.0 - alpha) * (before_us + self._skew_us)
        self._skew_us = beta * (self._offset_us - before_us) + (1.0 - beta) * self._skew_us

    def _gains(self) -> tuple[float, float]:
        if self.converged:
            return ALPHA_GAIN_FINAL, BETA_GAIN_FINAL
        progress = self._sequence / CONVERGENCE_WINDOW
        done = 1.0 - math.exp(0.5 * (1.0 - 1.0 / (1.0 - progress)))
        return (
            done * ALPHA_GAIN_FINAL + (1.0 - done) * ALPHA_GAIN_INITIAL,
            done * BETA_GAIN_FINAL + (1.0 - done) * BETA_GAIN_INITIAL,
        )


class Timesync:
    """Echoes ts1 and adds our time, in ns; keeps the offset of each link."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_TIMESYNC})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`: timesync_status."""
        self._topics = topics
        self._offsets: dict[str, TimeOffset] = {}
        """By the name of the link."""

    def sync_stamp(self, now_us: int, link: Link, time_us: int) -> int:
        """Our time of what came in on a link with its sender's time."""
        offset = self._offsets.get(link.name)
        return now_us if offset is None else offset.sync_stamp(now_us, time_us)

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """tc1 0 is a question; the answer names who asked (MavlinkTimesync::handle_message)."""
        if message.tc1 == 0:
            asker = (message.get_srcSystem(), message.get_srcComponent())
            link.send_fields(mavlink.MAVLINK_MSG_ID_TIMESYNC, now_us * 1000, message.ts1, *asker)
        elif message.tc1 > 0:
            offset = self._offsets.setdefault(link.name, TimeOffset())
            status = offset.update(now_us, message.tc1 // 1000, message.ts1 // 1000)
            instance = list(self._offsets).index(link.name)
            if instance < len(SLOTS):
                setattr(self._topics, SLOTS[instance], status)

    def on_time(self, now_us: int) -> None:
        """Nothing to do: the stream of the same name asks."""
