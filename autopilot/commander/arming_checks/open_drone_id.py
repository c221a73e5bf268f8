"""A remote identification that is there and well (PX4's openDroneIDCheck).

COM_ARM_ODID: 0 none is needed, 1 warning, 2 and up: error. Above 2 its loss in flight leads to an action, see
failsafe.py.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.commander.data_links import present
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

ERROR: Final = 2


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A warning has the text of an error, other than a parachute's. That one is there, nobody tells."""
    heartbeats = topics.gcs_heartbeats
    there = present(now_us, heartbeats.open_drone_id_us)
    findings.remote_id_unhealthy = not (there and heartbeats.open_drone_id_healthy)
    if settings.com_arm_odid < 1:
        return
    if not findings.remote_id_unhealthy:
        return
    event, what = (
        ("check_open_drone_id_unhealthy", "not ready") if there else ("check_open_drone_id_missing", "missing")
    )
    is_error = settings.com_arm_odid >= ERROR
    modes, level = (ALL_MODES, Severity.ERROR) if is_error else (NO_MODE, Severity.WARNING)
    text = f"Preflight Fail: Open Drone ID system {what}"
    findings.health_failure(modes, Component.OPEN_DRONE_ID, level, event, text=text)
