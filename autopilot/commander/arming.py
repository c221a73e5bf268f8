"""Armed or not: who may arm, who may disarm, and since when.

PX4's Commander::arm and disarm (v1.18), with their texts. Sticks that are not at rest refuse arming in the modes that
are flown by them. A terminated flight stays terminated until the next start.
"""

from typing import Final

from sitl_emu.autopilot.commander import home_position
from sitl_emu.autopilot.commander.arm_authorization import ArmAuthorization, Leave
from sitl_emu.autopilot.commander.arming_checks.checks import HealthAndArmingChecks
from sitl_emu.autopilot.commander.command_results import ACCEPTED, TEMPORARILY_REJECTED
from sitl_emu.autopilot.commander.user_mode_intention import UserModeIntention
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.flight_mode import FLOWN_BY_STICKS, STICKS_TO_THRUST
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics
from sitl_emu.autopilot.vehicle_kind import Traits

THROTTLE_LOW: Final = -0.8
THROTTLE_CENTRE: Final = 0.2
REARMED_WITHIN_US: Final = 5_000_000
"""Who flips the arming switch back so soon is not asked for health again (Commander::arm)."""
THROTTLE_REFUSAL = ("Arming denied: throttle not in safe position\t", "commander_arm_denied_throttle_unsafe")
HEALTH_REFUSAL = ("Arming denied: Resolve system health failures first\t", "commander_arm_denied_resolve_failures")
STICK_GESTURE: Final = "stick gesture"
RC_SWITCH: Final = "RC switch"
RC_BUTTON: Final = "RC button"
KILL_SWITCH: Final = "kill-switch"
INTERNAL_COMMAND: Final = "internal command"
EXTERNAL_COMMAND: Final = "external command"
MISSION_START: Final = "mission start"
REASONS = {
    STICK_GESTURE: 1,
    RC_SWITCH: 2,
    INTERNAL_COMMAND: 3,
    EXTERNAL_COMMAND: 4,
    MISSION_START: 5,
    "landing": 6,
    "auto preflight disarming": 7,
    KILL_SWITCH: 8,
    RC_BUTTON: 13,
    "failsafe": 14,
}
"""Why the vehicle was armed or disarmed, as PX4 says it, and vehicle_status' ARM_DISARM_REASON_*."""


