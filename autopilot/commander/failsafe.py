"""What happens when something fails in flight: an ordered list of actions; the worst that is asked for wins.

PX4's failsafe framework and its rules (src/modules/commander/failsafe/framework.cpp and failsafe.cpp, v1.18). A rule
names a condition, the action that a parameter asks for, and when the action ends. Link losses, batteries and fences
first hold for COM_FAIL_ACT_T, so that a pilot can take over; a mode that can no longer be flown is left at once. An
action that cannot be flown is replaced by the next worse one that can. A pilot who changes the mode while an action
is flown takes over.

Left out: VTOL, deferred failsafes, remaining flight time, wind, motor failures, stick takeover.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import FailsafeFlags


class Action(IntEnum):
    """Further down is worse, and wins."""

    NONE = 0
    WARN = 1
    FALLBACK_POSCTL = 2
    FALLBACK_ALTCTL = 3
    FALLBACK_STAB = 4
    HOLD = 5
    RTL = 6
    LAND = 7
    DESCEND = 8
    DISARM = 9
    TERMINATE = 10


class Clear(IntEnum):
    """When an action ends."""

    WHEN_CONDITION_CLEARS = 0
    ON_MODE_CHANGE_OR_DISARM = 1
    ON_DISARM = 2


class Option(NamedTuple):
    """What a parameter's value asks for."""

    action: Action = Action.NONE
    clear: Clear = Clear.WHEN_CONDITION_CLEARS


NOTHING = Option()
WARN = Option(Action.WARN)
HOLD = Option(Action.HOLD, Clear.ON_MODE_CHANGE_OR_DISARM)
RTL = Option(Action.RTL, Clear.ON_MODE_CHANGE_OR_DISARM)
LAND = Option(Action.LAND, Clear.ON_MODE_CHANGE_OR_DISARM)
DISARM = Option(Action.DISARM, Clear.ON_MODE_CHANGE_OR_DISARM)
TERMINATE = Option(Action.TERMINATE, Clear.ON_DISARM)

LINK_LOSS_ACT = {0: NOTHING, 1: HOLD, 2: RTL, 3: LAND, 5: TERMINATE, 6: DISARM}
COM_PARACHUTE = {1: WARN, 2: WARN, 3: RTL, 4: LAND}
COM_ARM_ODID = {3: RTL, 4: LAND, 5: TERMINATE}
GF_ACTION = {0: NOTHING, 1: WARN, 2: HOLD, 3: RTL, 4: TERMINATE, 5: LAND}
ONLY_WARN: Final = 0
"""COM_LOW_BAT_ACT."""
LOW_BAT_CRITICAL = {0: WARN, 2: LAND, 3: RTL}
LOW_BAT_EMERGENCY = {0: WARN, 2: LAND, 3: LAND}
COM_FLTT_LOW_ACT = {0: NOTHING, 1: WARN, 3: RTL}
LINK_LOSS_DISABLED: Final = 0
"""NAV_DLL_ACT."""
OFFBOARD_LOSS_ACT = {
    0: Action.FALLBACK_POSCTL,
    1: Action.FALLBACK_ALTCTL,
    2: Action.FALLBACK_STAB,
    3: Action.RTL,
    4: Action.LAND,
    5: Action.HOLD,
    6: Action.TERMINATE,
    7: Action.DISARM,
}
"""COM_OBL_RC_ACT."""

WARNING_LOW: Final = 1
WARNING_CRITICAL: Final = 2
WARNING_EMERGENCY: Final = 3
FLIGHT_TERMINATION_BROKEN: Final = 121212
"""CBRK_FLIGHTTERM: a critical failure is only warned of."""
EARLY_TAKEOFF_US: Final = 3_000_000
"""After spoolup: a vehicle that tips over now is still on the ground, and is disarmed."""
STICKS_DISABLED: Final = 4
"""COM_RC_IN_MODE: no stick input at all."""

