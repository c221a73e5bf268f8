"""A computer that is too busy, or nearly without memory: COM_CPU_MAX, COM_RAM_MAX (PX4's cpuResourceCheck).

A limit of 0 or less: nobody looks, as in PX4's SITL, whose files set both to -1.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

FRESH_US: Final = 2_000_000
SUSTAINED_US: Final = 2_000_000
"""So long the load has to be high, or low again."""


class CpuResourceCheck:
    """Remembers how long the load has been high."""

    def __init__(self) -> None:
        self._high = self._was_above = False
        self._since_us = 0

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """What load_mon has told; nothing where it tells nothing at all."""
        cpu_max, ram_max, cpuload = settings.com_cpu_max, settings.com_ram_max, topics.cpuload
        if not cpuload.timestamp or max(cpu_max, ram_max) <= 0.0:
            return
        if now_us - cpuload.timestamp > FRESH_US:
            self._fail(findings, "check_missing_cpuload", "No CPU and RAM load information")
            return
        load, ram = cpuload.load * 100.0, cpuload.ram_usage * 100.0
        above = load > cpu_max
        if above is not self._was_above:
            self._was_above, self._since_us = above, now_us
        if above is not self._high and now_us - self._since_us >= SUSTAINED_US:
            self._high = above
        if self._high and cpu_max > 0.0:
            self._fail(findings, "check_cpuload_too_high", f"CPU load too high: {load:3.1f}%", load)
        if ram > ram_max > 0.0:
            self._fail(findings, "check_ram_usage_too_high", f"RAM usage too high: {ram:3.1f}%", ram)

    def _fail(self, findings: Findings, event: str, text: str, *arguments: float) -> None:
        failure = ALL_MODES, Component.SYSTEM, Severity.ERROR, event
        findings.health_failure(*failure, *arguments, text=f"Preflight Fail: {text}")
