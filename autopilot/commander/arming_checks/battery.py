"""Battery is connected and not near its end (PX4's batteryCheck). COM_ARM_BAT_MIN: least charge to arm, 0..1."""

from autopilot.commander.arming_checks.findings import BATTERY, Findings, Settings
from autopilot.topics import Topics

WARNING_LOW = 1
WARNING_CRITICAL = 2
TEXTS = {WARNING_LOW: "Low battery\t", WARNING_CRITICAL: "Critical battery\t"}


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """The warning level; critical and worse forbids arming."""
    battery = topics.battery_status
    if not battery.connected:
        return
    findings.battery_warning = battery.warning
    text = TEXTS.get(battery.warning)
    if text is not None:
        findings.warn(BATTERY, text)
    if battery.warning >= WARNING_CRITICAL:
        findings.unhealthy |= BATTERY
        findings.arming_forbidden = True
    elif settings.com_arm_bat_min > 0.0 and battery.remaining < settings.com_arm_bat_min:
        findings.forbid_arming(BATTERY, "Preflight Fail: Low battery")
