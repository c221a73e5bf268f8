"""Who is in charge: arming, modes, failsafes, home, and the commands that concern them.

PX4's Commander (src/modules/commander/Commander.cpp, v1.18). A command that changes the mode is answered by whether the
mode can be flown; on the ground every mode can be chosen. What the navigator or a flight mode has to do with an accepted
command, it finds in topics.vehicle_commands.

Left out: RC switches and stick gestures, VTOL, calibration as such (it is answered and told, nothing is measured),
reboot (answered; restarting is the process's business), parachute, safety switch.
"""

import math
from collections.abc import Callable

from autopilot.commander import home_position
from autopilot.commander.arming_checks.checks import HealthAndArmingChecks
from autopilot.commander.auto_disarm import AutoDisarm, Reason
from autopilot.commander.command_results import (
    ACCEPTED,
    DENIED,
    FAILED,
    FIXED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
)
from autopilot.commander.custom_mode import nav_state_of
from autopilot.commander.failsafe import Action, Failsafe
from autopilot.commander.mode_names import MODE_NAMES
from autopilot.commander.user_mode_intention import UserModeIntention
from autopilot.commands import CommandResult
from autopilot.constants import NavState, Severity
from autopilot.dataman import Dataman
from autopilot.parameters import Parameters
from autopilot.topics import ActuatorArmed, CommandRecord, Topics, VehicleCommand, VehicleStatus
from sitl_emu.core import dialect as mavlink

Say = Callable[[Severity, str], None]
CHECKS_INTERVAL_US = 100_000
NAVIGATOR_COMMAND_LATENCY_US = 60_000
"""So that a mission that ends with a command ends first: its RTL item leads over HOLD to RTL."""
FORCE_ARM_MAGIC = 21196
KEPT_COMMANDS = 8
MAV_TYPE_GROUND_ROVER = 10
RPY_MANUAL_THROTTLE = frozenset((NavState.MANUAL, NavState.STAB, NavState.ACRO))
STICK_MODES = frozenset((NavState.ALTCTL, NavState.POSCTL, NavState.POSITION_SLOW, NavState.ALTITUDE_CRUISE))
THROTTLE_LOW = -0.8
THROTTLE_CENTRE = 0.2
BATTERY_EMERGENCY = 3
REASON_BY_COMMAND = 1
ONLY_AUTOPILOT = 1
"""MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: param1 1 reboots, 2 shuts down, 3 keeps it in the bootloader."""

STANDARD_MODES = {
    mavlink.MAV_STANDARD_MODE_POSITION_HOLD: NavState.POSCTL,
    mavlink.MAV_STANDARD_MODE_ORBIT: NavState.ORBIT,
    mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD: NavState.ALTCTL,
    mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY: NavState.AUTO_RTL,
    mavlink.MAV_STANDARD_MODE_MISSION: NavState.AUTO_MISSION,
    mavlink.MAV_STANDARD_MODE_LAND: NavState.AUTO_LAND,
    mavlink.MAV_STANDARD_MODE_TAKEOFF: NavState.AUTO_TAKEOFF,
}
ROVER_STANDARD_MODES = {
    mode: state
    for mode, state in STANDARD_MODES.items()
    if state not in (NavState.POSCTL, NavState.ORBIT, NavState.ALTCTL)
}


