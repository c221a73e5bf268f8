"""How busy the computer is: what a clock and the processor's time make of it."""

import pytest

from sitl_emu.autopilot.commander.arming_checks import cpu_resource
from sitl_emu.autopilot.commander.arming_checks.findings import Findings
from sitl_emu.autopilot.system.load_mon import LoadMon, ram_usage
from sitl_emu.autopilot.topics import CpuLoad, Topics

from .navigation_fake import FakeVehicle

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


@pytest.mark.parametrize(
    ("load", "ram", "limits", "for_s", "told"),
    [
        (0.91, 0.2, (90.0, 90.0), 2.1, ["Preflight Fail: CPU load too high: 91.0%"]),
        (0.91, 0.2, (90.0, 90.0), 1.9, []),
        (0.91, 0.2, (-1.0, 90.0), 2.1, []),
        (0.2, 0.91, (90.0, 90.0), 0.1, ["Preflight Fail: RAM usage too high: 91.0%"]),
        (0.2, 0.91, (90.0, 0.0), 0.1, []),
    ],
)
def test_a_computer_that_is_too_busy(
    load: float, ram: float, limits: tuple[float, float], for_s: float, told: list[str]
) -> None:
    vehicle = FakeVehicle(COM_CPU_MAX=limits[0], COM_RAM_MAX=limits[1])
    settings, watch = vehicle.commander._checks._settings, cpu_resource.CpuResourceCheck()
    for now_us in range(10_000_000, 10_000_000 + round(for_s * 1e6) + 1, 100_000):
        vehicle.topics.cpuload = CpuLoad(now_us, load, ram)
        findings = Findings()
        watch.check(now_us, vehicle.topics, settings, findings)
    assert list(findings.texts) == told
    assert bool(findings.arming_forbidden) is bool(told)
