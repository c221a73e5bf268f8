"""A battery that is connected is not near its end, and lasts longer than the way home (PX4's batteryCheck).

COM_ARM_BAT_MIN: least charge to arm, 0..1, instead of the critical warning (negative: the warning counts). While armed
the warning only gets worse. How long a battery lasts is known with its capacity (BAT1_CAPACITY) alone. CBRK_SUPPLY_CHK
has nobody look at the battery. One that disconnects in flight is as a critical one, also when it is back.
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import (
    ALL_MODES,
    NO_MODE,
    Component,
    Findings,
    Settings,
)
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import Topics

WARNING_LOW: Final = 1
WARNING_CRITICAL: Final = 2
WARNING_EMERGENCY: Final = 3
TOLD = {
    WARNING_LOW: (Severity.CRITICAL, "check_battery_low", "Low battery\t"),
    WARNING_CRITICAL: (Severity.CRITICAL, "check_battery_critical", "Critical battery\t"),
    WARNING_EMERGENCY: (Severity.EMERGENCY, "check_battery_emergency", "Emergency battery level\t"),
}
"""Level, event and text. A low battery is critical, so that ground stations read it out loud (batteryCheck.cpp)."""
SILENT_US: Final = 5_000_000
"""A battery that was there and says nothing for so long is not well."""
RETURN_KNOWN_US: Final = 3_000_000
"""How old an estimate of the return may be."""
HYSTERESIS: Final = 1.1
SUPPLY_CHECK_BROKEN: Final = 894281
"""CBRK_SUPPLY_CHK."""


class BatteryCheck:
    """Remembers whether there was a battery when the vehicle was armed."""

    def __init__(self) -> None:
        self._was_armed = self._had_battery = False

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """The warning level, and whether it forbids arming."""
        if settings.cbrk_supply_chk == SUPPLY_CHECK_BROKEN:
            return
        battery, armed = topics.battery_status, topics.vehicle_status.armed
        if armed and not self._was_armed:
            self._had_battery = battery.connected
        self._was_armed = armed
        warning, remaining, lasts_s = 0, 1.0, math.nan
        if battery.connected:
            findings.health_present |= Component.BATTERY
            warning, remaining, lasts_s = battery.warning, battery.remaining, battery.time_remaining_s
        elif armed and self._had_battery:
            warning, event = WARNING_CRITICAL, "check_battery_disconnected"
            text = "Battery 1 disconnected\t"
            findings.health_failure(ALL_MODES, Component.BATTERY, Severity.EMERGENCY, event, 1, text=text)
        if armed:
            warning = max(warning, topics.failsafe_flags.battery_warning)
        findings.battery_warning = warning
        by_charge = not armed and settings.com_arm_bat_min >= 0.0
        too_low = by_charge and remaining < settings.com_arm_bat_min
        critical = warning >= WARNING_CRITICAL and not by_charge
        if warning or too_low:
            forbidden = ALL_MODES if critical or too_low else NO_MODE
            level, event, text = TOLD.get(warning, TOLD[WARNING_LOW])
            findings.arming_check_failure(forbidden, Component.BATTERY, level, event, text=text, said_as=level)
        _check_return(now_us, topics, findings, lasts_s)
        if battery.connected and now_us - battery.timestamp > SILENT_US:
            findings.battery_unhealthy = True
            text = "Preflight Fail: Battery unhealthy"
            findings.health_failure(ALL_MODES, Component.BATTERY, Severity.ERROR, "check_battery_unhealthy", text=text)


def _check_return(now_us: int, topics: Topics, findings: Findings, lasts_s: float) -> None:
    """Whether the battery lasts for a return (rtlEstimateCheck)."""
    way_home = topics.rtl_time_estimate
    if not (math.isfinite(lasts_s) and way_home.valid and topics.vehicle_status.armed):
        return
    factor = HYSTERESIS if topics.failsafe_flags.battery_low_remaining_time else 1.0
    is_fresh = now_us - way_home.timestamp < RETURN_KNOWN_US
    if is_fresh and way_home.safe_time_estimate * factor >= lasts_s:
        findings.battery_low_remaining_time = True
        event = "check_battery_rem_flight_time_low"
        findings.arming_check_failure(ALL_MODES, Component.BATTERY, Severity.ERROR, event)