_FALLBACK_MODES = (
    (Action.FALLBACK_POSCTL, NavState.POSCTL),
    (Action.FALLBACK_ALTCTL, NavState.ALTCTL),
    (Action.FALLBACK_STAB, NavState.STAB),
    (Action.HOLD, NavState.AUTO_LOITER),
    (Action.RTL, NavState.AUTO_RTL),
    (Action.LAND, NavState.AUTO_LAND),
    (Action.DESCEND, NavState.DESCEND),
)
_MODE_OF_ACTION: Final = dict(_FALLBACK_MODES) | {Action.TERMINATE: NavState.TERMINATION}

CAUSE_GENERIC: Final = 0
CAUSES = {
    "manual_control_signal_lost": 1,
    "gcs_connection_lost": 2,
    "battery_low": 3,
    "battery_critical": 4,
    "battery_emergency": 5,
    "battery_low_remaining_time": 6,
}
"""By rule: failsafe_cause_t of the events; rules that are not here are generic."""


class Notice(NamedTuple):
    """What people are told of a failsafe."""

    action: Action
    cause: int
    user_mode: NavState
    delayed_action: Action = Action.NONE
    """What follows after the hold."""
    hold_s: int = 0
    with_text: bool = True
    """A warning alone is an event without a text."""


FailsafeNotice = Callable[[Notice], None]


