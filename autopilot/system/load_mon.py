"""How busy the computer is (PX4: src/modules/load_mon), for SYS_STATUS.load, the log and `listener cpuload`.

As PX4 on Linux does: the load is the processor time of this process against the clock, twice a second (an equal part of
it where autopilots share a process); the memory is the whole computer's. Whoever has a clock measures
(sitl_emu/run/pacing.py). In a run whose logs have to repeat nobody does: then there is no cpuload, and SYS_STATUS
tells 0.
"""

from sitl_emu.autopilot.topics import CpuLoad, Topics

INTERVAL_US = 500_000
MEMINFO = ("MemTotal", "MemFree", "Cached", "SReclaimable", "Buffers")


class LoadMon:
    """Writer of cpuload."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._last: tuple[float, float] | None = None
        self.due_us = 0
        """When it wants to be told again, in simulated time."""

    def measured(self, now_us: int, clock_s: float, processor_s: float, ram_usage: float) -> None:
        """What a clock says, and how much processor time this process has had so far; `ram_usage` is a share of 1."""
        self.due_us = now_us + INTERVAL_US
        if self._last is not None:
            elapsed_s, spent_s = clock_s - self._last[0], processor_s - self._last[1]
            load = spent_s / elapsed_s if elapsed_s > 0.0 else 0.0
            self._topics.cpuload = CpuLoad(now_us, min(max(load, 0.0), 1.0), ram_usage)
        self._last = clock_s, processor_s


def ram_usage(meminfo: str) -> float:
    """Share of the computer's memory that is in use, of the text of /proc/meminfo; as free(1) counts it."""
    rows = (line.partition(":") for line in meminfo.splitlines())
    kib = {name: int(rest.split()[0]) for name, _, rest in rows if name in MEMINFO}
    total, free, *caches = (kib.get(name, 0) for name in MEMINFO)
    used = total - free - sum(caches)
    return (used if used >= 0 else total - free) / max(total, 1)
