"""The commands that the commander decides on, one function each, named as the command.

PX4's Commander::handle_command (v1.18). A command that changes the mode is answered by whether the mode can be flown;
on the ground every mode can be chosen. What the navigator, a flight mode or the simulator has to do with an accepted
command, it finds in topics.vehicle_commands.
"""

import math
from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander import home_position
from sitl_emu.autopilot.commander.arming import EXTERNAL_COMMAND, INTERNAL_COMMAND, MISSION_START, Arming
from sitl_emu.autopilot.commander.arming_checks.checks import HealthAndArmingChecks
from sitl_emu.autopilot.commander.calibration.worker import CalibrationWorker
from sitl_emu.autopilot.commander.command_results import (
    ACCEPTED,
    CANCELLED,
    DENIED,
    FAILED,
    TEMPORARILY_REJECTED,
)
from sitl_emu.autopilot.commander.custom_mode import (
    FLAG_CUSTOM_MODE_ENABLED,
    custom_mode_of,
    nav_state_of,
    nav_state_of_base_mode,
)
from sitl_emu.autopilot.commander.user_mode_intention import UserModeIntention
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.table import FIXED
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later, nearest
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, MAIN_AUTO
from sitl_emu.autopilot.navigator.mission_legs import landing_of
from sitl_emu.autopilot.parameters import Parameters, matches
from sitl_emu.autopilot.parameters.storage import ParameterStorage
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import ActuatorSet, ActuatorTest, CommandRecord, Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

Handler = Callable[[int, VehicleCommand], int | None]
FORCE_MAGIC: Final = 21196
LEAST_INT: Final = -(1 << 31)
KEPT_COMMANDS: Final = 8
REFUSALS_APART_US: Final = 1_000_000
"""A mode refused sooner after another is not said, as on PX4."""
MISSION_START_DENIED: Final = "commander_mission_start_denied_no_mission"
MAVLINK_MOTORS, MAVLINK_SERVOS = range(1, 13), range(33, 48)
"""ACTUATOR_OUTPUT_FUNCTION, as far as PX4 tests them (MAX_NUM_MOTORS and MAX_NUM_SERVOS of msg/ActuatorTest.msg)."""
OWN_FUNCTIONS: Final = 1000
LONGEST_ACTUATOR_TEST_MS: Final = 3000
STORAGE_ACTIONS = range(5)
LOAD: Final = 0
RESET_CONFIGURATION: Final = 2
RESET_SENSORS: Final = 3
RESET_ALL: Final = 4
KEPT_COUNTERS = ("LND_FLIGHT_T_HI", "LND_FLIGHT_T_LO", "COM_FLIGHT_UUID")
SENSOR_CALIBRATION = ("CAL_ACC*", "CAL_GYRO*", "CAL_MAG*")
REBOOT_OR_SHUTDOWN = (1, 2)
SHUTDOWN: Final = 2.0
SAFETY_SWITCH_STATES = (0, 1)
"""MAVLink's SAFETY_SWITCH_STATE."""
MISSION_PLANNER: int = mavlink.MAV_COMP_ID_MISSIONPLANNER

STANDARD_MODES = {mode.standard_mode: state for state, mode in FLIGHT_MODES.items() if mode.standard_mode}