class Failsafe:
    """Which actions are active, and what is flown because of them."""

    def __init__(self, parameters: Parameters, notice: FailsafeNotice) -> None:
        self._parameters = parameters
        self._notice = notice
        self._active: dict[str, tuple[Option, bool]] = {}
        """By rule: the action and whether it waits for the hold first."""
        self._selected = Action.NONE
        self._chosen = Action.NONE
        """The selected action before it was replaced by one that can be flown."""
        self._hold_until_us = 0
        self._to_be_told = False
        """A new warning, which is told whatever else is active."""
        self._taken_over = False
        self._mode_changes = 0
        self._manual_control_lost_at_arming = False
        self._battery_warning_at_arming = 0
        self._was_armed = False
        self._armed_us = 0
        self._judged: tuple[object, ...] = ()
        self._nav_state = NavState.AUTO_LOITER

    @property
    def in_failsafe(self) -> bool:
        """An action is being flown."""
        return self._selected > Action.WARN

    @property
    def taken_over(self) -> bool:
        """The pilot has taken over from an action that still has its reason."""
        return self._taken_over

    @property
    def selected(self) -> Action:
        """The action that is being flown now."""
        return self._selected

    def update(
        self,
        now_us: int,
        *,
        armed: bool,
        user_mode: NavState,
        mode_changes: int,
        flags: FailsafeFlags,
        can_run_mode_flags: int,
        mission_finished: bool = False,
    ) -> NavState:
        """The mode to fly. `user_mode` is what was asked for, `mode_changes` counts the requests.

        Judges anew only when something has changed: this runs 50 times a second.
        """
        if not armed:
            self._active.clear()
            self._selected = self._chosen = Action.NONE
            self._taken_over = self._was_armed = False
            self._mode_changes = mode_changes
            self._judged = ()
            return user_mode
        if not self._was_armed:
            self._was_armed = True
            self._armed_us = now_us
            self._battery_warning_at_arming = flags.battery_warning
            self._manual_control_lost_at_arming = flags.manual_control_signal_lost
        elif not flags.manual_control_signal_lost:
            self._manual_control_lost_at_arming = False
        holding = self._holding(now_us)
        judged = (
            flags,
            user_mode,
            mode_changes,
            can_run_mode_flags,
            self._parameters.version,
            holding,
            mission_finished,
        )
        if judged == self._judged:
            return self._nav_state
        self._judged = judged
        user_mode_changed = mode_changes != self._mode_changes
        self._mode_changes = mode_changes
        self._check_rules(now_us, user_mode, flags, can_run_mode_flags, user_mode_changed, mission_finished)
        self._nav_state = self._select(now_us, user_mode, user_mode_changed, can_run_mode_flags)
        return self._nav_state

    def _check_rules(
        self,
        now_us: int,
        user_mode: NavState,
        flags: FailsafeFlags,
        can_run: int,
        user_mode_changed: bool,
        mission_finished: bool,
    ) -> None:
        parameters = self._parameters
        checks: list[tuple[str, bool, Option, bool]] = []
        sticks_ignored = (
            self._manual_control_lost_at_arming
            or parameters["COM_RC_IN_MODE"] == STICKS_DISABLED
            or _excepted(int(parameters["COM_RCL_EXCEPT"]), user_mode)
        )
        checks.append(
            (
                "manual_control_signal_lost",
                flags.manual_control_signal_lost and not sticks_ignored,
                LINK_LOSS_ACT.get(int(parameters["NAV_RCL_ACT"]), NOTHING),
                True,
            )
        )
        link_ignored = FLIGHT_MODES[user_mode].ignores_gcs_loss or _excepted(
            int(parameters["COM_DLL_EXCEPT"]), user_mode
        )
        checks.append(
            (
                "gcs_connection_lost",
                flags.gcs_connection_lost and not link_ignored,
                LINK_LOSS_ACT.get(int(parameters["NAV_DLL_ACT"]), NOTHING),
                True,
            )
        )
        checks.append(
            ("mission_failure", flags.mission_failure and user_mode is NavState.AUTO_MISSION, RTL, True),
        )
        if user_mode is NavState.AUTO_MISSION and mission_finished and self._nobody_leads(user_mode):
            checks.append(("mission_control_lost", flags.gcs_connection_lost, RTL, True))
        checks.append(("flight_time", flags.flight_time_limit_exceeded, RTL, True))
        checks.append(("geofence", flags.geofence_breached, GF_ACTION.get(int(parameters["GF_ACTION"]), NOTHING), True))
        parachute = COM_PARACHUTE.get(int(parameters["COM_PARACHUTE"]), NOTHING)
        checks.append(("parachute", flags.parachute_unhealthy, parachute, True))
        remote_id = COM_ARM_ODID.get(int(parameters["COM_ARM_ODID"]), NOTHING)
        checks.append(("remote_id", flags.remote_id_unhealthy, remote_id, True))
        time_low = COM_FLTT_LOW_ACT.get(int(parameters["COM_FLTT_LOW_ACT"]), NOTHING)
        checks.append(("battery_low_remaining_time", flags.battery_low_remaining_time, time_low, True))
        spoolup = now_us - self._armed_us < parameters["COM_SPOOLUP_TIME"] * 1e6
        checks.append(("battery_unhealthy", flags.battery_unhealthy, Option(Action.DISARM) if spoolup else WARN, False))
        warning = flags.battery_warning
        worse_than_at_arming = warning > self._battery_warning_at_arming
        low_battery = int(parameters["COM_LOW_BAT_ACT"]) if worse_than_at_arming else ONLY_WARN
        checks.append(("battery_low", warning == WARNING_LOW, WARN, False))
        checks.append(("battery_critical", warning == WARNING_CRITICAL, LOW_BAT_CRITICAL.get(low_battery, WARN), True))
        checks.append(
            ("battery_emergency", warning >= WARNING_EMERGENCY, LOW_BAT_EMERGENCY.get(low_battery, WARN), True)
        )
        checks.append(("fd_critical_failure", flags.fd_critical_failure, self._on_critical_failure(now_us), False))
        checks.append(("fd_imbalanced_prop", flags.fd_imbalanced_prop, WARN, False))
        fallback = self._mode_fallback(user_mode, flags, can_run)
        checks.append(("mode_fallback", fallback is not Action.NONE, Option(fallback), False))
        for name, failed, option, delayed in checks:
            self._check(now_us, name, failed, option, delayed, user_mode_changed)

    def _nobody_leads(self, user_mode: NavState) -> bool:
        """Neither sticks nor a lost ground station are minded."""
        parameters = self._parameters
        no_sticks = parameters["COM_RC_IN_MODE"] == STICKS_DISABLED
        no_sticks = no_sticks or _excepted(int(parameters["COM_RCL_EXCEPT"]), user_mode)
        return no_sticks and parameters["NAV_DLL_ACT"] == LINK_LOSS_DISABLED

    def _check(
        self, now_us: int, name: str, failed: bool, option: Option, delayed: bool, user_mode_changed: bool
    ) -> None:
        active = self._active
        before = active.get(name)
        if failed and option.action is not Action.NONE:
            if before is None:
                delayed = delayed and option.action not in (Action.WARN, Action.HOLD, Action.DISARM, Action.TERMINATE)
                if delayed and self._selected <= Action.WARN and not any(waits for _, waits in active.values()):
                    self._hold_until_us = now_us + int(self._parameters["COM_FAIL_ACT_T"] * 1e6)
                active[name] = (option, delayed)
                self._to_be_told |= option.action is Action.WARN
            elif before[0] != option and before[0].clear is Clear.WHEN_CONDITION_CLEARS:
                active[name] = (option, before[1])
        elif before is not None:
            clear = before[0].clear
            if clear is Clear.WHEN_CONDITION_CLEARS or (
                clear is Clear.ON_MODE_CHANGE_OR_DISARM
                and (self._taken_over or user_mode_changed or self._holding(now_us))
            ):
                del active[name]

    def _holding(self, now_us: int) -> bool:
        return now_us < self._hold_until_us and any(waits for _, waits in self._active.values())

    def _on_critical_failure(self, now_us: int) -> Option:
        early_us = int(self._parameters["COM_SPOOLUP_TIME"] * 1e6) + EARLY_TAKEOFF_US
        if now_us - self._armed_us < early_us:
            return Option(Action.DISARM)
        if self._parameters["CBRK_FLIGHTTERM"] == FLIGHT_TERMINATION_BROKEN:
            return WARN
        return Option(Action.TERMINATE)

    def _mode_fallback(self, user_mode: NavState, flags: FailsafeFlags, can_run: int) -> Action:
        """What to do because the mode cannot be flown; each replacement has to be possible itself."""
        action = Action.NONE
        if user_mode is NavState.OFFBOARD and flags.offboard_control_signal_lost:
            action = OFFBOARD_LOSS_ACT.get(int(self._parameters["COM_OBL_RC_ACT"]), Action.RTL)
            user_mode = _MODE_OF_ACTION.get(action, user_mode)
            if action >= Action.HOLD:
                return action
        if user_mode in (NavState.POSCTL, NavState.POSITION_SLOW) and not can_run >> user_mode & 1:
            action, user_mode = Action.FALLBACK_ALTCTL, NavState.ALTCTL
        if user_mode is NavState.ALTCTL and not can_run >> NavState.ALTCTL & 1:
            action, user_mode = Action.FALLBACK_STAB, NavState.STAB
        return action if can_run >> user_mode & 1 else Action.RTL

    def _select(self, now_us: int, user_mode: NavState, user_mode_changed: bool, can_run: int) -> NavState:
        action, cause = Action.NONE, CAUSE_GENERIC
        for name, (option, _) in self._active.items():
            if option.action > action:
                action, cause = option.action, CAUSES.get(name, CAUSE_GENERIC)
        wanted = action
        if action is Action.NONE:
            self._taken_over = False
        elif user_mode_changed and action == self._chosen and action < Action.DISARM:
            if action is Action.WARN:
                self._notice(Notice(action, cause, user_mode))
            self._taken_over = True
        self._chosen = action
        hold_s = 0
        if self._taken_over and (action < Action.DISARM and can_run >> user_mode & 1):
            action = min(action, Action.WARN)
        elif Action.HOLD < action < Action.DISARM and self._holding(now_us):
            hold_s = round(float(self._parameters["COM_FAIL_ACT_T"]))
            action = Action.HOLD
        possible = self._possible(action, can_run)
        worse = possible > Action.WARN and possible > self._selected
        if worse or (possible is not Action.NONE and self._to_be_told):
            delayed = wanted if hold_s else Action.NONE
            self._notice(Notice(possible, cause, user_mode, delayed, hold_s, worse))
        self._to_be_told = False
        self._selected = possible
        return _MODE_OF_ACTION.get(possible, user_mode)

    def _possible(self, action: Action, can_run: int) -> Action:
        if action < Action.FALLBACK_POSCTL or action > Action.DESCEND:
            return action
        for candidate, mode in _FALLBACK_MODES:
            if candidate >= action and can_run >> mode & 1:
                return candidate
        return Action.TERMINATE


def _excepted(exceptions: int, user_mode: NavState) -> bool:
    return bool(exceptions & FLIGHT_MODES[user_mode].link_loss_exception)
