"""What the modes need and is not there, as people are told it (PX4's modeCheck).

Which modes can run is worked out in mode_requirements.py. COM_ARM_MIS_REQ 1 forbids arming without a mission,
COM_RC_IN_MODE 4 makes missing sticks an error.
"""

from typing import Final, NamedTuple

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.commander.mode_requirements import MODES_THAT_NEED, PREVENT_ARMING, PREVENT_ARMING_MODES
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.flight_mode import Need
from sitl_emu.autopilot.topics import Topics

STICKS_DISABLED: Final = 4


class Lack(NamedTuple):
    """How it is told that something is missing."""

    flag: str
    need: Need
    component: Component
    level: Severity
    event: str


LACKS = (
    Lack(
        "angular_velocity_invalid",
        Need.ANGULAR_VELOCITY,
        Component.SYSTEM,
        Severity.CRITICAL,
        "check_modes_angular_velocity",
    ),
    Lack("attitude_invalid", Need.ATTITUDE, Component.ATTITUDE_ESTIMATE, Severity.CRITICAL, "check_modes_attitude"),
    Lack(
        "local_position_invalid",
        Need.LOCAL_POSITION,
        Component.LOCAL_POSITION_ESTIMATE,
        Severity.ERROR,
        "check_modes_local_pos",
    ),
    Lack(
        "global_position_invalid",
        Need.GLOBAL_POSITION,
        Component.GLOBAL_POSITION_ESTIMATE,
        Severity.ERROR,
        "check_modes_global_pos",
    ),
    Lack("local_altitude_invalid", Need.LOCAL_ALT, Component.SYSTEM, Severity.CRITICAL, "check_modes_local_alt"),
    Lack("auto_mission_missing", Need.MISSION, Component.SYSTEM, Severity.INFO, "check_modes_mission"),
    Lack("home_position_invalid", Need.HOME_POSITION, Component.SYSTEM, Severity.INFO, "check_modes_home_position"),
)
"""In PX4's order."""


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Runs after all checks that find out about positions, missions and home, but before that of the sticks."""
    status = topics.vehicle_status
    if not status.armed and status.nav_state in PREVENT_ARMING:
        event = "check_modes_cannot_takeoff"
        findings.arming_check_failure(PREVENT_ARMING_MODES, Component.SYSTEM, Severity.INFO, event)
    for lack in LACKS:
        if getattr(findings, lack.flag):
            modes = MODES_THAT_NEED[lack.need]
            if lack.need is Need.LOCAL_POSITION:
                modes = findings.mode_req_local_position
                if findings.local_position_invalid_relaxed:
                    modes |= MODES_THAT_NEED[Need.LOCAL_POSITION_RELAXED]
            if lack.need is Need.MISSION and settings.com_arm_mis_req:
                modes = ALL_MODES
            findings.arming_check_failure(modes, lack.component, lack.level, lack.event)
    if topics.failsafe_flags.manual_control_signal_lost:
        disabled = settings.com_rc_in_mode == STICKS_DISABLED
        modes = MODES_THAT_NEED[Need.MANUAL_CONTROL] if disabled else NO_MODE
        level = Severity.ERROR if disabled else Severity.WARNING
        findings.arming_check_failure(modes, Component.REMOTE_CONTROL, level, "check_modes_manual_control")
    if status.nav_state_user_intention >= NavState.EXTERNAL1:
        modes = 1 << status.nav_state_user_intention
        findings.arming_check_failure(modes, Component.SYSTEM, Severity.ERROR, "check_external_modes_unavailable")
