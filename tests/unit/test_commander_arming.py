"""Arming and disarming, and what is commanded on the ground, as a person or a ground station sees it."""

import math

import pytest

from sitl_emu.autopilot.commander.commander import Commander
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.topics import LoggerStatus, ManualControlSetpoint, OffboardSetpoint, TrajectorySetpoint
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import STEP_US, FakeVehicle, item, ready

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
UNINIT, STANDBY, ACTIVE, CRITICAL, FLIGHT_TERMINATION = 0, 3, 4, 5, 8
ARM_DISARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
PREARM_BIT = 0x10000000


@pytest.fixture
def vehicle() -> FakeVehicle:
    return ready()


def test_boots_in_hold_silently_and_becomes_ready() -> None:
    vehicle = FakeVehicle()
    vehicle.step()
    assert vehicle.topics.vehicle_status.system_status == UNINIT
    assert not vehicle.topics.health_report.health & PREARM_BIT
    vehicle.run(3.0)
    assert vehicle.topics.vehicle_status.system_status == STANDBY
    assert vehicle.topics.health_report.health & PREARM_BIT
    assert vehicle.mode is NavState.AUTO_LOITER
    assert vehicle.take_texts() == []


@pytest.mark.parametrize(
    ("kind", "noted"),
    [
        (VehicleKind.MULTICOPTER, ["[commander] \x1b[32mReady for takeoff!\x1b[0m"]),
        (VehicleKind.ROVER_ACKERMANN, []),
    ],
)
def test_what_flies_notes_once_that_it_is_ready(kind: VehicleKind, noted: list[str]) -> None:
    """Commander::checkAndInformReadyForTakeoff, with the colours of its console in the log."""
    vehicle = FakeVehicle(kind)
    vehicle.step()
    assert not now(vehicle.noted)
    vehicle.run(3.0)
    assert now(vehicle.arm()) == ACCEPTED
    assert vehicle.result(ARM_DISARM, 0) == ACCEPTED
    vehicle.run(1.0)
    assert vehicle.noted == noted


def test_vehicle_status_is_told_twice_a_second_and_when_it_changes(vehicle: FakeVehicle) -> None:
    """Commander::run: who streams CURRENT_MODE at 20 Hz so gets a mode of 20 ms, as before a mission's RTL."""

    def told_in(seconds: float) -> int:
        stamps = set()
        for _ in range(round(seconds * 1e6 / STEP_US)):
            vehicle.step()
            stamps.add(vehicle.topics.vehicle_status.timestamp)
        return len(stamps)

    assert told_in(5.0) in (10, 11)
    assert vehicle.arm() == ACCEPTED
    assert vehicle.topics.vehicle_status.armed


def test_sys_status_bits_are_those_of_px4_when_ready(vehicle: FakeVehicle) -> None:
    vehicle.topics.logger_status = LoggerStatus(vehicle.now_us, True)
    vehicle.run(0.2)
    report = vehicle.topics.health_report
    assert (report.present, report.enabled, report.health) == (50380847, 50446383, 320915519)


def test_a_rover_has_no_motor_outputs_to_show() -> None:
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.topics.logger_status = LoggerStatus(3_000_000, True)
    rover.run(3.0)
    report = rover.topics.health_report
    assert (report.present, report.enabled, report.health) == (50348079, 50413615, 320915519)


def test_arm_and_disarm_by_command(vehicle: FakeVehicle) -> None:
    assert vehicle.arm() == ACCEPTED
    assert vehicle.arm() == ACCEPTED
    vehicle.step()
    assert now(vehicle.armed)
    assert vehicle.topics.actuator_armed.armed
    assert vehicle.topics.vehicle_status.system_status == ACTIVE
    assert vehicle.result(ARM_DISARM, 0) == ACCEPTED
    assert vehicle.result(ARM_DISARM, 0) == ACCEPTED
    vehicle.step()
    assert not vehicle.armed
    assert vehicle.take_texts() == ["Armed by external command", "Disarmed by external command"]


def test_other_numbers_than_arm_and_disarm_get_no_ack(vehicle: FakeVehicle) -> None:
    assert vehicle.command(ARM_DISARM, 2) is None
    assert vehicle.result(ARM_DISARM, 0.5) == ACCEPTED  # rounds to arm


@pytest.mark.parametrize("param1", [-1, 2, 300])
def test_an_arming_action_that_is_none_gets_no_ack(vehicle: FakeVehicle, param1: float) -> None:
    assert vehicle.command(ARM_DISARM, param1) is None


