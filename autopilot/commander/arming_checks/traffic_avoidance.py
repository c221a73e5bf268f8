"""An ADS-B receiver that is there (PX4's trafficAvoidanceCheck).

COM_ARM_TRAFF: 0 none is needed, 1 warning, 2 needed for all modes, 3 needed for missions.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.commander.data_links import present
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.topics import Topics

MODES = {1: NO_MODE, 2: ALL_MODES, 3: 1 << NavState.AUTO_MISSION}
EVENT: Final = "check_traffic_avoidance_missing"
TEXT: Final = "Preflight Fail: Traffic avoidance system missing"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Even a warning is told as a failure."""
    if settings.com_arm_traff and not present(now_us, topics.gcs_heartbeats.adsb_us):
        modes = MODES.get(settings.com_arm_traff, NO_MODE)
        findings.arming_check_failure(modes, Component.TRAFFIC_AVOIDANCE, Severity.ERROR, EVENT, text=TEXT)
