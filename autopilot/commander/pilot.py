"""What the pilot's sticks and switches ask of the commander: modes, arming, killing, taking over.

PX4's Commander::manualControlCheck and executeActionRequest (v1.18). Gestures and switches ask for nothing while the
remote control is being calibrated. Sticks that move fast end an automatic mode or
OFFBOARD of a multicopter in the air; while a failsafe is flown, it decides (`wants_control`).
"""

from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander.arming import KILL_SWITCH, RC_BUTTON, RC_SWITCH, STICK_GESTURE, Arming
from sitl_emu.autopilot.commander.user_mode_intention import UserModeIntention
from sitl_emu.autopilot.constants import NavState, RequestedAction, Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.topics import ActionRequest, Topics

KILL_DISARMS_AFTER_US: Final = 5_000_000
"""A vehicle that stays armed and killed is disarmed (Commander::handleAutoDisarm)."""
BY = (STICK_GESTURE, RC_SWITCH, RC_BUTTON)
"""Of action_request SOURCE; a mode slot does not arm."""


class Pilot:
    """Acts on action_requests and on sticks that move."""

    def __init__(
        self,
        topics: Topics,
        intention: UserModeIntention,
        arming: Arming,
        change_mode: Callable[[int, NavState], int],
        say: Say,
    ) -> None:
        """`change_mode(now_us, mode)` tries, and says so where it can't be."""
        self._topics, self._intention, self._arming, self._say = topics, intention, arming, say
        self._change_mode = change_mode
        self._requests_seen = 0
        self._sticks = topics.manual_control_setpoint
        self._killed_us: int | None = None
        """Since when it is armed, and killed."""
        self.wants_control = False
        """The sticks move while a failsafe is flown."""

    def update(self, now_us: int, *, in_failsafe: bool) -> None:
        """At 83 Hz."""
        self.wants_control = False
        requests = self._topics.action_requests
        if requests and requests[-1].number != self._requests_seen:
            for request in requests:
                if request.number > self._requests_seen:
                    self._carry_out(now_us, request)
            self._requests_seen = requests[-1].number
        if self._topics.manual_control_setpoint is not self._sticks:
            self._sticks = self._topics.manual_control_setpoint
            if self._sticks.valid:
                self._watch_sticks(in_failsafe=in_failsafe)
        self._disarm_who_stays_killed(now_us)

    def _disarm_who_stays_killed(self, now_us: int) -> None:
        if not (self._arming.armed and self._topics.actuator_armed.kill):
            self._killed_us = None
        elif self._killed_us is None:
            self._killed_us = now_us
        elif now_us - self._killed_us >= KILL_DISARMS_AFTER_US:
            self._arming.disarm(now_us, KILL_SWITCH)

    def _watch_sticks(self, *, in_failsafe: bool) -> None:
        arming, intention, topics = self._arming, self._intention, self._topics
        control = FLIGHT_MODES[topics.vehicle_status.nav_state].control
        overridable = topics.vehicle_status.vehicle_kind.traits.sticks_take_over and (control.auto or control.offboard)
        if not (arming.armed and self._sticks.sticks_moving and overridable):
            return
        if in_failsafe:
            self.wants_control = True
        elif intention.change(NavState.POSCTL, armed=True, allow_fallback=True):
            self._say(Severity.INFO, "Pilot took over using sticks\t", "commander_rc_override")

    def _carry_out(self, now_us: int, request: ActionRequest) -> None:
        arming, action = self._arming, request.action
        if self._topics.vehicle_status.rc_calibration_in_progress:
            return
        if action == RequestedAction.TOGGLE_ARMING:
            action = RequestedAction.DISARM if arming.armed else RequestedAction.ARM
        if action == RequestedAction.SWITCH_MODE:
            self._change_mode(now_us, request.mode)
        elif action == RequestedAction.TERMINATION:
            self._intention.change(NavState.TERMINATION, armed=arming.armed)
        elif action == RequestedAction.ARM:
            arming.arm(now_us, by=BY[request.source])
        elif action == RequestedAction.DISARM:
            arming.disarm_by_pilot(now_us, BY[request.source])
        elif action == RequestedAction.KILL:
            if not self._topics.actuator_armed.kill:
                on_ground = self._topics.vehicle_land_detected.landed
                severity = Severity.INFO if on_ground else Severity.CRITICAL
                self._say(severity, "Kill engaged\t", "commander_kill_sw_engaged")
                self._kill(on=True)
        elif action == RequestedAction.UNKILL and self._topics.actuator_armed.kill:
            self._say(Severity.INFO, "Kill disengaged\t", "commander_kill_sw_disengaged")
            self._kill(on=False)

    def _kill(self, *, on: bool) -> None:
        self._topics.actuator_armed = self._topics.actuator_armed._replace(kill=on)