def test_an_arming_action_is_eight_bits_wide_as_in_px4(vehicle: FakeVehicle) -> None:
    assert vehicle.result(ARM_DISARM, 257) == ACCEPTED
    vehicle.step()
    assert vehicle.armed
    assert vehicle.result(ARM_DISARM, math.nan) == ACCEPTED
    vehicle.step()
    assert not vehicle.armed


@pytest.mark.parametrize("command", [mavlink.MAV_CMD_PREFLIGHT_STORAGE, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN])
def test_not_a_number_is_no_action(vehicle: FakeVehicle, command: int) -> None:
    assert vehicle.command(command, math.nan) in (None, (DENIED, 0, 0))


def test_disarms_itself_when_nobody_takes_off(vehicle: FakeVehicle) -> None:
    vehicle.arm()
    vehicle.run(10.8)  # COM_DISARM_PRFLT and COM_SPOOLUP_TIME
    assert now(vehicle.armed)
    vehicle.run(0.4)
    assert not vehicle.armed
    assert vehicle.take_texts()[-1] == "Disarmed by auto preflight disarming"


def test_a_rover_takes_off_by_arming_and_never_disarms_itself() -> None:
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    rover.arm()
    rover.run(20.0)
    assert rover.armed
    assert rover.take_texts() == ["Armed by external command", "Takeoff detected"]
    assert rover.result(ARM_DISARM, 0) == ACCEPTED


@pytest.mark.parametrize("sub", [2, 3])
def test_takeoff_and_hold_can_be_armed(vehicle: FakeVehicle, sub: int) -> None:
    assert vehicle.set_mode(4, sub) == ACCEPTED
    assert vehicle.arm() == ACCEPTED


def test_sticks_that_are_not_at_rest_refuse_arming(vehicle: FakeVehicle) -> None:
    vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True)
    vehicle.run(0.2)
    vehicle.set_mode(7)
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Arming denied: throttle not in safe position"]
    vehicle.set_mode(3)
    assert vehicle.arm() == ACCEPTED


@pytest.mark.parametrize(
    ("rover", "main", "throttle", "safe"),
    [
        (False, 7, -0.79, False),
        (False, 7, -0.81, True),
        (False, 3, 0.2, True),
        (False, 3, 0.21, False),
        (False, 4, 1.0, True),
        (True, 1, 0.19, True),
        (True, 1, 0.2, False),
        (True, 1, -0.21, False),
        (True, 1, -1.0, False),
        (True, 3, -0.19, True),
        (True, 4, 1.0, True),
    ],
)
def test_where_the_throttle_stick_may_be_when_it_is_armed(rover: bool, main: int, throttle: float, safe: bool) -> None:
    """Commander::arm, before it looks at the vehicle's health; HOLD (4, 3) asks no stick."""
    vehicle = FakeVehicle(VehicleKind.ROVER_ACKERMANN if rover else VehicleKind.MULTICOPTER)
    vehicle.run(3.0)
    vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True, throttle=throttle)
    vehicle.run(0.2)
    vehicle.set_mode(main, 3 if main == 4 else 0)
    vehicle.take_texts()
    vehicle.arm()
    assert ("Arming denied: throttle not in safe position" not in vehicle.take_texts()) is safe


def test_sticks_that_nobody_holds_refuse_nothing() -> None:
    vehicle = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    vehicle.run(3.0)
    vehicle.set_mode(1, 0)
    vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, False, throttle=1.0)
    vehicle.run(0.2)
    vehicle.take_texts()
    vehicle.arm()
    assert "Arming denied: throttle not in safe position" not in vehicle.take_texts()


def test_force_arms_without_health_and_disarms_in_the_air(vehicle: FakeVehicle) -> None:
    vehicle.set_mode(4, 5)
    assert vehicle.result(ARM_DISARM, 1, 21196) == TEMPORARILY_REJECTED  # force is for disarming, and for who is inside
    vehicle.set_mode(4, 3)
    vehicle.take_off(5.0)
    assert vehicle.result(ARM_DISARM, 0) == TEMPORARILY_REJECTED
    assert vehicle.take_texts()[-1] == "Disarming denied: not landed"
    assert vehicle.result(ARM_DISARM, 0, 21196) == ACCEPTED


def test_no_gps_denies_arming_and_is_not_told(vehicle: FakeVehicle) -> None:
    vehicle.gps = False
    vehicle.run(8.0)
    assert vehicle.topics.vehicle_status.system_status == UNINIT
    assert vehicle.take_texts() == []
    assert vehicle.arm() == TEMPORARILY_REJECTED


