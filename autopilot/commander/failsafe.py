"""What fails, and what is done about it: PX4's rules (src/modules/commander/failsafe/failsafe.cpp, v1.18).

A rule names a condition, the action that a parameter asks for, and when the action ends; `failsafe_framework.py`
selects among them. A mode that can no longer be flown is left at once; if that would be to a mode of sticks and these
are lost, NAV_RCL_ACT says what follows.

Left out: VTOL.
"""

from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander.failsafe_framework import (
    MODE_OF_ACTION,
    Action,
    Clear,
    FailsafeFramework,
    Notice,
    Option,
    Rule,
    Situation,
    Takeover,
)
from sitl_emu.autopilot.commander.mode_requirements import runnable_modes
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, Need
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import FailsafeFlags

NOTHING = Option()
WARN = Option(Action.WARN)
HOLD = Option(Action.HOLD, Clear.ON_MODE_CHANGE_OR_DISARM)
RTL = Option(Action.RTL, Clear.ON_MODE_CHANGE_OR_DISARM)
LAND = Option(Action.LAND, Clear.ON_MODE_CHANGE_OR_DISARM)
DISARM = Option(Action.DISARM, takeover=Takeover.NEVER)
TERMINATE = Option(Action.TERMINATE, Clear.NEVER, Takeover.NEVER)

LINK_LOSS_ACT = {1: HOLD, 2: RTL, 3: LAND, 5: TERMINATE, 6: DISARM}
"""NAV_DLL_ACT, NAV_RCL_ACT; 7 of the latter switches to HOLD, which is no failsafe (`Commander`)."""
COM_PARACHUTE = {1: WARN, 2: WARN, 3: RTL, 4: LAND}
COM_ARM_ODID = {3: RTL, 4: LAND, 5: TERMINATE}
GF_ACTION = {0: NOTHING, 2: HOLD._replace(takeover=Takeover.BY_MODE), 3: RTL, 4: TERMINATE, 5: LAND}
LANDS_WITHOUT_NAVIGATOR = (NavState.AUTO_TAKEOFF, NavState.AUTO_RTL)
"""Where the navigator cannot fly what it is to fly; other modes hold."""
LOW_BAT_CRITICAL = {1: Action.RTL, 2: Action.LAND, 3: Action.RTL}
LOW_BAT_EMERGENCY = {1: Action.RTL, 2: Action.LAND, 3: Action.LAND}
"""COM_LOW_BAT_ACT; 0 only warns."""
ONLY_WARN: Final = 0
COM_WIND_MAX_ACT = GF_ACTION
"""The same numbers, and the same way out: from HOLD the pilot takes over by choosing a mode."""
COM_POS_LOW_ACT = {0: Action.NONE, 2: Action.HOLD, 3: Action.RTL, 4: Action.TERMINATE, 5: Action.LAND}
"""It ends when the position is better, and only a mode takes over from it."""
COM_GNSSLOSS_ACT = {1: RTL, 2: LAND, 3: TERMINATE}
COM_ACT_FAIL_ACT = {1: Option(Action.HOLD), 2: LAND, 3: RTL, 4: TERMINATE}
COM_FLTT_LOW_ACT = {1: WARN, 3: RTL}
OFFBOARD_LOSS_ACT = {
    1: Action.FALLBACK_ALTCTL,
    2: Action.FALLBACK_STAB,
    3: Action.RTL,
    4: Action.LAND,
    5: Action.HOLD,
    6: Action.TERMINATE,
    7: Action.DISARM,
}
"""COM_OBL_RC_ACT; 0 and any other: POSCTL."""
OF_STICKS = (Action.FALLBACK_POSCTL, Action.FALLBACK_ALTCTL, Action.FALLBACK_STAB)
LINK_LOSS_DISABLED: Final = 0
"""NAV_DLL_ACT."""
STICKS_DISABLED: Final = 4
"""COM_RC_IN_MODE: no stick input at all."""
FLIGHT_TERMINATION_BROKEN: Final = 121212
"""CBRK_FLIGHTTERM: a critical failure is only warned of."""
EARLY_TAKEOFF_US: Final = 3_000_000
"""After spoolup: a vehicle that tips over now is still on the ground, and is disarmed."""
WARNING_LOW, WARNING_CRITICAL, WARNING_EMERGENCY = 1, 2, 3
CAUSES = {
    "manual_control_signal_lost": 1,
    "gcs_connection_lost": 2,
    "battery_low": 3,
    "battery_critical": 4,
    "battery_emergency": 5,
    "battery_low_remaining_time": 6,
}
"""By rule: failsafe_cause_t of the events; rules that are not here are generic."""
ELSEWHERE = Need.MANUAL_CONTROL | Need.WIND_AND_FLIGHT_TIME
"""What a failsafe does not ask of a mode: these have rules of their own."""


