"""Who is in charge: runs the checks, follows landing and takeoff, chooses the mode that is flown, says how things are.

PX4's Commander (src/modules/commander/Commander.cpp, v1.18).

Left out: VTOL, rebooting (answered; restarting is the process's business), the safety switch that simulation lacks.
"""

from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander import home_position
from sitl_emu.autopilot.commander.arm_authorization import ArmAuthorization
from sitl_emu.autopilot.commander.arming import MISSION_START, Arming
from sitl_emu.autopilot.commander.arming_checks.checks import HealthAndArmingChecks
from sitl_emu.autopilot.commander.auto_disarm import AutoDisarm
from sitl_emu.autopilot.commander.calibration.worker import CalibrationWorker
from sitl_emu.autopilot.commander.command_handlers import CommandHandlers
from sitl_emu.autopilot.commander.command_results import ACCEPTED, UNSUPPORTED
from sitl_emu.autopilot.commander.control_mode import control_mode
from sitl_emu.autopilot.commander.data_links import DataLinks, present_and_healthy
from sitl_emu.autopilot.commander.failsafe import Failsafe
from sitl_emu.autopilot.commander.failsafe_events import failsafe_event, failsafe_severity
from sitl_emu.autopilot.commander.failsafe_framework import Action, Notice
from sitl_emu.autopilot.commander.failure_detector import FailureDetector
from sitl_emu.autopilot.commander.home_altitude import HomeAltitude
from sitl_emu.autopilot.commander.pilot import Pilot
from sitl_emu.autopilot.commander.throw_launch import ThrowLaunch
from sitl_emu.autopilot.commander.user_mode_intention import UserModeIntention, boot_mode
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.texts import Note, Say, SendEvent
from sitl_emu.autopilot.flight_mode import FLOWN_BY_STICKS
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters.storage import ParameterStorage
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import Topics, VehicleCommand, VehicleStatus
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

CHECKS_INTERVAL_US: Final = 100_000
"""At least: with a run every 12 ms they come every 108."""
STATUS_INTERVAL_US: Final = 500_000
"""Commander::run: vehicle_status is published at 2 Hz, and at once when something has changed."""
BATTERY_EMERGENCY: Final = 3
OFF_AFTER_US: Final = 60_000_000
"""Commander::battery_status_check."""
NEVER_US: Final = 1 << 62
SAFETY_BREAKER: Final = 22027
"""CBRK_IO_SAFETY: the safety button is out of the way."""
HOLD_NO_FAILSAFE: Final = 7
"""NAV_RCL_ACT."""
ARMED_ON_BOOT_AFTER_US: Final = 5_000_000
"""Commander::run."""
PREARM_DISABLED: Final = 0
PREARM_BY_SAFETY_BUTTON: Final = 1
PREARMED_AFTER_US: Final = 5_000_000
STATE_UNINIT: int = mavlink.MAV_STATE_UNINIT
STATE_CALIBRATING: int = mavlink.MAV_STATE_CALIBRATING
STATE_STANDBY: int = mavlink.MAV_STATE_STANDBY
STATE_ACTIVE: int = mavlink.MAV_STATE_ACTIVE
STATE_CRITICAL: int = mavlink.MAV_STATE_CRITICAL
STATE_FLIGHT_TERMINATION: int = mavlink.MAV_STATE_FLIGHT_TERMINATION