def test_without_a_ground_station_it_arms_only_where_none_is_needed(vehicle: FakeVehicle) -> None:
    vehicle.gcs = False
    vehicle.run(20.0)
    assert vehicle.topics.vehicle_status.system_status == STANDBY
    vehicle.parameters.set("NAV_DLL_ACT", 2)
    vehicle.run(3.0)
    assert vehicle.topics.vehicle_status.system_status == UNINIT
    lost = "Connection to ground station lost"
    assert vehicle.take_texts() == [lost, "Preflight Fail: No connection to the GCS"]


def test_dead_sensors_deny_arming(vehicle: FakeVehicle) -> None:
    vehicle.sensors = False
    vehicle.run(2.0)
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert "Preflight Fail: No valid data from Accel 0" in vehicle.take_texts()


@pytest.mark.parametrize(("sensor", "name"), [("ACC", "Accel"), ("GYRO", "Gyro"), ("MAG", "Compass")])
def test_sensors_without_a_calibration_of_their_own_deny_arming(vehicle: FakeVehicle, sensor: str, name: str) -> None:
    vehicle.parameters.set(f"CAL_{sensor}0_ID", 0)
    vehicle.run(3.0)
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert f"Preflight Fail: {name} 0 uncalibrated" in vehicle.take_texts()


def test_a_vehicle_may_arm_itself_when_it_has_booted_once() -> None:
    """COM_ARM_ON_BOOT, from five seconds after boot on (Commander::run)."""
    vehicle = FakeVehicle(COM_ARM_ON_BOOT=1)
    vehicle.run(4.9)
    assert not now(vehicle.armed)
    vehicle.run(0.3)
    assert now(vehicle.armed)
    assert vehicle.take_texts() == ["Armed by mission start"]
    vehicle.result(ARM_DISARM, 0)
    vehicle.run(1.0)
    assert not vehicle.armed


@pytest.mark.parametrize(
    ("number", "param1", "result"),
    [
        (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 0, DENIED),
        (mavlink.MAV_CMD_MISSION_START, 0, DENIED),
        (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 3, DENIED),
        (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 0, ACCEPTED),
        (mavlink.MAV_CMD_RUN_PREARM_CHECKS, 0, ACCEPTED),
        (mavlink.MAV_CMD_DO_LAND_START, 0, 6),
        (mavlink.MAV_CMD_CONTROL_HIGH_LATENCY, 0, FAILED),
    ],
)
def test_results_on_the_ground(vehicle: FakeVehicle, number: int, param1: float, result: int) -> None:
    assert vehicle.result(number, param1) == result


@pytest.mark.parametrize(
    ("action", "kept"),
    [
        (0, {"MPC_XY_P", "RC1_MIN", "CAL_GYRO0_XOFF"}),
        (2, set()),
        (3, {"MPC_XY_P", "RC1_MIN"}),
        (4, set()),
    ],
)
def test_parameters_are_reset(vehicle: FakeVehicle, action: int, kept: set[str]) -> None:
    values = {"MPC_XY_P": 1.3, "RC1_MIN": 1100.0, "CAL_GYRO0_XOFF": 0.1}
    for name, value in values.items():
        vehicle.parameters.set(name, value)
    assert vehicle.result(mavlink.MAV_CMD_PREFLIGHT_STORAGE, action) == ACCEPTED
    assert {name for name in values if vehicle.parameters[name] != vehicle.parameters.default(name)} == kept
    assert vehicle.parameters["CAL_ACC0_ID"] == (0 if action else 1310988)


def test_parameters_are_left_alone_while_armed_or_calibrating(vehicle: FakeVehicle) -> None:
    storage = mavlink.MAV_CMD_PREFLIGHT_STORAGE
    assert vehicle.command(storage, 9) is None
    vehicle.arm()
    assert vehicle.result(storage, 1) == TEMPORARILY_REJECTED
    vehicle.result(ARM_DISARM, 0)
    assert vehicle.result(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 1) == ACCEPTED
    assert vehicle.result(storage, 1) == TEMPORARILY_REJECTED
    vehicle.step()
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert "Arming denied: calibrating" in vehicle.take_texts()


def test_commands_that_others_answer_get_no_ack(vehicle: FakeVehicle) -> None:
    assert vehicle.command(mavlink.MAV_CMD_DO_DIGICAM_CONTROL) is None
    assert vehicle.command(mavlink.MAV_CMD_ACTUATOR_TEST) is None


