"""GPS: whether it is good enough for the filter, and whether the filter uses it (the GPS half of estimatorCheck).

What the filter has against a receiver (EKF2_GPS_CHECK, EKF2_REQ_*) is told on the ground, the first of it. Whether a
vehicle may arm then is COM_ARM_WO_GPS: 1 tells, 2 says nothing, any other forbids it. In flight it is told when the
filter leaves off using it, and when it begins again. A GPS that has fallen silent is no poor GPS.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import (
    ALL_MODES,
    NO_MODE,
    Component,
    Findings,
    Notice,
    Settings,
)
from sitl_emu.autopilot.commander.mode_requirements import MODES_THAT_NEED
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.events import DISABLED
from sitl_emu.autopilot.flight_mode import Need
from sitl_emu.autopilot.topics import Topics

GNSS_POS: Final = 1 << 2
"""Bit of estimator_status.control_mode_flags."""
ONLY_WARN, SAY_NOTHING = 1, 2
"""COM_ARM_WO_GPS."""
RELAXED_OR_GLOBAL: Final = MODES_THAT_NEED[Need.LOCAL_POSITION_RELAXED] | MODES_THAT_NEED[Need.GLOBAL_POSITION]
FAILURES = (
    ("fix_too_low", "GPS fix too low"),
    ("num_sats_too_low", "not enough GPS Satellites"),
    ("pdop_too_high", "GPS PDOP too high"),
    ("hor_pos_err_too_high", "GPS Horizontal Pos Error too high"),
    ("vert_pos_err_too_high", "GPS Vertical Pos Error too high"),
    ("speed_acc_too_low", "GPS Speed Accuracy too low"),
    ("hor_pos_drift_too_high", "GPS Horizontal Pos Drift too high"),
    ("vert_pos_drift_too_high", "GPS Vertical Pos Drift too high"),
    ("hor_speed_drift_too_high", "GPS Hor Speed Drift too high"),
    ("vert_speed_drift_too_high", "GPS Vert Speed Drift too high"),
    ("spoofed", "GPS signal spoofed"),
    ("jammed", "GPS signal jammed"),
)
"""Event and text by bit of estimator_status.gps_check_fail_flags."""
STOPPED: Final = "check_estimator_gnss_fusion_stopped"
STARTED: Final = "check_estimator_gnss_fusion_started"


class GpsCheck:
    """Remembers whether the filter used it."""

    def __init__(self) -> None:
        self._was_fused = False

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """Without a GPS (SYS_HAS_GPS) nobody looks, nor before the filter runs."""
        if not settings.sys_has_gps or not topics.estimator_status.timestamp:
            return
        fused, armed = bool(topics.estimator_status.control_mode_flags & GNSS_POS), topics.vehicle_status.armed
        if fused:
            findings.health_present |= Component.GPS
        if armed and self._was_fused and not fused:
            # no position any more: that is told as well, and worse
            level = Severity.INFO if topics.failsafe_flags.local_position_invalid else Severity.ERROR
            findings.notices.append(Notice(STOPPED, level))
        elif armed and fused and not self._was_fused:
            findings.notices.append(Notice(STARTED, Severity.INFO))
        self._was_fused = fused
        failures = topics.estimator_status.gps_check_fail_flags
        if failures and not armed:
            _tell_first(failures, settings.com_arm_wo_gps, findings)


def _tell_first(failures: int, com_arm_wo_gps: int, findings: Findings) -> None:
    name, what = FAILURES[(failures & -failures).bit_length() - 1]
    event = f"check_estimator_gps_{name}"
    if com_arm_wo_gps == ONLY_WARN:
        text, level = f"Preflight: {what}", Severity.WARNING
        told_modes = RELAXED_OR_GLOBAL | findings.mode_req_local_position
        findings.arming_check_failure(
            NO_MODE, Component.GPS, level, event, text=text, said_as=level, told_modes=told_modes
        )
    elif com_arm_wo_gps == SAY_NOTHING:
        findings.arming_check_failure(NO_MODE, Component.GPS, DISABLED, event)
    else:
        text = f"Preflight Fail: {what}"
        findings.arming_check_failure(ALL_MODES, Component.GPS, Severity.ERROR, event, text=text)