class Commander:
    """Writes vehicle_status, health_report, failsafe_flags, home_position, actuator_armed and vehicle_commands."""

    def __init__(self, topics: Topics, parameters: Parameters, dataman: Dataman, say: Say) -> None:
        """`say(severity, text)` tells the ground; the vehicle's type comes from MAV_TYPE."""
        self._topics = topics
        self._parameters = parameters
        self._dataman = dataman
        self._say = say
        self._rover = int(parameters["MAV_TYPE"]) == MAV_TYPE_GROUND_ROVER
        topics.vehicle_status = VehicleStatus(
            vehicle_type="rover" if self._rover else "multicopter", mav_type=int(parameters["MAV_TYPE"])
        )
        self._checks = HealthAndArmingChecks(topics, parameters, say)
        self._intention = UserModeIntention(self._checks, NavState.AUTO_LOITER)
        self._failsafe = Failsafe(parameters, self._on_failsafe)
        self._auto_disarm = AutoDisarm()
        self._handlers = self._command_handlers()
        self.COMMANDS = frozenset(self._handlers) | frozenset(FIXED)
        self._armed = False
        self._armed_us = 0
        self._takeoff_us = 0
        self._has_taken_off = False
        self._was_landed = True
        self._termination = False
        self._nav_state = NavState.AUTO_LOITER
        self._nav_state_us = 0
        self._battery_warning = 0
        self._gcs_lost = True
        self._checks_due_us = 0
        self._navigator_commands_seen = 0
        self._commands = 0
        self._actuator_speed_changed = False

    # --- the tick -------------------------------------------------------------------------------------------

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        topics = self._topics
        if now_us >= self._checks_due_us:
            self._run_checks(now_us)
        self._take_navigator_commands(now_us)
        self._follow_landing(now_us)
        self._leave_finished_modes()
        self._choose_nav_state(now_us)
        self._disarm_by_itself(now_us)
        self._update_home(now_us)
        topics.vehicle_status = self._vehicle_status(now_us)

    def _run_checks(self, now_us: int) -> None:
        self._checks_due_us = now_us + CHECKS_INTERVAL_US
        self._checks.update(now_us)
        flags = self._topics.failsafe_flags
        if flags.gcs_connection_lost != self._gcs_lost:
            self._gcs_lost = flags.gcs_connection_lost
            if not self._gcs_lost and self._gcs_ever_lost:
                self._say(Severity.INFO, "GCS connection regained\t")
            self._gcs_ever_lost = True
        if flags.battery_warning != self._battery_warning:
            self._battery_warning = flags.battery_warning
            if self._battery_warning >= BATTERY_EMERGENCY:
                self._say(Severity.CRITICAL, "System does not support shutdown\t")

    _gcs_ever_lost = False

    def _take_navigator_commands(self, now_us: int) -> None:
        for record in self._topics.navigator_commands:
            waits = now_us - record.timestamp < NAVIGATOR_COMMAND_LATENCY_US
            if record.number > self._navigator_commands_seen and not waits:
                self._navigator_commands_seen = record.number
                self.handle_command(now_us, record.command)

    def _follow_landing(self, now_us: int) -> None:
        landed = self._topics.vehicle_land_detected.landed
        if landed is not self._was_landed:
            self._was_landed = landed
            if self._armed:
                if landed:
                    self._say(Severity.INFO, "Landing detected\t")
                else:
                    self._say(Severity.INFO, "Takeoff detected\t")
                    self._takeoff_us = now_us
                    self._has_taken_off = True

    def _leave_finished_modes(self) -> None:
        """TAKEOFF ends in Hold; so does a mission that ends in the air."""
        result = self._topics.mission_result
        if not (self._armed and result.finished and result.timestamp >= self._nav_state_us):
            return
        nav_state = self._nav_state
        if nav_state is not self._intention.mode:
            return
        if nav_state in (NavState.AUTO_TAKEOFF, NavState.AUTO_VTOL_TAKEOFF) or (nav_state is NavState.AUTO_MISSION and not self._was_landed):
            self._intention.change(NavState.AUTO_LOITER, armed=True, force=True)

    def _choose_nav_state(self, now_us: int) -> None:
        topics = self._topics
        if self._termination:
            nav_state = NavState.TERMINATION
        else:
            nav_state = self._failsafe.update(
                now_us,
                armed=self._armed,
                user_mode=self._intention.mode,
                mode_changes=self._intention.changes,
                flags=topics.failsafe_flags,
                can_run_mode_flags=topics.health_report.can_run_mode_flags,
            )
            if self._failsafe.selected is Action.TERMINATE:
                self._termination = True
            elif self._failsafe.selected is Action.DISARM and self._armed:
                self._disarm("failsafe")
                nav_state = self._intention.mode
        if nav_state is not self._nav_state:
            self._nav_state = nav_state
            self._nav_state_us = now_us
            self._checks_due_us = 0

    def _disarm_by_itself(self, now_us: int) -> None:
        if not self._armed:
            return
        parameters = self._parameters
        reason = self._auto_disarm.update(
            now_us,
            armed=True,
            landed=self._was_landed,
            has_taken_off=self._has_taken_off,
            after_landing_s=float(parameters["COM_DISARM_LAND"]),
            preflight_s=float(parameters["COM_DISARM_PRFLT"]),
        )
        if reason is Reason.LANDING or reason is Reason.PREFLIGHT:
            self._disarm(reason.value)

    def _update_home(self, now_us: int) -> None:
        topics = self._topics
        home = topics.home_position
        if self._armed or home.manual_home or not self._parameters["COM_HOME_EN"]:
            return
        if now_us + CHECKS_INTERVAL_US == self._checks_due_us and (not home.valid or home_position.moved_away(topics)):
            topics.home_position = home_position.at_vehicle(now_us, topics) or home

    def _vehicle_status(self, now_us: int) -> VehicleStatus:
        flags = self._topics.failsafe_flags
        can_arm = self._checks.can_arm(self._nav_state)
        return VehicleStatus(
            now_us,
            self._armed,
            self._armed_us,
            self._takeoff_us,
            self._nav_state,
            self._intention.mode,
            self._nav_state_us,
            self._system_status(can_arm),
            self._failsafe.in_failsafe,
            False,
            self._termination,
            flags.gcs_connection_lost,
            flags.manual_control_signal_lost,
            can_arm,
            False,
            "rover" if self._rover else "multicopter",
            int(self._parameters["MAV_TYPE"]),
            self._arming_reason,
            self._disarming_reason,
        )

    _arming_reason = 0
    _disarming_reason = 0

    def _system_status(self, can_arm: bool) -> int:
        if self._termination:
            return mavlink.MAV_STATE_FLIGHT_TERMINATION
        if self._armed:
            return mavlink.MAV_STATE_CRITICAL if self._failsafe.in_failsafe else mavlink.MAV_STATE_ACTIVE
        return mavlink.MAV_STATE_STANDBY if can_arm else mavlink.MAV_STATE_UNINIT

    def _on_failsafe(self, action: Action, hold_s: int) -> None:
        if hold_s:
            self._say(Severity.CRITICAL, f"Failsafe activated: entering Hold for {hold_s} seconds\t")
        else:
            self._say(Severity.CRITICAL, "Failsafe activated\t")

    # --- arming ---------------------------------------------------------------------------------------------

    def _arm(self, now_us: int, *, forced: bool) -> int:
        if self._armed:
            return ACCEPTED
        if not forced:
            refusal = self._arming_refusal(now_us)
            if refusal is not None:
                self._say(Severity.CRITICAL, f"Arming denied: {refusal}\t")
                return TEMPORARILY_REJECTED
        topics = self._topics
        self._armed = True
        self._armed_us = now_us
        self._takeoff_us = 0
        self._has_taken_off = not topics.vehicle_land_detected.landed
        self._was_landed = topics.vehicle_land_detected.landed
        self._arming_reason = REASON_BY_COMMAND
        topics.actuator_armed = ActuatorArmed(True, False, False)
        if not topics.home_position.manual_home and self._parameters["COM_HOME_EN"]:
            topics.home_position = home_position.at_vehicle(now_us, topics) or topics.home_position
        self._say(Severity.INFO, "Armed by external command\t")
        return ACCEPTED

    def _arming_refusal(self, now_us: int) -> str | None:
        self._run_checks(now_us)
        mode = self._intention.mode
        if not self._checks.can_arm(mode):
            return "Resolve system health failures first"
        sticks = self._topics.manual_control_setpoint
        if mode in STICK_MODES and sticks.throttle > THROTTLE_CENTRE:
            return "throttle above center"
        if mode in RPY_MANUAL_THROTTLE and not self._rover and sticks.throttle > THROTTLE_LOW:
            return "high throttle"
        return None

    def _disarm(self, by: str) -> None:
        topics = self._topics
        self._armed = False
        self._disarming_reason = REASON_BY_COMMAND
        topics.actuator_armed = ActuatorArmed(False, self._termination, False)
        self._auto_disarm = AutoDisarm()
        self._has_taken_off = False
        self._takeoff_us = 0
        self._intention.on_disarm()
        self._say(Severity.INFO, f"Disarmed by {by}\t")

    # --- commands -------------------------------------------------------------------------------------------

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide on one of COMMANDS; None gives no ack."""
        handler = self._handlers.get(command.command)
        result = handler(now_us, command) if handler is not None else FIXED[command.command]
        return None if result is None else CommandResult(result)

    def _command_handlers(self) -> dict[int, Callable[[int, VehicleCommand], int | None]]:
        return {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._component_arm_disarm,
            mavlink.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mavlink.MAV_CMD_DO_SET_STANDARD_MODE: self._do_set_standard_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._nav_takeoff,
            mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: self._nav_vtol_takeoff,
            mavlink.MAV_CMD_NAV_LAND: self._nav_land,
            mavlink.MAV_CMD_NAV_LAND_LOCAL: self._nav_precland,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._nav_return_to_launch,
            mavlink.MAV_CMD_MISSION_START: self._mission_start,
            mavlink.MAV_CMD_DO_REPOSITION: self._do_reposition,
            mavlink.MAV_CMD_DO_ORBIT: self._do_orbit,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._pass_on,
            mavlink.MAV_CMD_DO_SET_HOME: self._do_set_home,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._do_flighttermination,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_prearm_checks,
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._preflight_calibration,
            mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._preflight_storage,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._preflight_reboot_shutdown,
            mavlink.MAV_CMD_DO_SET_ROI: self._pass_on,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._pass_on,
            mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: self._pass_on,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._pass_on,
            mavlink.MAV_CMD_INJECT_FAILURE: self._inject_failure,
            mavlink.MAV_CMD_FIXED_MAG_CAL_YAW: self._fixed_mag_cal_yaw,
            mavlink.MAV_CMD_DO_GRIPPER: self._do_gripper,
            mavlink.MAV_CMD_ACTUATOR_TEST: self._actuator_test,
            mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE: self._do_autotune,
            ACTUATOR_GROUP_TEST: self._actuator_group_test,
            ESTIMATOR_SENSOR_ENABLE: self._estimator_sensor_enable,
        }

    def _change_mode(self, mode: NavState, now_us: int) -> bool:
        self._run_checks(now_us)
        if self._intention.change(mode, armed=self._armed):
            self._checks_due_us = 0
            return True
        self._say(Severity.CRITICAL, f"Switching to {MODE_NAMES[mode]} is currently not available\t")
        return False

    def _change_mode_result(self, mode: NavState, now_us: int) -> int:
        return ACCEPTED if self._change_mode(mode, now_us) else TEMPORARILY_REJECTED

    def _publish(self, now_us: int, command: VehicleCommand) -> None:
        self._commands += 1
        record = CommandRecord(self._commands, now_us, command)
        self._topics.vehicle_commands = (*self._topics.vehicle_commands[1 - KEPT_COMMANDS :], record)

    def _pass_on(self, now_us: int, command: VehicleCommand) -> int:
        self._publish(now_us, command)
        return ACCEPTED

    def _component_arm_disarm(self, now_us: int, command: VehicleCommand) -> int | None:
        wanted = math.floor(command.param1 + 0.5) if math.isfinite(command.param1) else -1
        if wanted not in (0, 1):
            self._say(Severity.CRITICAL, f"Unsupported ARM_DISARM param: {command.param1:.3f}\t")
            return None
        forced = command.param2 == FORCE_ARM_MAGIC
        if wanted:
            return self._arm(now_us, forced=forced)
        if not self._armed:
            return ACCEPTED
        land_detected = self._topics.vehicle_land_detected
        if not (forced or land_detected.landed or land_detected.maybe_landed or self._rover or self._termination):
            self._say(Severity.CRITICAL, "Disarming denied: not landed\t")
            return TEMPORARILY_REJECTED
        self._disarm("external command")
        return ACCEPTED

    def _do_set_mode(self, now_us: int, command: VehicleCommand) -> int:
        if not math.isfinite(command.param1) or not int(command.param1) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return TEMPORARILY_REJECTED
        main, sub = (int(value) if math.isfinite(value) else 0 for value in (command.param2, command.param3))
        mode = nav_state_of(main, sub)
        return TEMPORARILY_REJECTED if mode is None else self._change_mode_result(mode, now_us)

    def _do_set_standard_mode(self, now_us: int, command: VehicleCommand) -> int:
        modes = ROVER_STANDARD_MODES if self._rover else STANDARD_MODES
        mode = modes.get(int(command.param1)) if math.isfinite(command.param1) else None
        return FAILED if mode is None else self._change_mode_result(mode, now_us)

    def _nav_takeoff(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.AUTO_TAKEOFF, now_us)
        if result == ACCEPTED:
            self._publish(now_us, command)
        return result

    def _nav_vtol_takeoff(self, now_us: int, command: VehicleCommand) -> int:
        return self._change_mode_result(NavState.AUTO_VTOL_TAKEOFF, now_us)

    def _nav_land(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.AUTO_LAND, now_us)
        if result == ACCEPTED:
            self._say(Severity.INFO, "Landing at current position\t")
        return result

    def _nav_precland(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.AUTO_PRECLAND, now_us)
        if result == ACCEPTED:
            self._say(Severity.INFO, "Precision landing\t")
        return result

    def _nav_return_to_launch(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.AUTO_RTL, now_us)
        if result == ACCEPTED:
            self._say(Severity.INFO, "Returning to launch\t")
        return result

    def _mission_start(self, now_us: int, command: VehicleCommand) -> int:
        self._run_checks(now_us)
        if self._topics.failsafe_flags.auto_mission_missing:
            self._say(Severity.CRITICAL, "Mission start denied! No valid mission\t")
            return DENIED
        first, last = command.param1, command.param2
        if first == 0.0 and (last == 0.0 or last >= len(self._dataman.mission.items) - 1):
            if not self._change_mode(NavState.AUTO_MISSION, now_us):
                return TEMPORARILY_REJECTED
            return self._arm(now_us, forced=False)
        return DENIED

    def _do_reposition(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.AUTO_LOITER, now_us)
        if result == ACCEPTED:
            self._publish(now_us, command)
        return result

    def _do_orbit(self, now_us: int, command: VehicleCommand) -> int:
        result = self._change_mode_result(NavState.ORBIT, now_us)
        if result == ACCEPTED:
            self._publish(now_us, command)
        return result

    def _do_set_home(self, now_us: int, command: VehicleCommand) -> int:
        topics = self._topics
        if command.param1 > 0.5:
            home = home_position.at_vehicle(now_us, topics, manual_home=True)
        else:
            yaw = math.radians(command.param4) if math.isfinite(command.param4) else 0.0
            home = home_position.at_place(now_us, topics, command.param5, command.param6, command.param7, yaw)
        if home is None:
            return TEMPORARILY_REJECTED
        topics.home_position = home
        return ACCEPTED

    def _do_flighttermination(self, now_us: int, command: VehicleCommand) -> int:
        if not command.param1 > 0.5:
            return DENIED
        if self._armed and not self._termination:
            self._termination = True
            self._say(Severity.CRITICAL, "Failsafe activated\t")
            self._checks_due_us = 0
        return ACCEPTED

    def _run_prearm_checks(self, now_us: int, command: VehicleCommand) -> int:
        if self._armed:
            return TEMPORARILY_REJECTED
        self._run_checks(now_us)
        return ACCEPTED

    def _preflight_calibration(self, now_us: int, command: VehicleCommand) -> int:
        if self._armed:
            return TEMPORARILY_REJECTED
        name = _calibration(command)
        if name is None:
            return UNSUPPORTED
        if name:
            self._say(Severity.INFO, f"[cal] calibration started: 2 {name}")
        return ACCEPTED

    def _preflight_storage(self, now_us: int, command: VehicleCommand) -> int | None:
        if self._armed:
            return TEMPORARILY_REJECTED
        action = int(command.param1) if math.isfinite(command.param1) else -1
        return ACCEPTED if action in range(5) else None

    def _preflight_reboot_shutdown(self, now_us: int, command: VehicleCommand) -> int:
        autopilot = int(command.param1) if math.isfinite(command.param1) else 0
        if autopilot == 0:
            return ACCEPTED
        if self._armed or autopilot not in (1, 2):
            return DENIED
        self._publish(now_us, command)
        return ACCEPTED

    def _inject_failure(self, now_us: int, command: VehicleCommand) -> int:
        if not self._parameters["SYS_FAILURE_EN"]:
            return DENIED
        self._publish(now_us, command)
        return ACCEPTED

    def _fixed_mag_cal_yaw(self, now_us: int, command: VehicleCommand) -> int:
        if self._armed:
            return TEMPORARILY_REJECTED
        heading = command.param1 if math.isfinite(command.param1) else 0.0
        self._say(Severity.INFO, f"Assuming vehicle is facing heading {heading:.1f} degrees")
        return ACCEPTED

    def _do_gripper(self, now_us: int, command: VehicleCommand) -> int:
        return ACCEPTED if command.param1 >= 1.0 or self._armed else TEMPORARILY_REJECTED

    def _actuator_test(self, now_us: int, command: VehicleCommand) -> int | None:
        return DENIED if self._armed else None

    def _actuator_group_test(self, now_us: int, command: VehicleCommand) -> int | None:
        return None if self._rover else TEMPORARILY_REJECTED

    def _do_autotune(self, now_us: int, command: VehicleCommand) -> int:
        return DENIED

    def _estimator_sensor_enable(self, now_us: int, command: VehicleCommand) -> int:
        return ACCEPTED if command.param1 in (0.0, 1.0, 2.0, 3.0, 4.0) else UNSUPPORTED


ACTUATOR_GROUP_TEST = 309
ESTIMATOR_SENSOR_ENABLE = 43006


def _calibration(command: VehicleCommand) -> str | None:
    """What PREFLIGHT_CALIBRATION asks for, in PX4's words; "" for nothing, None for what PX4 does not know."""
    asked = [
        int(value) if math.isfinite(value) else 0
        for value in (
            command.param1,
            command.param2,
            command.param3,
            command.param4,
            command.param5,
            command.param6,
            command.param7,
        )
    ]
    if not any(asked):
        return ""
    known = {(0, 1): "gyro", (1, 1): "mag", (4, 1): "accel", (4, 2): "level", (4, 4): "accel", (5, 1): "airspeed"}
    return next((known[pair] for pair in enumerate(asked) if pair in known), None)