def test_termination_is_for_good(vehicle: FakeVehicle) -> None:
    vehicle.take_off(5.0)
    vehicle.take_texts()
    assert vehicle.result(mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1) == ACCEPTED
    vehicle.run(0.5)
    assert vehicle.mode is NavState.TERMINATION
    assert vehicle.topics.vehicle_status.termination
    assert vehicle.topics.vehicle_status.nav_state_user_intention is NavState.TERMINATION
    assert vehicle.topics.vehicle_status.nav_state_display is NavState.TERMINATION
    assert vehicle.topics.vehicle_status.system_status == FLIGHT_TERMINATION
    assert layout("commander_failsafe_enter_generic")[0] in {event.id for event in vehicle.events.recent}
    assert vehicle.result(mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1) == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Failsafe activated", "Preflight Fail: Flight termination active"]
    assert vehicle.result(mavlink.MAV_CMD_NAV_LAND) == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Switching to Land is currently not available"]
    assert vehicle.result(ARM_DISARM, 0) == TEMPORARILY_REJECTED
    assert vehicle.result(ARM_DISARM, 0, 21196) == ACCEPTED
    vehicle.run(0.2)
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert vehicle.mode is NavState.TERMINATION
    assert vehicle.topics.vehicle_status.nav_state_user_intention is NavState.TERMINATION


def test_mission_start_arms_and_starts(vehicle: FakeVehicle) -> None:
    vehicle.upload(item(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 5.0), item(mavlink.MAV_CMD_NAV_LAND))
    vehicle.run(0.2)
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, 0, 0) == ACCEPTED
    vehicle.step()
    assert (vehicle.mode, vehicle.armed) == (NavState.AUTO_MISSION, True)
    assert "Armed by mission start" in vehicle.take_texts()


@pytest.mark.parametrize(("first", "result"), [(-1, ACCEPTED), (1, ACCEPTED), (2, DENIED), (math.nan, DENIED)])
def test_mission_start_at_an_item(vehicle: FakeVehicle, first: float, result: int) -> None:
    vehicle.upload(item(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 5.0), item(mavlink.MAV_CMD_NAV_LAND))
    vehicle.run(0.2)
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, first) == result
    vehicle.step()
    assert vehicle.dataman.current_seq == max(0, first if result == ACCEPTED else 0)


@pytest.mark.parametrize(
    ("armed", "state", "result"),
    [(False, 0, ACCEPTED), (False, 1, ACCEPTED), (False, 2, FAILED), (True, 0, TEMPORARILY_REJECTED)],
)
def test_the_safety_switch(vehicle: FakeVehicle, armed: bool, state: float, result: int) -> None:
    if armed:
        vehicle.arm()
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_SAFETY_SWITCH_STATE, state) == result


def test_a_mission_that_cannot_be_armed_is_refused(vehicle: FakeVehicle) -> None:
    vehicle.upload(item(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 5.0), item(mavlink.MAV_CMD_NAV_LAND))
    vehicle.result(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 1)
    vehicle.run(0.2)
    vehicle.take_texts()
    assert vehicle.result(mavlink.MAV_CMD_MISSION_START, 0, 0) == TEMPORARILY_REJECTED
    refusals = ["Arming denied: calibrating", "Switching to Mission is currently not available"]
    assert vehicle.take_texts()[-2:] == refusals


def with_outgoing(**parameters: float) -> tuple[FakeVehicle, OutgoingCommands]:
    """Booted, and the commands that its commander gives to others."""
    vehicle, outgoing = FakeVehicle(**parameters), OutgoingCommands()
    vehicle.commander = Commander(
        vehicle.topics, vehicle.parameters, vehicle.dataman, lambda *text: None, lambda *event: None, None, outgoing
    )
    vehicle.run(3.0)
    return vehicle, outgoing


def test_to_land_by_the_mission_is_to_start_it_there_which_the_links_hear() -> None:
    """Navigator::run, VEHICLE_CMD_DO_LAND_START: it gives MISSION_START, with no component as its target."""
    vehicle, outgoing = with_outgoing(MAV_SYS_ID=7)
    up = (item(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 8), item(mavlink.MAV_CMD_NAV_WAYPOINT, 20, 0, 8))
    vehicle.upload(*up, item(mavlink.MAV_CMD_DO_LAND_START), item(mavlink.MAV_CMD_NAV_LAND, 30, 0))
    vehicle.run(0.2)
    assert vehicle.result(mavlink.MAV_CMD_DO_LAND_START) == ACCEPTED
    (start,) = outgoing.waiting
    assert (start.command, start.param1, start.param2, start.param7) == (mavlink.MAV_CMD_MISSION_START, 2.0, 0.0, 0.0)
    assert (start.target_system, start.target_component, start.from_external) == (7, 0, False)
    vehicle.run(0.2)
    assert (vehicle.armed, vehicle.mode) == (True, NavState.AUTO_MISSION)
    assert vehicle.topics.mission_result.seq_current == 3


