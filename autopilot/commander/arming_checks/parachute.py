"""A parachute that is there and well (PX4's parachuteCheck).

COM_PARACHUTE: 0 none is needed, 1 warning, 2 and up: error. Above 2 its loss in flight leads to an action, see
failsafe.py.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.commander.data_links import present
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

ERROR: Final = 2


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Only an error has a text."""
    if settings.com_parachute < 1:
        return
    heartbeats = topics.gcs_heartbeats
    there = present(now_us, heartbeats.parachute_us)
    if there:
        findings.health_present |= Component.PARACHUTE
        if heartbeats.parachute_healthy:
            return
    findings.parachute_unhealthy = True
    event, what = ("check_parachute_unhealthy", "not ready") if there else ("check_parachute_missing", "missing")
    is_error = settings.com_parachute >= ERROR
    modes, level = (ALL_MODES, Severity.ERROR) if is_error else (NO_MODE, Severity.WARNING)
    text = f"Preflight Fail: Parachute system {what}" if is_error else ""
    findings.health_failure(modes, Component.PARACHUTE, level, event, text=text)