class Arming:
    """Writes actuator_armed, and home at arming."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        checks: HealthAndArmingChecks,
        intention: UserModeIntention,
        say: Say,
        traits: Traits,
        *,
        authorization: ArmAuthorization | None = None,
    ) -> None:
        """`authorization`: whose leave it takes; without it nobody's."""
        self._authorization = authorization
        self._topics = topics
        self._parameters = parameters
        self._checks = checks
        self._intention = intention
        self._say = say
        self._traits = traits
        self.armed = False
        self.armed_us = 0
        self._disarmed_us: int | None = None
        self._waiting: str | None = None
        """Who wants to arm and waits for somebody's leave: one of REASONS."""
        self._asked_again = False
        self.terminated = False
        self.arming_reason = 0
        self.disarming_reason = 0

    def arm(self, now_us: int, *, forced: bool = False, by: str = EXTERNAL_COMMAND) -> int | None:
        """MAV_RESULT of arming; `forced` goes without checks. `by` is one of REASONS. None: leave is awaited."""
        if self.armed:
            return ACCEPTED
        status = self._topics.vehicle_status
        if status.calibrating or status.rc_calibration_in_progress:
            self._say(Severity.CRITICAL, "Arming denied: calibrating\t", "commander_arm_denied_calibrating")
            return TEMPORARILY_REJECTED
        in_grace = self._disarmed_us is not None and now_us - self._disarmed_us < REARMED_WITHIN_US
        if not forced and not (by == RC_SWITCH and in_grace):
            if not self._throttle_is_safe():
                self._say(Severity.CRITICAL, *THROTTLE_REFUSAL)
                return TEMPORARILY_REJECTED
            leave = self._ask_leave(now_us)
            if leave is Leave.AWAITED:
                self._waiting, self._asked_again = by, False
                return None
            return self._arm_if_healthy(now_us, by, leave)
        return self._arm(now_us, by)

    def settle(self, now_us: int) -> int | None:
        """MAV_RESULT of an arming that waited for leave, once somebody has answered, or the time for that is over.

        A refusal that is reported runs PX4's checks a second time, for their texts, and so asks once more.
        """
        if self._waiting is None or self._authorization is None or self._authorization.waits:
            return None
        by, leave = self._waiting, Leave.GIVEN if self._authorization.given else Leave.REFUSED
        if leave is Leave.REFUSED and not self._asked_again:
            self._asked_again = True
            reported = self._checks.update(now_us, authorization_denied=True)
            if reported and self._ask_leave(now_us) is Leave.AWAITED:
                return None
        self._waiting = None
        return ACCEPTED if self.armed else self._arm_if_healthy(now_us, by, leave)

    def _ask_leave(self, now_us: int) -> Leave:
        """Whatever else is wrong (systemCheck)."""
        return Leave.GIVEN if self._authorization is None else self._authorization.leave(now_us)

    def _arm_if_healthy(self, now_us: int, by: str, leave: Leave) -> int:
        self._checks.update(now_us, authorization_denied=leave is Leave.REFUSED)
        if self._checks.can_arm(self._topics.vehicle_status.nav_state):
            return self._arm(now_us, by)
        self._say(Severity.CRITICAL, *HEALTH_REFUSAL)
        return TEMPORARILY_REJECTED

    def _arm(self, now_us: int, by: str) -> int:
        topics = self._topics
        self.armed = True
        self.armed_us = now_us
        self.arming_reason = REASONS[by]
        topics.actuator_armed = topics.actuator_armed._replace(armed=True, ready_to_arm=True)
        self.set_home(now_us)
        self._say(Severity.INFO, f"Armed by {by}\t", "commander_armed_by", self.arming_reason)
        return ACCEPTED

    def set_home(self, now_us: int) -> None:
        """Home is here, unless somebody has given one, or a mission is flown (COM_HOME_EN)."""
        topics = self._topics
        if self._parameters["COM_HOME_EN"] and not topics.home_position.manual_home and not self.mission_in_progress:
            gps_ctrl = int(self._parameters["EKF2_GPS_CTRL"])
            topics.home_position = home_position.at_vehicle(now_us, topics, gps_ctrl) or topics.home_position

    @property
    def mission_in_progress(self) -> bool:
        """MISSION is flown, and has not ended."""
        topics = self._topics
        return topics.vehicle_status.nav_state is NavState.AUTO_MISSION and not topics.mission_result.finished

    def disarm_by_command(self, now_us: int, *, forced: bool, by: str = EXTERNAL_COMMAND) -> int:
        """MAV_RESULT of disarming; only `forced` disarms what flies."""
        if not self.armed:
            return ACCEPTED
        if not (forced or self._may_disarm()):
            self._say(Severity.CRITICAL, "Disarming denied: not landed\t", "commander_disarm_denied_not_landed")
            return TEMPORARILY_REJECTED
        self.disarm(now_us, by)
        return ACCEPTED

    def disarm_by_pilot(self, now_us: int, by: str) -> None:
        """By gesture or switch: on the ground, and in modes where the throttle stick is the thrust."""
        if not self.armed:
            return
        if self._may_disarm() or self._topics.vehicle_status.nav_state in STICKS_TO_THRUST:
            self.disarm(now_us, by)
        elif by != STICK_GESTURE:
            self._say(Severity.CRITICAL, "Disarming denied: not landed\t", "commander_disarm_denied_not_landed")

    def _may_disarm(self) -> bool:
        land_detected = self._topics.vehicle_land_detected
        stands = land_detected.landed or land_detected.maybe_landed
        return stands or self._traits.disarms_in_motion

    def disarm(self, now_us: int, by: str) -> None:
        """Disarm and say by what: one of REASONS."""
        self.armed = False
        self._disarmed_us = now_us
        self.disarming_reason = REASONS[by]
        self._topics.actuator_armed = self._topics.actuator_armed._replace(armed=False)
        self._intention.on_disarm()
        self._say(Severity.INFO, f"Disarmed by {by}\t", "commander_disarmed_by", self.disarming_reason)

    def terminate(self) -> None:
        """End the flight, for good."""
        self.terminated = True
        self._topics.actuator_armed = self._topics.actuator_armed._replace(armed=self.armed, termination=True)

    def _throttle_is_safe(self) -> bool:
        """To stand, a stick that climbs is in its centre or below, and one that is the thrust at the bottom.

        In modes that no stick flies, and without sticks, nobody asks.
        """
        topics = self._topics
        mode, throttle = topics.vehicle_status.nav_state, topics.manual_control_setpoint.throttle
        if topics.failsafe_flags.manual_control_signal_lost or mode not in FLOWN_BY_STICKS:
            return True
        if self._traits.arms_with_centred_throttle:
            return abs(throttle) < THROTTLE_CENTRE
        return throttle < THROTTLE_LOW if mode in STICKS_TO_THRUST else throttle <= THROTTLE_CENTRE
