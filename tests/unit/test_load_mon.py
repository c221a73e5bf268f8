"""How busy the computer is: what a clock and the processor's time make of it."""

import pytest

from sitl_emu.autopilot.system.load_mon import LoadMon, ram_usage
from sitl_emu.autopilot.topics import CpuLoad, Topics

MEMINFO = """MemTotal:        1000 kB
MemFree:          400 kB
MemAvailable:     900 kB
Buffers:           50 kB
Cached:           150 kB
SwapCached:        70 kB
SReclaimable:     100 kB
"""


def test_the_load_is_the_processor_time_of_each_half_second() -> None:
    topics = Topics()
    monitor = LoadMon(topics)
    monitor.measured(0, 100.0, 7.0, 0.3)
    assert topics.cpuload == CpuLoad()
    monitor.measured(500_000, 100.5, 7.1, 0.3)
    assert topics.cpuload == pytest.approx((500_000, 0.2, 0.3))
    assert monitor.due_us == 1_000_000
    monitor.measured(1_000_000, 101.0, 9.0, 0.4)
    assert topics.cpuload == (1_000_000, 1.0, 0.4)
    monitor.measured(1_500_000, 101.0, 9.0, 0.4)
    assert topics.cpuload.load == 0.0


def test_memory_is_counted_as_free_counts_it() -> None:
    assert ram_usage(MEMINFO) == pytest.approx(0.3)
    assert ram_usage("MemTotal: 1000 kB\nMemFree: 400 kB\nCached: 700 kB\n") == pytest.approx(0.6)
    assert ram_usage("") == 0.0
