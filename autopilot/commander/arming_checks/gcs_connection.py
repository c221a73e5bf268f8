"""A ground station's heartbeat within COM_DL_LOSS_T (the data link half of PX4's rcAndDataLinkCheck).

PX4's links go on telling that there is a station until its last heartbeat is 2.5 s old (telemetry_status,
HEARTBEAT_TIMEOUT_US; they look every 1.25 s), and COM_DL_LOSS_T counts from the last time that they told so.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

LINK_TIMEOUT_US: Final = 2_500_000
EVENT: Final = "check_rc_dl_no_dllink"


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """A ground station that was never there counts as lost, too. With NAV_DLL_ACT it is needed for arming."""
    heard_us = topics.gcs_heartbeats.gcs_us
    lost = heard_us == 0 or now_us - heard_us > settings.com_dl_loss_us + LINK_TIMEOUT_US
    findings.gcs_connection_lost = lost
    if not lost:
        findings.health_present |= Component.COMMUNICATION_LINKS
    elif settings.nav_dll_act > 0:
        text, said_as = "Preflight Fail: No connection to the GCS", Severity.WARNING
        failure = (ALL_MODES, Component.COMMUNICATION_LINKS, Severity.ERROR, EVENT)
        findings.arming_check_failure(*failure, text=text, said_as=said_as)
    else:
        findings.arming_check_failure(NO_MODE, Component.COMMUNICATION_LINKS, Severity.INFO, EVENT)
