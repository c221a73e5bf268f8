"""What the failure detector found (PX4's failureDetectorCheck): tilted too far, before takeoff or in the air, sunk
below what was asked for, and a propeller out of balance.
"""

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Of roll and pitch the first is told."""
    status = topics.failure_detector_status
    if status.fd_roll or status.fd_pitch:
        findings.fd_critical_failure = True
        axis = "roll" if status.fd_roll else "pitch"
        event, text = f"check_failure_detector_{axis}", f"Preflight Fail: Attitude failure ({axis})"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, event, text=text)
    if status.fd_alt:
        findings.fd_alt_loss = True
        event, text = "check_failure_detector_alt", "Preflight Fail: Altitude failure"
        findings.arming_check_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, event, text=text)
    if status.fd_imbalanced_prop:
        findings.fd_imbalanced_prop = True
        event, text = "check_failure_detector_imbalanced_prop", "Preflight Fail: Imbalanced propeller detected"
        findings.health_failure(ALL_MODES, Component.SYSTEM, Severity.CRITICAL, event, text=text)
