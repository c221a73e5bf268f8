"""No battery that is connected is near its end (PX4's batteryCheck).

COM_ARM_BAT_MIN: least charge to arm, 0..1, instead of the critical warning (negative: the warning counts). While armed
the warning only gets worse.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import (
    ALL_MODES,
    BATTERY,
    NO_MODE,
    Component,
    Findings,
    Settings,
)
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics, batteries

WARNING_LOW: Final = 1
WARNING_CRITICAL: Final = 2
WARNING_EMERGENCY: Final = 3
TOLD = {
    WARNING_LOW: (Severity.CRITICAL, "check_battery_low", "Low battery\t"),
    WARNING_CRITICAL: (Severity.CRITICAL, "check_battery_critical", "Critical battery\t"),
    WARNING_EMERGENCY: (Severity.EMERGENCY, "check_battery_emergency", ""),
}
"""Level, event and text. A low battery is critical, so that ground stations read it out loud (batteryCheck.cpp).

An emergency comes so soon behind the critical warning that PX4 tells it as an event alone (flight battery_drain).
"""
SILENT_US: Final = 5_000_000
"""A battery that was there and says nothing for so long is not well."""


def check(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """The warning level, and whether it forbids arming."""
    connected = batteries(topics)
    if not connected:
        return
    findings.health_present |= Component.BATTERY
    armed, warning = topics.vehicle_status.armed, max(battery.warning for battery in connected)
    if armed:
        warning = max(warning, topics.failsafe_flags.battery_warning)
    findings.battery_warning = warning
    by_charge = not armed and settings.com_arm_bat_min >= 0.0
    too_low = by_charge and min(battery.remaining for battery in connected) < settings.com_arm_bat_min
    critical = warning >= WARNING_CRITICAL and not by_charge
    if warning or too_low:
        findings.unhealthy |= BATTERY
        forbidden = ALL_MODES if critical or too_low else NO_MODE
        level, event, text = TOLD.get(warning, TOLD[WARNING_LOW])
        findings.arming_check_failure(forbidden, Component.BATTERY, level, event, text=text)
    if now_us - min(battery.timestamp for battery in connected) > SILENT_US:
        findings.battery_unhealthy = True
        findings.unhealthy |= BATTERY
        text = "Preflight Fail: Battery unhealthy"
        findings.health_failure(ALL_MODES, Component.BATTERY, Severity.ERROR, "check_battery_unhealthy", text=text)