class Commander:
    """Writes vehicle_status, health_report, failsafe_flags, home_position, actuator_armed and vehicle_commands."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        dataman: Dataman,
        say: Say,
        send_event: SendEvent,
        storage: ParameterStorage | None = None,
        outgoing: OutgoingCommands | None = None,
        say_as: Callable[[str], Say] | None = None,
        note: Note = lambda severity, line: None,
    ) -> None:
        """`say` tells the ground, `send_event` does so without a text; MAV_TYPE says what kind of vehicle it is.

        `outgoing` takes the commands that it gives to others; `say_as` gives the `say` of those parts that PX4
        counts as modules of their own; `note` writes into the log.
        """
        self._topics = topics
        self._parameters = parameters
        self._say = say
        self._send_event = send_event
        self._note = note
        self._mav_type = int(parameters["MAV_TYPE"])
        self._vehicle_kind = kind = VehicleKind.of_mav_type(self._mav_type)
        topics.vehicle_status = VehicleStatus(vehicle_kind=kind, mav_type=self._mav_type)
        of = say_as or (lambda module: say)
        self._say_failsafe = of("failsafe")
        self._checks = HealthAndArmingChecks(topics, parameters, of("health_and_arming_checks"), send_event)
        self._intention = UserModeIntention(self._checks, boot_mode(int(parameters["COM_FLTMODE_BOOT"])))
        self._outgoing = outgoing if outgoing is not None else OutgoingCommands()
        self._authorization = ArmAuthorization(parameters, self._outgoing, say)
        self._arming = Arming(
            topics, parameters, self._checks, self._intention, say, kind.traits, authorization=self._authorization
        )
        self._failsafe = Failsafe(parameters, self._on_failsafe, self._on_takeover, flies=kind.traits.flies)
        self._auto_disarm = AutoDisarm()
        self._throw_launch = ThrowLaunch(topics, parameters, send_event, note)
        self.calibration = CalibrationWorker(topics, parameters, say)
        self._handlers = CommandHandlers(
            topics,
            parameters,
            dataman,
            self._checks,
            self._intention,
            self._arming,
            self.calibration,
            self._outgoing,
            say,
            kind.traits,
            storage=storage,
        )
        self._pilot = Pilot(topics, self._intention, self._arming, self._handlers.change_mode, say)
        self._ready_noted = False
        self._was_armed = False
        self._was_landed = True
        self._has_taken_off = False
        self._takeoff_us = 0
        self._nav_state = NavState.AUTO_LOITER
        self._nav_state_us = 0
        self._battery_warning = 0
        self._off_us: int | None = None
        """When an empty battery turns it off."""
        self._sticks_lost = True
        self._links = DataLinks(topics, parameters, say)
        self._failure_detector = FailureDetector(topics, parameters)
        self._checks_due_us = 0
        self._setpoint = topics.offboard_setpoint
        self._parameters_seen = parameters.version
        self._now_us = 0
        self._heading_resets = 0
        self._home_altitude = HomeAltitude(topics)
        self._arms_on_boot = bool(parameters["COM_ARM_ON_BOOT"])
        self._navigator_commands_seen = 0
        self._published: tuple[object, ...] = ()

    @property
    def COMMANDS(self) -> frozenset[int]:  # noqa: N802, as the constant that other owners of commands have
        """Those it has a handler for, and those that nobody else answers."""
        return self._handlers.commands

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide on one of COMMANDS; None gives no ack.

        Last in a cycle of PX4, and one in each: what the command before has asked for is flown by then.
        """
        if self._off_us is not None:
            return None
        self._choose_nav_state(now_us)
        self._publish_vehicle_status(now_us)
        if self._are_checks_due(now_us):
            self._checks.update(now_us)
        result = self._handlers.handle(now_us, command)
        self._checks_due_us = 0
        self._published = ()  # whatever has come of it, PX4 tells its status after a command: that wakes the navigator
        self._publish_vehicle_status(now_us)
        if result == UNSUPPORTED:
            self._note(Severity.WARNING, f"[commander] command {command.command} unsupported")
        return None if result is None else CommandResult(result)

    def update(self, now_us: int) -> None:
        """At 83 Hz, in the order of Commander::run: what the checks find, is acted upon the next time."""
        if self._off_us is not None:
            if now_us >= self._off_us:
                self._off_us = NEVER_US
                self._handlers.shut_down(now_us)
            return
        self._throw_launch.update(armed=self._arming.armed)
        self._correct_home(now_us)
        self._turn_home(now_us)
        self._authorization.update(now_us)
        self._handlers.arm_with_leave(now_us)
        self._failure_detector.update(now_us)
        if self._turns_off(now_us):
            return
        self._hold_without_sticks()
        self._pilot.update(now_us, in_failsafe=self._failsafe.in_failsafe)
        self._follow_takeoff_and_landing(now_us)
        self._leave_finished_modes()
        self._disarm_by_itself(now_us)
        links_changed = self._links.update(now_us)
        self._choose_nav_state(now_us)
        if self._are_checks_due(now_us) or links_changed:
            self._checks_due_us = now_us + CHECKS_INTERVAL_US
            self._publish_vehicle_status(now_us)  # the checks are those of the mode that has just been chosen
            self._checks.update(now_us)
            self._note_ready()
            self._follow_home(now_us)
            self._arm_on_boot(now_us)
        self._publish_vehicle_status(now_us)
        self._take_navigator_commands(now_us)

    def _are_checks_due(self, now_us: int) -> bool:
        """Ten times a second, behind a command, as soon as a parameter is another one, and as soon as setpoints come
        that were not heard before, so that OFFBOARD may be asked for right behind the first (offboardControlCheck)."""
        setpoint, parameters = self._topics.offboard_setpoint, self._parameters.version
        is_heard = setpoint is not self._setpoint and self._topics.failsafe_flags.offboard_control_signal_lost
        is_other = parameters != self._parameters_seen
        self._setpoint, self._parameters_seen = setpoint, parameters
        return now_us >= self._checks_due_us or is_heard or is_other

    def _turns_off(self, now_us: int) -> bool:
        """An empty battery turns off who is not armed: nobody commands it any more, in a minute it is off."""
        before, self._battery_warning = self._battery_warning, self._topics.failsafe_flags.battery_warning
        if before == self._battery_warning or self._battery_warning != BATTERY_EMERGENCY:
            return False
        if self._arming.armed:
            self._say(Severity.CRITICAL, "System does not support shutdown\t", "commander_low_bat_shutdown_failed")
            return False
        text = "Dangerously low battery! Shutting system down in 60 seconds\t"
        self._say(Severity.CRITICAL, text, "commander_low_bat_shutdown")
        self._off_us = now_us + OFF_AFTER_US
        return True

    def _hold_without_sticks(self) -> None:
        """NAV_RCL_ACT 7: where a mode of sticks loses them, HOLD is chosen, which is no failsafe."""
        lost = self._topics.failsafe_flags.manual_control_signal_lost
        was_lost, self._sticks_lost = self._sticks_lost, lost
        by_sticks = self._arming.armed and self._nav_state in FLOWN_BY_STICKS
        if lost and not was_lost and by_sticks and self._parameters["NAV_RCL_ACT"] == HOLD_NO_FAILSAFE:
            self._intention.change(NavState.AUTO_LOITER, armed=True, force=True)
            text = "Manual control lost: switching to Hold\t"
            self._say(Severity.INFO, text, "commander_rc_loss_hold_no_failsafe")

    def _correct_home(self, now_us: int) -> None:
        gps, parameters = self._topics.sensor_gps, self._parameters
        good = home_position.receiver_gives_home(gps, int(parameters["EKF2_GPS_CTRL"]))
        self._home_altitude.update(now_us, trusted=good and bool(parameters["COM_HOME_EN"]))

    def _turn_home(self, now_us: int) -> None:
        """A heading that the filter has corrected was as wrong when home took it (HomePosition::update)."""
        local, home = self._topics.vehicle_local_position, self._topics.home_position
        if local.heading_reset_counter == self._heading_resets:
            return
        self._heading_resets = local.heading_reset_counter
        if home.valid and self._parameters["COM_HOME_EN"]:
            self._topics.home_position = home._replace(timestamp=now_us, yaw=home.yaw + local.delta_heading)

    def _follow_home(self, now_us: int) -> None:
        topics, landed = self._topics, self._topics.vehicle_land_detected.landed
        if self._arming.mission_in_progress or not self._parameters["COM_HOME_EN"]:
            return
        gps_ctrl = int(self._parameters["EKF2_GPS_CTRL"])
        if self._arming.armed and not landed and self._parameters["COM_HOME_IN_AIR"]:
            topics.home_position = home_position.in_air(now_us, topics, gps_ctrl) or topics.home_position
        elif not self._arming.armed and landed and home_position.wants_setting(topics, gps_ctrl):
            self._arming.set_home(now_us)

    def _note_ready(self) -> None:
        """Once, and in green: PX4 does so in simulation (checkAndInformReadyForTakeoff)."""
        flies = self._vehicle_kind.traits.flies
        if flies and not self._ready_noted and self._checks.can_arm(NavState.AUTO_TAKEOFF):
            self._ready_noted = True
            self._note(Severity.INFO, "[commander] \x1b[32mReady for takeoff!\x1b[0m")

    def _arm_on_boot(self, now_us: int) -> None:
        """COM_ARM_ON_BOOT: as soon as all is well, and once."""
        due = self._arms_on_boot and now_us > ARMED_ON_BOOT_AFTER_US and not self._arming.armed
        if due and self._checks.can_arm(self._nav_state):
            self._arms_on_boot = self._arming.arm(now_us, forced=True, by=MISSION_START) != ACCEPTED

    def _take_navigator_commands(self, now_us: int) -> None:
        """Last in a cycle, as in PX4's Commander::run: an RTL item at a mission's end leads over HOLD to RTL."""
        records = self._topics.navigator_commands
        if not records or records[-1].number == self._navigator_commands_seen:
            return
        for record in records:
            if record.number > self._navigator_commands_seen:
                self._navigator_commands_seen = record.number
                if record.command.command in self.COMMANDS:
                    result = self.handle_command(now_us, record.command)
                    if result is not None:
                        tell(self._topics, now_us, record.command, result)

    def _follow_takeoff_and_landing(self, now_us: int) -> None:
        landed, armed = self._topics.vehicle_land_detected.landed, self._arming.armed
        if armed and landed and not self._was_landed:
            self._say(Severity.INFO, "Landing detected\t", "commander_landing_detected")
        if armed and not landed and self._was_landed:
            self._say(Severity.INFO, "Takeoff detected\t", "commander_takeoff_detected")
            self._has_taken_off, self._takeoff_us = True, now_us
            self._home_altitude.takeoff_us = now_us
            self._arming.set_home(now_us)
        if not armed:
            self._has_taken_off, self._takeoff_us = False, 0
        if self._was_armed and not armed:
            self._parameters.set("COM_FLIGHT_UUID", self._parameters["COM_FLIGHT_UUID"] + 1, notify=False)
        self._was_armed, self._was_landed = armed, landed

    def _leave_finished_modes(self) -> None:
        """In the air TAKEOFF ends in HOLD, and so does a mission (Commander::checkForMissionUpdate)."""
        result, nav_state = self._topics.mission_result, self._nav_state
        ended = self._arming.armed and result.finished and result.timestamp >= self._nav_state_us
        if not ended or self._was_landed or nav_state is not self._intention.mode:
            return
        if nav_state in (NavState.AUTO_TAKEOFF, NavState.AUTO_VTOL_TAKEOFF, NavState.AUTO_MISSION):
            self._intention.change(NavState.AUTO_LOITER, armed=True, force=True)

    def _disarm_by_itself(self, now_us: int) -> None:
        if not self._arming.armed:
            self._auto_disarm.reset()
            return
        reason = self._auto_disarm.update(
            now_us,
            landed=self._was_landed,
            has_taken_off=self._has_taken_off,
            mission_in_progress=self._arming.mission_in_progress,
            after_landing_s=float(self._parameters["COM_DISARM_LAND"]),
            preflight_s=float(self._parameters["COM_DISARM_PRFLT"]),
            spoolup_s=float(self._parameters["COM_SPOOLUP_TIME"]),
        )
        if reason is not None and not self._throw_launch.in_progress:
            self._arming.disarm(now_us, reason.value)

    def _choose_nav_state(self, now_us: int) -> None:
        self._now_us = now_us
        topics, arming = self._topics, self._arming
        nav_state = self._failsafe.update(
            now_us,
            armed=arming.armed,
            user_mode=self._intention.mode,
            mode_changes=self._intention.changes,
            flags=topics.failsafe_flags,
            mission_finished=topics.mission_result.finished,
            sticks_take_over=self._pilot.wants_control,
        )
        if self._failsafe.user_mode is not self._intention.mode:
            self._intention.follow(self._failsafe.user_mode)
        if self._failsafe.selected is Action.TERMINATE and not arming.terminated:
            arming.terminate()
        elif self._failsafe.selected is Action.DISARM and arming.armed:
            arming.disarm(now_us, "failsafe")
            nav_state = self._intention.mode
        if arming.terminated:
            nav_state = NavState.TERMINATION
        if nav_state is not self._nav_state:
            if nav_state is NavState.TERMINATION and arming.armed:
                self._release_parachute()
            self._nav_state = nav_state
            self._nav_state_us = now_us
            self._checks_due_us = 0

    def _release_parachute(self) -> None:
        """PX4's send_parachute_command."""
        system = int(self._parameters["MAV_SYS_ID"])
        release = (mavlink.MAV_CMD_DO_PARACHUTE, float(mavlink.PARACHUTE_RELEASE), *(0.0,) * 6)
        command = VehicleCommand(
            *release, target_system=system, target_component=mavlink.MAV_COMP_ID_PARACHUTE, from_external=False
        )
        self._outgoing.give(command)

    def _publish_vehicle_status(self, now_us: int) -> None:
        topics, arming = self._topics, self._arming
        flags, in_failsafe = topics.failsafe_flags, self._failsafe.in_failsafe
        self._publish_actuator_armed(now_us)
        can_arm = self._checks.can_arm(self._nav_state)
        mode = control_mode(self._nav_state, self._vehicle_kind.traits, topics.offboard_setpoint)
        systems = present_and_healthy(now_us, topics.gcs_heartbeats)
        told = (
            can_arm,
            mode,
            systems,
            flags.gcs_connection_lost,
            flags.manual_control_signal_lost,
            arming.armed,
            self._nav_state,
            self._intention.mode,
            in_failsafe,
            self._takeoff_us,
            self.calibration.busy,
            self.calibration.remote_control,
            self._failsafe.taken_over,
            topics.actuator_armed.kill,
            topics.actuator_armed.lockdown,
        )
        if told == self._published and now_us - topics.vehicle_status.timestamp < STATUS_INTERVAL_US:
            return
        self._published = told
        topics.vehicle_status = VehicleStatus(
            now_us,
            arming.armed,
            arming.armed_us,
            self._takeoff_us,
            self._nav_state,
            self._intention.mode,
            self._intention.mode if arming.terminated else self._nav_state,
            self._nav_state_us,
            self._system_status(can_arm=can_arm),
            in_failsafe,
            False,
            arming.terminated,
            flags.gcs_connection_lost,
            flags.manual_control_signal_lost,
            can_arm,
            self.calibration.busy,
            self._vehicle_kind,
            self._mav_type,
            arming.arming_reason,
            arming.disarming_reason,
            self._links.gcs_losses,
            self._failsafe.taken_over,
            int(self._parameters["CBRK_IO_SAFETY"]) == SAFETY_BREAKER,
            *systems,
            rc_calibration_in_progress=self.calibration.remote_control,
            control_mode=mode,
        )

    def _publish_actuator_armed(self, now_us: int) -> None:
        """When anything of it has changed."""
        told = self._topics.actuator_armed
        termination = self._nav_state is NavState.TERMINATION
        ready = self._arming.armed or self._checks.can_arm(self._nav_state)
        prearmed, lockdown = self._is_prearmed(now_us), self._throw_launch.in_progress
        new = told._replace(termination=termination, ready_to_arm=ready, prearmed=prearmed, lockdown=lockdown)
        if new != told:
            self._topics.actuator_armed = new

    def _is_prearmed(self, now_us: int) -> bool:
        """COM_PREARM_MODE: servos may move before arming, 1 by the safety button, 2 from a while after boot on."""
        mode = int(self._parameters["COM_PREARM_MODE"])
        if self.calibration.busy or mode == PREARM_DISABLED:
            return False
        if mode == PREARM_BY_SAFETY_BUTTON:
            return int(self._parameters["CBRK_IO_SAFETY"]) == SAFETY_BREAKER
        return now_us > PREARMED_AFTER_US

    def _system_status(self, *, can_arm: bool) -> int:
        """MAV_STATE as MavlinkStreamHeartbeat::send works it out; locked motors look like a terminated flight."""
        actuators = self._topics.actuator_armed
        if self._arming.terminated or actuators.kill or actuators.lockdown:
            return STATE_FLIGHT_TERMINATION
        if self._arming.armed:
            return STATE_CRITICAL if self._failsafe.in_failsafe else STATE_ACTIVE
        if self.calibration.calibrating:
            return STATE_CALIBRATING
        return STATE_STANDBY if can_arm else STATE_UNINIT

    def _on_takeover(self) -> None:
        self._send_event("failsafe_rc_override", Severity.INFO)

    def _on_failsafe(self, notice: Notice) -> None:
        self._checks.report_what_waits(self._now_us)
        holds = notice.delayed_action is not Action.NONE
        hold = f": entering Hold for {notice.hold_s} seconds" if holds else ""
        event, *arguments = failsafe_event(notice)
        if notice.action is Action.WARN:
            self._send_event(event, failsafe_severity(notice), *arguments)
            return
        self._say_failsafe(Severity.CRITICAL, f"Failsafe activated{hold}\t", event, *arguments)