def test_termination_in_flight_releases_the_parachute() -> None:
    vehicle, outgoing = with_outgoing(MAV_SYS_ID=7)
    vehicle.take_off(5.0)
    assert vehicle.result(mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1) == ACCEPTED
    vehicle.run(0.1)
    (release,) = outgoing.waiting
    assert (release.command, release.param1, release.target_system, release.target_component) == (208, 2.0, 7, 161)


@pytest.mark.parametrize(("kind", "may"), [(VehicleKind.MULTICOPTER, False), (VehicleKind.ROVER_ACKERMANN, True)])
def test_what_does_not_fly_takes_off_without_a_position(kind: VehicleKind, may: bool) -> None:
    """PX4's mode_requirements.cpp: of the modes that need a position AUTO_TAKEOFF does so where something flies."""
    vehicle = FakeVehicle(kind)
    vehicle.run(3.0)
    vehicle.gps = False
    vehicle.run(1.0)
    runs = vehicle.topics.health_report.can_run_mode_flags
    assert bool(runs >> NavState.AUTO_TAKEOFF & 1) is may
    assert not runs >> NavState.AUTO_LOITER & 1
    local_position = vehicle.topics.failsafe_flags.mode_req_local_position
    assert (local_position >> NavState.AUTO_TAKEOFF & 1, local_position >> NavState.AUTO_LOITER & 1) == (not may, 1)


def driving_with_a_mission() -> FakeVehicle:
    """Right behind its MISSION_ACK."""
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    rover.arm()
    rover.run(1.02)
    rover.upload(item(mavlink.MAV_CMD_NAV_WAYPOINT, 20, 0), item(mavlink.MAV_CMD_NAV_WAYPOINT, 20, 20))
    rover.step()
    return rover


def test_a_mission_is_there_once_the_checks_have_looked() -> None:
    """Ten times a second (Commander::run): a real PX4 refuses most that start one right behind its MISSION_ACK."""
    assert driving_with_a_mission().result(mavlink.MAV_CMD_MISSION_START, 0, 0) == DENIED
    rover = driving_with_a_mission()
    assert rover.set_mode(4, 4) == TEMPORARILY_REJECTED
    assert rover.set_mode(4, 4) == ACCEPTED, "behind a command the checks look"


def test_offboard_may_be_asked_for_right_behind_the_first_setpoint(vehicle: FakeVehicle) -> None:
    """As MAVSDK does it; the checks look as soon as one comes (Commander::offboardControlCheck)."""
    vehicle.take_off(10.0)
    vehicle.run(0.52)
    assert vehicle.set_mode(6) == TEMPORARILY_REJECTED
    vehicle.run(0.52)
    vehicle.topics.offboard_setpoint = OffboardSetpoint(
        vehicle.now_us, trajectory=TrajectorySetpoint(position=(0.0, 0.0, -5.0))
    )
    assert vehicle.set_mode(6) == ACCEPTED


def test_the_checks_look_as_soon_as_a_parameter_is_another(vehicle: FakeVehicle) -> None:
    """Commander::run, where parameters are updated."""
    vehicle.run(0.52)
    before = vehicle.topics.health_report
    vehicle.parameters.set("COM_ARM_WO_GPS", 0)
    vehicle.step()
    assert vehicle.topics.health_report is not before


@pytest.mark.parametrize("sub", [5, 6])
def test_who_flies_in_a_mode_that_prevents_arming_passes_the_checks(vehicle: FakeVehicle, sub: int) -> None:
    """ModeChecks::checkAndReport looks at disarmed vehicles; a real PX4 v1.18 that returns has PREARM_CHECK healthy."""
    vehicle.set_mode(4, sub)
    vehicle.run(0.2)
    assert not vehicle.topics.health_report.can_arm_mode_flags >> vehicle.mode & 1
    vehicle.set_mode(4, 3)
    vehicle.take_off(10.0)
    vehicle.set_mode(4, sub)
    vehicle.run(0.3)
    assert (vehicle.armed, vehicle.mode) == (True, NavState.AUTO_RTL if sub == 5 else NavState.AUTO_LAND)
    assert vehicle.topics.health_report.can_arm_mode_flags >> vehicle.mode & 1