class CommandHandlers:
    """Writes vehicle_commands, and home by DO_SET_HOME."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        dataman: Dataman,
        checks: HealthAndArmingChecks,
        intention: UserModeIntention,
        arming: Arming,
        calibration: CalibrationWorker,
        outgoing: OutgoingCommands,
        say: Say,
        traits: Traits,
        *,
        storage: ParameterStorage | None = None,
    ) -> None:
        """Own commands go to `outgoing`; `storage` saves and loads parameters: without it there is none."""
        self._topics = topics
        self._parameters = parameters
        self._dataman = dataman
        self._checks = checks
        self._intention = intention
        self._arming = arming
        self._calibration = calibration
        self._outgoing = outgoing
        self._storage = storage
        self._say = say
        self._traits = traits
        self._published = 0
        self._refused_us = -REFUSALS_APART_US
        self._awaits_leave: VehicleCommand | None = None
        """An arming command that is answered when somebody has said whether it may."""
        self._handlers = self._by_number()
        self.commands = frozenset(self._handlers) | frozenset(FIXED)
        """Those of which the commander says something, and those that nobody else answers."""

    def _by_number(self) -> dict[int, Handler]:
        return {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._component_arm_disarm,
            mavlink.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mavlink.MAV_CMD_DO_SET_STANDARD_MODE: self._do_set_standard_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._nav_takeoff,
            mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: self._nav_vtol_takeoff,
            mavlink.MAV_CMD_NAV_LAND: self._nav_land,
            mavlink.MAV_CMD_NAV_LAND_LOCAL: self._nav_land_local,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._nav_return_to_launch,
            mavlink.MAV_CMD_MISSION_START: self._mission_start,
            mavlink.MAV_CMD_DO_REPOSITION: self._do_reposition,
            mavlink.MAV_CMD_DO_ORBIT: self._do_orbit,
            mavlink.MAV_CMD_DO_FIGURE_EIGHT: self._do_figure_eight,
            mavlink.MAV_CMD_DO_CHANGE_ALTITUDE: self._do_change_altitude,
            mavlink.MAV_CMD_GUIDED_CHANGE_HEADING: self._guided_change_heading,
            mavlink.MAV_CMD_DO_LAND_START: self._do_land_start,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._leave_to_navigator,
            mavlink.MAV_CMD_NAV_ROI: self._leave_to_navigator,
            mavlink.MAV_CMD_DO_SET_ROI: self._leave_to_navigator,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._leave_to_navigator,
            mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: self._leave_to_navigator,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._leave_to_navigator,
            mavlink.MAV_CMD_CONTROL_HIGH_LATENCY: self._control_high_latency,
            mavlink.MAV_CMD_DO_SET_HOME: self._do_set_home,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._do_flighttermination,
            mavlink.MAV_CMD_DO_SET_SAFETY_SWITCH_STATE: self._do_set_safety_switch_state,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_prearm_checks,
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._preflight_calibration,
            mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._preflight_storage,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._preflight_reboot_shutdown,
            mavlink.MAV_CMD_FIXED_MAG_CAL_YAW: self._fixed_mag_cal_yaw,
            mavlink.MAV_CMD_ACTUATOR_TEST: self._actuator_test,
            mavlink.MAV_CMD_DO_SET_ACTUATOR: self._do_set_actuator,
        }

    def handle(self, now_us: int, command: VehicleCommand) -> int | None:
        """MAV_RESULT of one of `commands`; None for no ack."""
        self._calibration.hear(now_us, command)
        handler = self._handlers.get(command.command)
        return FIXED[command.command] if handler is None else handler(now_us, command)

    # --- helpers --------------------------------------------------------------------------------------------

    def change_mode(self, now_us: int, mode: NavState, *, force: bool = False) -> int:
        """MAV_RESULT of asking for a mode; a refusal is said."""
        if self._intend(now_us, mode, force=force):
            return ACCEPTED
        self._tell_refusal(now_us, mode)
        return TEMPORARILY_REJECTED

    def _intend(self, now_us: int, mode: NavState, *, force: bool = False) -> bool:
        """Whether a mode may be asked for, by what the checks have found last; `force`: though it can't be flown."""
        arming = self._arming
        return not arming.terminated and self._intention.change(mode, armed=arming.armed, force=force)

    def _tell_refusal(self, now_us: int, mode: NavState) -> None:
        """At most every second."""
        if now_us - self._refused_us > REFUSALS_APART_US:
            self._refused_us = now_us
            row = FLIGHT_MODES[mode]
            text = f"Switching to {row.name} is currently not available\t"
            numbers = custom_mode_of(mode), row.event_number
            self._say(Severity.CRITICAL, text, "commander_modeswitch_not_avail", *numbers)

    def _change_mode_and_tell(self, now_us: int, mode: NavState, text: str, event: str, *, force: bool = False) -> int:
        result = self.change_mode(now_us, mode, force=force)
        if result == ACCEPTED:
            self._say(Severity.INFO, text, event)
        return result

    def _change_mode_and_pass_on(self, now_us: int, mode: NavState, command: VehicleCommand) -> int:
        """The navigator hears of a command whose mode is refused, too: PX4's modules take no notice of each other."""
        result = self.change_mode(now_us, mode)
        self._pass_on(now_us, command)
        return result

    def _pass_on(self, now_us: int, command: VehicleCommand) -> int:
        self._published += 1
        record = CommandRecord(self._published, now_us, command)
        self._topics.vehicle_commands = (*self._topics.vehicle_commands[1 - KEPT_COMMANDS :], record)
        return ACCEPTED

    def _leave_to_navigator(self, now_us: int, command: VehicleCommand) -> None:
        """The navigator answers, when it takes it."""
        self._pass_on(now_us, command)

    # --- arming ---------------------------------------------------------------------------------------------

    def _component_arm_disarm(self, now_us: int, command: VehicleCommand) -> int | None:
        wanted, forced = _int8(command.param1), nearest(command.param2) == FORCE_MAGIC
        by = EXTERNAL_COMMAND if command.from_external else INTERNAL_COMMAND
        if wanted == 1:
            # from outside the checks can't be gone round
            result = self._arming.arm(now_us, forced=forced and not command.from_external, by=by)
            self._awaits_leave = command if result is None else None
            return result
        if wanted == 0:
            return self._arming.disarm_by_command(now_us, forced=forced, by=by)
        text = f"Unsupported ARM_DISARM param: {command.param1:.3f}\t"
        self._say(Severity.CRITICAL, text, "commander_unsupported_arm_disarm_param", command.param1)
        return None

    def arm_with_leave(self, now_us: int) -> None:
        """Carry out, or reject, an arming command that waited for somebody's leave."""
        result, command = self._arming.settle(now_us), self._awaits_leave
        if result is None or command is None:
            return
        self._awaits_leave = None
        if result != ACCEPTED and command.command == mavlink.MAV_CMD_MISSION_START:
            self._tell_refusal(now_us, NavState.AUTO_MISSION)
        answer_later(self._topics, command, CommandResult(result))

    def _run_prearm_checks(self, now_us: int, command: VehicleCommand) -> int:
        self._checks.update(now_us, force_report=True)
        return ACCEPTED

    def _do_flighttermination(self, now_us: int, command: VehicleCommand) -> int:
        if not command.param1 > 0.5 or not self._arming.armed:
            return DENIED
        return ACCEPTED if self._intend(now_us, NavState.TERMINATION) else TEMPORARILY_REJECTED

    def _do_set_safety_switch_state(self, now_us: int, command: VehicleCommand) -> int:
        """There is no such switch in simulation, so nothing depends on it."""
        if self._arming.armed:
            return TEMPORARILY_REJECTED
        return ACCEPTED if _int(command.param1) in SAFETY_SWITCH_STATES else FAILED

    # --- modes ----------------------------------------------------------------------------------------------

    def _do_set_mode(self, now_us: int, command: VehicleCommand) -> int:
        """LAND may always be asked for: who does wants to come down. PX4 tells a refusal to a ground station alone."""
        flags, main, sub = (_uint8(value) for value in (command.param1, command.param2, command.param3))
        if flags & FLAG_CUSTOM_MODE_ENABLED:
            mode, kind = nav_state_of(main, sub), "auto" if main == MAIN_AUTO else "main"
        else:
            mode, kind = nav_state_of_base_mode(flags), "base"
        if mode is None:
            self._say(Severity.CRITICAL, f"Unsupported {kind} mode\t", f"commander_unsupported_{kind}_mode")
            return TEMPORARILY_REJECTED
        if self._intend(now_us, mode, force=mode is NavState.AUTO_LAND):
            return ACCEPTED
        if command.from_external and command.source_component == MISSION_PLANNER:
            self._tell_refusal(now_us, mode)
        return TEMPORARILY_REJECTED

    def _do_set_standard_mode(self, now_us: int, command: VehicleCommand) -> int:
        mode = STANDARD_MODES.get(nearest(command.param1))
        if mode is None or mode in self._traits.no_standard_modes:
            return FAILED
        return ACCEPTED if self._intend(now_us, mode) else TEMPORARILY_REJECTED

    def _nav_takeoff(self, now_us: int, command: VehicleCommand) -> int:
        return self._change_mode_and_pass_on(now_us, NavState.AUTO_TAKEOFF, command)

    def _nav_vtol_takeoff(self, now_us: int, command: VehicleCommand) -> int:
        return self._change_mode_and_pass_on(now_us, NavState.AUTO_VTOL_TAKEOFF, command)

    def _nav_land(self, now_us: int, command: VehicleCommand) -> int:
        text, event = "Landing at current position\t", "commander_landing_current_pos"
        return self._change_mode_and_tell(now_us, NavState.AUTO_LAND, text, event, force=True)

    def _nav_land_local(self, now_us: int, command: VehicleCommand) -> int:
        text = "Precision landing\t"
        return self._change_mode_and_tell(now_us, NavState.AUTO_PRECLAND, text, "commander_landing_prec_land")

    def _nav_return_to_launch(self, now_us: int, command: VehicleCommand) -> int:
        return self._change_mode_and_tell(now_us, NavState.AUTO_RTL, "Returning to launch\t", "commander_rtl")

    def _do_reposition(self, now_us: int, command: VehicleCommand) -> int:
        """Without MAV_DO_REPOSITION_FLAGS_CHANGE_MODE it is for who is in HOLD already."""
        flown = self._topics.vehicle_status.nav_state
        if _whole(command.param2) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE:
            nowhere = not (math.isfinite(command.param5) and math.isfinite(command.param6))
            stays = flown is NavState.GUIDED_COURSE and nowhere
            return self._change_mode_and_pass_on(now_us, flown if stays else NavState.AUTO_LOITER, command)
        if flown is not NavState.AUTO_LOITER:
            return DENIED
        return self._pass_on(now_us, command)

    def _do_change_altitude(self, now_us: int, command: VehicleCommand) -> int:
        """It chooses no mode: for who is in one that keeps an altitude."""
        if self._topics.vehicle_status.nav_state not in (NavState.AUTO_LOITER, NavState.GUIDED_COURSE):
            return TEMPORARILY_REJECTED
        return self._pass_on(now_us, command)

    def _do_orbit(self, now_us: int, command: VehicleCommand) -> int:
        if self._intend(now_us, NavState.ORBIT):
            return self._pass_on(now_us, command)
        self._say(Severity.CRITICAL, "Orbit command rejected")
        return TEMPORARILY_REJECTED

    def _do_figure_eight(self, now_us: int, command: VehicleCommand) -> None:
        """For a fixed wing; PX4 says so and does not answer."""
        self._say(Severity.CRITICAL, "Figure 8 command only available for fixed wing and vtol vehicles.")

    def _guided_change_heading(self, now_us: int, command: VehicleCommand) -> int | None:
        """For a fixed wing in COURSE."""
        return DENIED if self._arming.armed else None

    def _mission_start(self, now_us: int, command: VehicleCommand) -> int | None:
        if self._topics.failsafe_flags.auto_mission_missing:
            self._say(Severity.CRITICAL, "Mission start denied! No valid mission\t", MISSION_START_DENIED)
            return DENIED
        if not -1.0 <= command.param1 < len(self._dataman.mission.items):
            return DENIED
        if command.param1 >= 0.0:
            self._pass_on(now_us, command)
        result: int | None = self.change_mode(now_us, NavState.AUTO_MISSION)
        if result == ACCEPTED:
            result = self._arming.arm(now_us, by=MISSION_START)
            self._awaits_leave = command if result is None else None
            if result == TEMPORARILY_REJECTED:
                self._tell_refusal(now_us, NavState.AUTO_MISSION)
        return result

    def _do_land_start(self, now_us: int, command: VehicleCommand) -> int:
        """Go on with the mission where its landing begins.

        In PX4 it is the navigator that knows where, and gives MISSION_START to the commander; so the links have it too.
        """
        landing = landing_of(self._dataman.mission.items) if self._topics.mission_result.valid else None
        if landing is None:
            return CANCELLED
        own = int(self._parameters["MAV_SYS_ID"])
        params = (float(landing.start), *(0.0,) * 6)
        start = VehicleCommand(mavlink.MAV_CMD_MISSION_START, *params, target_system=own, from_external=False)
        self._outgoing.give(start)
        self._mission_start(now_us, start)
        return ACCEPTED

    # --- the rest -------------------------------------------------------------------------------------------

    def _do_set_home(self, now_us: int, command: VehicleCommand) -> int:
        if not self._parameters["COM_HOME_EN"]:
            return DENIED
        topics = self._topics
        if command.param1 > 0.5:
            home = home_position.at_vehicle(now_us, topics, int(self._parameters["EKF2_GPS_CTRL"]))
        elif all(map(math.isfinite, (command.param5, command.param6, command.param7))):
            roll, pitch, yaw = (math.radians(value) % (2.0 * math.pi) for value in command[2:5])
            home = home_position.at_place(now_us, topics, command.param5, command.param6, command.param7, yaw)
            if home is not None:
                level = (value if math.isfinite(value) else 0.0 for value in (roll, pitch))
                home = home._replace(roll=next(level), pitch=next(level))
        else:
            return DENIED
        if home is None:
            return TEMPORARILY_REJECTED
        topics.home_position = home
        return ACCEPTED

    def _control_high_latency(self, now_us: int, command: VehicleCommand) -> int:
        """There is no such link."""
        text = "Control high latency failed! Telemetry unavailable\t"
        self._say(Severity.CRITICAL, text, "commander_ctrl_high_latency_failed")
        return FAILED

    def _preflight_calibration(self, now_us: int, command: VehicleCommand) -> int | None:
        return self._calibration.preflight_calibration(now_us, command, armed=self._arming.armed)

    def _preflight_storage(self, now_us: int, command: VehicleCommand) -> int | None:
        """0 load, 1 save, 2 reset the configuration, 3 the sensors' calibration, 4 everything."""
        if self._arming.armed or self._calibration.busy:
            return TEMPORARILY_REJECTED
        action = _int(command.param1)
        if action not in STORAGE_ACTIONS:
            return None
        parameters, storage = self._parameters, self._storage
        if action == RESET_CONFIGURATION:
            parameters.reset(lambda name: name not in KEPT_COUNTERS)
        elif action == RESET_SENSORS:
            parameters.reset(lambda name: matches(name, SENSOR_CALIBRATION))
        elif action == RESET_ALL:
            parameters.reset()
        if storage is not None:
            _ = storage.load() if action == LOAD else storage.save()
        return ACCEPTED

    def _preflight_reboot_shutdown(self, now_us: int, command: VehicleCommand) -> int:
        action = _int(command.param1)
        if action == 0:
            return ACCEPTED
        if self._arming.armed or action not in REBOOT_OR_SHUTDOWN:
            return DENIED
        return self._pass_on(now_us, command)

    def shut_down(self, now_us: int) -> None:
        """As by PREFLIGHT_REBOOT_SHUTDOWN."""
        self._pass_on(now_us, VehicleCommand(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, SHUTDOWN, *(0.0,) * 6))

    def _fixed_mag_cal_yaw(self, now_us: int, command: VehicleCommand) -> int:
        return self._calibration.fixed_mag_cal_yaw(now_us, command, armed=self._arming.armed)

    def _actuator_test(self, now_us: int, command: VehicleCommand) -> int | None:
        """param1 value, param2 seconds, param5 ACTUATOR_OUTPUT_FUNCTION, or 1000 more than PX4's own.

        A function has the 16 bits of actuator_test: a negative one is a large one, of no output.
        """
        if self._arming.armed:
            return DENIED
        function = _output_function(nearest(command.param5) % (1 << 16))
        if function is None:
            return None
        seconds = command.param2 if math.isfinite(command.param2) else 0.0
        timeout_us = max(0, min(round(seconds * 1e3), LONGEST_ACTUATOR_TEST_MS)) * 1000
        self._topics.actuator_test = ActuatorTest(now_us, function, command.param1, timeout_us)
        return ACCEPTED

    def _do_set_actuator(self, now_us: int, command: VehicleCommand) -> int:
        """param1 to param6: -1..1 each, NaN leaves one as it is; only the first set (param7 0) exists."""
        if _int(command.param7 + 0.5) == 0:
            asked = (command.param1, command.param2, command.param3, command.param4, command.param5, command.param6)
            pairs = zip(asked, self._topics.actuator_set.values, strict=True)
            self._topics.actuator_set = ActuatorSet(tuple(new if math.isfinite(new) else old for new, old in pairs))
        return ACCEPTED


def _output_function(number: int) -> int | None:
    """PX4's output function of an ACTUATOR_OUTPUT_FUNCTION; None (and no ack) for one that PX4 cannot test."""
    if number >= OWN_FUNCTIONS:
        return number - OWN_FUNCTIONS
    if number in MAVLINK_MOTORS:
        return 100 + number
    return number - MAVLINK_SERVOS.start + 201 if number in MAVLINK_SERVOS else None


def _int(value: float) -> int:
    """As C converts to int: the whole part, and what is none is the least number."""
    return int(value) if abs(value) <= -LEAST_INT else LEAST_INT


def _int8(value: float) -> int:
    """The nearest whole number in the eight bits that PX4 has for an arming action."""
    return (nearest(value) + 128) % 256 - 128


def _uint8(value: float) -> int:
    """The whole part in the eight bits that PX4 has for the parts of a mode; 0 for what is none."""
    return _whole(value) % 256


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) else 0