class Failsafe:
    """Judges what has failed, and has the framework select."""

    def __init__(
        self,
        parameters: Parameters,
        notice: Callable[[Notice], None],
        told_takeover: Callable[[], None] = lambda: None,
        *,
        flies: bool = True,
    ) -> None:
        self._flies = flies
        self._parameters = parameters
        self._version = parameters.version
        self._framework = FailsafeFramework(parameters, notice, told_takeover)
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
        return self._framework.selected > Action.WARN

    @property
    def taken_over(self) -> bool:
        """The pilot has taken over from an action that still has its reason."""
        return self._framework.taken_over

    @property
    def selected(self) -> Action:
        """The action that is being flown now."""
        return self._framework.selected

    @property
    def user_mode(self) -> NavState:
        """What the pilot wants, as a failsafe leaves it."""
        return self._framework.user_mode

    def update(
        self,
        now_us: int,
        *,
        armed: bool,
        user_mode: NavState,
        mode_changes: int,
        flags: FailsafeFlags,
        mission_finished: bool = False,
        sticks_take_over: bool = False,
    ) -> NavState:
        """The mode to fly. `user_mode` is what was asked for, `mode_changes` counts the requests.

        `sticks_take_over`: the pilot moves the sticks, to have the vehicle back. Judges anew only when something has
        changed, or a delay runs: this runs 83 times a second.
        """
        if armed and not self._was_armed:
            self._armed_us = now_us
            self._battery_warning_at_arming = flags.battery_warning
        if (armed and not self._was_armed) or not armed:
            self._manual_control_lost_at_arming = flags.manual_control_signal_lost
        elif not flags.manual_control_signal_lost:
            self._manual_control_lost_at_arming = False
        self._was_armed = armed
        framework = self._framework
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            framework.refresh()
        armed_for_us = now_us - self._armed_us if armed else 0
        phase = (armed_for_us < self._spoolup_us, armed_for_us < self._spoolup_us + EARLY_TAKEOFF_US)
        judged = (armed, flags, user_mode, mode_changes, self._version, mission_finished, sticks_take_over, phase)
        if judged == self._judged and not framework.holds:
            return self._nav_state
        self._judged = judged
        user_mode_changed = mode_changes != self._mode_changes
        self._mode_changes = mode_changes
        can_run = runnable_modes(flags, ELSEWHERE, flies=self._flies)
        situation = Situation(
            armed,
            user_mode,
            user_mode_changed,
            sticks_take_over,
            can_run,
            fallback=lambda mode: self._mode_fallback(mode, flags, can_run),
        )
        rules = self._rules(now_us, user_mode, flags, can_run, armed=armed, mission_finished=mission_finished)
        self._nav_state = framework.select(now_us, rules, situation)
        return self._nav_state

    @property
    def _spoolup_us(self) -> int:
        return int(self._parameters["COM_SPOOLUP_TIME"] * 1e6)

    def _rules(
        self,
        now_us: int,
        user_mode: NavState,
        flags: FailsafeFlags,
        can_run: int,
        *,
        armed: bool,
        mission_finished: bool,
    ) -> list[Rule]:
        parameters = self._parameters
        spins_up = armed and now_us - self._armed_us < self._spoolup_us
        nobody_leads = user_mode is NavState.AUTO_MISSION and mission_finished and self._nobody_leads(user_mode)
        remote_id = COM_ARM_ODID.get(int(parameters["COM_ARM_ODID"]), NOTHING)
        fallback = self._mode_fallback(user_mode, flags, can_run)
        return [
            *self._links(user_mode, flags, armed=armed),
            ("mission_failure", flags.mission_failure and user_mode is NavState.AUTO_MISSION, Option(Action.RTL)),
            ("mission_control_lost", nobody_leads and flags.gcs_connection_lost, Option(Action.RTL)),
            ("wind", flags.wind_limit_exceeded, COM_WIND_MAX_ACT.get(int(parameters["COM_WIND_MAX_ACT"]), WARN)),
            ("flight_time", flags.flight_time_limit_exceeded, Option(Action.RTL)),
            self._position_accuracy(user_mode, flags),
            ("navigator_failure", flags.navigator_failure, LAND if user_mode in LANDS_WITHOUT_NAVIGATOR else HOLD),
            ("geofence", flags.geofence_breached, GF_ACTION.get(int(parameters["GF_ACTION"]), WARN)),
            self._caused(
                "battery_low_remaining_time",
                flags.battery_low_remaining_time,
                COM_FLTT_LOW_ACT.get(int(parameters["COM_FLTT_LOW_ACT"]), NOTHING),
            ),
            ("fd_esc_arming_failure", flags.fd_esc_arming_failure and spins_up, Option(Action.DISARM)),
            ("battery_unhealthy", flags.battery_unhealthy, Option(Action.DISARM) if spins_up else WARN),
            ("parachute", flags.parachute_unhealthy, COM_PARACHUTE.get(int(parameters["COM_PARACHUTE"]), NOTHING)),
            ("remote_id", flags.remote_id_unhealthy and armed and remote_id is not NOTHING, remote_id),
            *self._battery(flags.battery_warning),
            ("fd_critical_failure", flags.fd_critical_failure, self._on_critical_failure(now_us)),
            ("fd_alt_loss", flags.fd_alt_loss, self._on_critical_failure(now_us)),
            ("fd_imbalanced_prop", flags.fd_imbalanced_prop, WARN),
            (
                "fd_motor_failure",
                flags.fd_motor_failure,
                COM_ACT_FAIL_ACT.get(int(parameters["COM_ACT_FAIL_ACT"]), WARN),
            ),
            ("gnss_lost", flags.gnss_lost, COM_GNSSLOSS_ACT.get(int(parameters["COM_GNSSLOSS_ACT"]), WARN)),
            ("mode_fallback", fallback is not Action.NONE, Option(fallback, takeover=Takeover.ALWAYS)),
        ]

    def _links(self, user_mode: NavState, flags: FailsafeFlags, *, armed: bool) -> list[Rule]:
        """Sticks that were lost at arming already are optional until they come."""
        parameters = self._parameters
        sticks_ignored = (
            self._manual_control_lost_at_arming
            or parameters["COM_RC_IN_MODE"] == STICKS_DISABLED
            or _excepted(int(parameters["COM_RCL_EXCEPT"]), user_mode)
        )
        gcs_ignored = (
            not armed
            or parameters["NAV_DLL_ACT"] == LINK_LOSS_DISABLED
            or FLIGHT_MODES[user_mode].ignores_gcs_loss
            or _excepted(int(parameters["COM_DLL_EXCEPT"]), user_mode)
        )
        by_sticks = LINK_LOSS_ACT.get(int(parameters["NAV_RCL_ACT"]), NOTHING)
        by_gcs = LINK_LOSS_ACT.get(int(parameters["NAV_DLL_ACT"]), NOTHING)
        return [
            self._caused(
                "manual_control_signal_lost", flags.manual_control_signal_lost and not sticks_ignored, by_sticks
            ),
            self._caused("gcs_connection_lost", flags.gcs_connection_lost and not gcs_ignored, by_gcs),
        ]

    def _position_accuracy(self, user_mode: NavState, flags: FailsafeFlags) -> Rule:
        action = COM_POS_LOW_ACT.get(int(self._parameters["COM_POS_LOW_ACT"]), Action.WARN)
        option = TERMINATE if action is Action.TERMINATE else Option(action, takeover=Takeover.BY_MODE)
        watched = user_mode in (NavState.AUTO_MISSION, NavState.AUTO_LOITER)
        return "position_accuracy", watched and flags.position_accuracy_low, option

    def _battery(self, warning: int) -> list[Rule]:
        """A battery that was low at arming already is only warned of."""
        worse = warning > self._battery_warning_at_arming
        act = int(self._parameters["COM_LOW_BAT_ACT"]) if worse else ONLY_WARN
        critical, emergency = LOW_BAT_CRITICAL.get(act, Action.WARN), LOW_BAT_EMERGENCY.get(act, Action.WARN)
        return [
            self._caused("battery_low", warning == WARNING_LOW, WARN),
            self._caused("battery_critical", warning == WARNING_CRITICAL, Option(critical)),
            self._caused("battery_emergency", warning >= WARNING_EMERGENCY, Option(emergency)),
        ]

    @staticmethod
    def _caused(name: str, fails: bool, option: Option) -> Rule:
        return name, fails, option._replace(cause=CAUSES[name])

    def _nobody_leads(self, user_mode: NavState) -> bool:
        """Neither sticks nor a lost ground station are minded."""
        parameters = self._parameters
        no_sticks = parameters["COM_RC_IN_MODE"] == STICKS_DISABLED
        no_sticks = no_sticks or _excepted(int(parameters["COM_RCL_EXCEPT"]), user_mode)
        return no_sticks and parameters["NAV_DLL_ACT"] == LINK_LOSS_DISABLED

    def _on_critical_failure(self, now_us: int) -> Option:
        if now_us - self._armed_us < self._spoolup_us + EARLY_TAKEOFF_US:
            return Option(Action.DISARM)
        if self._parameters["CBRK_FLIGHTTERM"] == FLIGHT_TERMINATION_BROKEN:
            return WARN
        return Option(Action.TERMINATE)

    def _mode_fallback(self, user_mode: NavState, flags: FailsafeFlags, can_run: int) -> Action:
        """What to do because the mode cannot be flown (Failsafe::checkModeFallback)."""
        action = Action.NONE
        if user_mode is NavState.OFFBOARD and flags.offboard_control_signal_lost:
            action = OFFBOARD_LOSS_ACT.get(int(self._parameters["COM_OBL_RC_ACT"]), Action.FALLBACK_POSCTL)
            if action is Action.DISARM:
                return action
            user_mode = MODE_OF_ACTION[action]
        if user_mode in (NavState.POSCTL, NavState.POSITION_SLOW) and not can_run >> user_mode & 1:
            action, user_mode = Action.FALLBACK_ALTCTL, NavState.ALTCTL
        if user_mode is NavState.ALTCTL and not can_run >> NavState.ALTCTL & 1:
            action, user_mode = Action.FALLBACK_STAB, NavState.STAB
        if flags.manual_control_signal_lost and action in OF_STICKS:
            action = LINK_LOSS_ACT.get(int(self._parameters["NAV_RCL_ACT"]), NOTHING).action
        return action if can_run >> user_mode & 1 else Action.RTL


def _excepted(exceptions: int, user_mode: NavState) -> bool:
    return bool(exceptions & FLIGHT_MODES[user_mode].link_loss_exception)
