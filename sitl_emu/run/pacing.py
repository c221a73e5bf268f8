"""The clock of what flies in real time: what the date is, how fast simulated time may go, how busy the machine is.

Time is simulated: it comes with HIL_SENSOR. The wall clock merely holds it back to the speed that was asked for.
"""

import math
import time
from pathlib import Path

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.system.load_mon import ram_usage

TICK_S = 0.004
MEMINFO = Path("/proc/meminfo")
TICKS_A_WAKING = 2
"""Ticks that are made one right after the other: waking up with cold caches costs a process more than a tick does."""
MAX_LAG_S = 0.25
"""A process that fell further behind than this (a suspended laptop, say) does not hurry to catch up."""


def clock_s() -> float:
    """Seconds of a clock that never goes back, since some moment."""
    return time.monotonic()


def unix_time_us() -> int:
    """The date, which SYSTEM_TIME and others tell; a real vehicle has it from its GNSS receiver."""
    return time.time_ns() // 1000


class Pacer:
    """Holds simulated time back to `speed` times the wall clock; inf lets it run."""

    def __init__(self, speed: float) -> None:
        self._waking_wall_s = TICKS_A_WAKING * TICK_S / speed if math.isfinite(speed) else 0.0
        self._due_s = time.monotonic()
        self._ticks_left = TICKS_A_WAKING

    def start(self) -> None:
        """Count from now."""
        self._due_s = time.monotonic()

    def next_tick(self) -> bool:
        """One tick was made; whether it is time to wait for the next."""
        self._ticks_left -= 1
        if self._ticks_left:
            return False
        self._ticks_left = TICKS_A_WAKING
        self._due_s += self._waking_wall_s
        return True

    def remaining_s(self) -> float:
        """Wall time until the next ticks are due; never positive when running free."""
        left = self._due_s - time.monotonic()
        if left < -MAX_LAG_S:
            self._due_s -= left
        return left


def measure_load(autopilot: Autopilot, mates: int = 1) -> None:
    """Tell the autopilot how busy it keeps the computer, when it wants to know.

    `mates` autopilots share the process; each counts for an equal part of it.
    """
    if autopilot.now_us >= autopilot.load_mon.due_us:
        memory = ram_usage(MEMINFO.read_text())
        autopilot.load_mon.measured(autopilot.now_us, time.monotonic(), time.process_time() / mates, memory)
