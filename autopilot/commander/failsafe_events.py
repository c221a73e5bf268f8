"""Which event tells a failsafe, as PX4's FailsafeBase::notifyUser (failsafe/framework.cpp, v1.18)."""

from sitl_emu.autopilot.commander.custom_mode import custom_mode_of
from sitl_emu.autopilot.commander.failsafe import CAUSES
from sitl_emu.autopilot.commander.failsafe_framework import CAUSE_GENERIC, Action, Notice
from sitl_emu.autopilot.constants import Severity

BATTERY_WARNINGS = {
    CAUSES["battery_low"]: "commander_failsafe_enter_low_bat",
    CAUSES["battery_critical"]: "commander_failsafe_enter_crit_bat_warn",
    CAUSES["battery_emergency"]: "commander_failsafe_enter_crit_low_bat_warn",
    CAUSES["battery_low_remaining_time"]: "commander_failsafe_enter_low_flight_time_warn",
}
DISENGAGED = (Action.DESCEND, Action.FALLBACK_ALTCTL, Action.FALLBACK_STAB)
"""There is no position control any more."""


def failsafe_severity(notice: Notice) -> Severity:
    """Of the event."""
    if notice.action is not Action.WARN:
        return Severity.CRITICAL
    return {CAUSES["battery_critical"]: Severity.CRITICAL, CAUSES["battery_emergency"]: Severity.EMERGENCY}.get(
        notice.cause, Severity.WARNING
    )


def failsafe_event(notice: Notice) -> tuple[str, *tuple[int, ...]]:
    """Name and arguments."""
    mode, action, cause = custom_mode_of(notice.user_mode), int(notice.action), notice.cause
    generic = cause == CAUSE_GENERIC
    if notice.delayed_action is not Action.NONE:
        delayed = int(notice.delayed_action)
        if generic:
            return "commander_failsafe_enter_generic_hold", mode, delayed, notice.hold_s
        return "commander_failsafe_enter_hold", mode, delayed, notice.hold_s, cause
    if notice.action is Action.WARN:
        if generic:
            return "commander_failsafe_enter_generic_warn", mode
        if cause in BATTERY_WARNINGS:
            return (BATTERY_WARNINGS[cause],)
        return "commander_failsafe_enter_warn", mode, cause
    if generic and notice.action in DISENGAGED:
        return "commander_failsafe_enter_autopilot_disengaged", mode, action
    if generic:
        return "commander_failsafe_enter_generic", mode, action
    return "commander_failsafe_enter", mode, action, cause
