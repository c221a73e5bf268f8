"""A ground station's heartbeat within COM_DL_LOSS_T (the data link half of PX4's rcAndDataLinkCheck)."""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.commander.data_links import gcs_is_lost
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

EVENT: Final = "check_rc_dl_no_dllink"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A ground station that was never there counts as lost, too. With NAV_DLL_ACT it is needed for arming."""
    lost = gcs_is_lost(now_us, topics.gcs_heartbeats.gcs_us, settings.com_dl_loss_us)
    findings.gcs_connection_lost = lost
    if not lost:
        findings.health_present |= Component.COMMUNICATION_LINKS
    elif settings.nav_dll_act > 0:
        text, said_as = "Preflight Fail: No connection to the GCS", Severity.WARNING
        failure = (ALL_MODES, Component.COMMUNICATION_LINKS, Severity.ERROR, EVENT)
        findings.arming_check_failure(*failure, text=text, said_as=said_as)
    else:
        findings.arming_check_failure(NO_MODE, Component.COMMUNICATION_LINKS, Severity.INFO, EVENT)
