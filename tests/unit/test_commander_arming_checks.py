"""Every check before arming, by itself: what makes it complain, and what it says."""

import math
import pathlib
from collections.abc import Callable

import pytest

from sitl_emu.autopilot.commander import arming_checks
from sitl_emu.autopilot.commander.arming_checks import companion_computer, offboard
from sitl_emu.autopilot.commander.arming_checks.checks import all_checks
from sitl_emu.autopilot.commander.arming_checks.findings import (
    GPS,
    LOGGING,
    MAG,
    PREARM_CHECK,
    XY_POSITION_CONTROL,
    Component,
    Findings,
)
from sitl_emu.autopilot.commander.mode_requirements import VALID_MODES
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.topics import (
    BatteryStatus,
    CpuLoad,
    DistanceSensorSample,
    EscStatus,
    EstimatorStatus,
    FailureDetectorStatus,
    GcsHeartbeats,
    GeofenceResult,
    HomePosition,
    LoggerStatus,
    ManualControlSetpoint,
    ManualControlSwitches,
    MissionResult,
    NavigatorStatus,
    OffboardSetpoint,
    OnboardComputerStatus,
    SensorBaro,
    SensorCombined,
    SensorMag,
    Topics,
    TrajectorySetpoint,
    VehicleAttitudeSetpoint,
    VehicleImuStatus,
    VehicleLocalPosition,
    VehicleStatus,
    WindEstimate,
)
from sitl_emu.core import dialect as mavlink

from .navigation_fake import READY_US, FakeVehicle, settled

Spoil = Callable[[Topics], None]
NOT_CHECKS = {"__init__", "findings", "checks"}
ONLY_WARN = {"logger", "companion_computer", "rally_point"}
"""They forbid nothing."""
HAS_NO_TEXT = "navigator"
"""An event is all that it says."""
FORBIDS: dict[str, tuple[str, object]] = {
    "cpu_resource": ("cpuload", CpuLoad(1)),
    "imu": ("sensor_combined", SensorCombined()),
    "magnetometer": ("sensor_mag", SensorMag()),
    "baro": ("sensor_baro", SensorBaro()),
    "estimator": ("estimator_status", EstimatorStatus()),
    "battery": ("battery_status", BatteryStatus(connected=True, warning=2)),
    "geofence": ("geofence_result", GeofenceResult(max_alt_triggered=True, action=2)),
    "failure_detector": ("failure_detector_status", FailureDetectorStatus(fd_pitch=True)),
    "parachute": ("gcs_heartbeats", GcsHeartbeats()),
    "open_drone_id": ("gcs_heartbeats", GcsHeartbeats(open_drone_id_us=READY_US)),
    "traffic_avoidance": ("gcs_heartbeats", GcsHeartbeats()),
    "system": ("vehicle_status", VehicleStatus(termination=True)),
    "arm_permission": ("", None),
    "required_sensors": ("distance_sensor", DistanceSensorSample()),
    "rc_calibration": ("", None),
    "power": ("", None),
    "esc": ("esc_status", EscStatus()),
    "manual_control": ("manual_control_switches", ManualControlSwitches(kill=1)),
    "navigator": ("navigator_status", NavigatorStatus(READY_US, NavState.AUTO_LOITER, failure=1)),
}
"""Check -> the topic that makes it forbid arming in every mode."""
WANTS = {
    "parachute": ("COM_PARACHUTE", 2),
    "power": ("COM_POWER_COUNT", 2),
    "esc": ("COM_ARM_CHK_ESCS", 1),
    "open_drone_id": ("COM_ARM_ODID", 2),
    "traffic_avoidance": ("COM_ARM_TRAFF", 2),
    "arm_permission": ("COM_ARMABLE", 0),
    "required_sensors": ("SYS_HAS_NUM_DIST", 1),
    "rc_calibration": ("RC1_TRIM", 900),
}
"""Check -> the parameter, and the value of it, that makes it forbid arming (2: error, or all modes)."""
FLAGS: dict[str, tuple[str, str, object, object]] = {
    "gps": ("", "estimator_status", EstimatorStatus(), None),
    "home_position": ("home_position_invalid", "home_position", HomePosition(), HomePosition(valid=True)),
    "mode": ("auto_mission_missing", "mission_result", MissionResult(), MissionResult(valid=True)),
    "mission": ("auto_mission_missing", "mission_result", MissionResult(), MissionResult(valid=True)),
    "rc_and_data_link": ("gcs_connection_lost", "gcs_heartbeats", GcsHeartbeats(), GcsHeartbeats(READY_US)),
    "offboard": (
        "offboard_control_signal_lost",
        "offboard_setpoint",
        OffboardSetpoint(),
        OffboardSetpoint(READY_US, attitude=VehicleAttitudeSetpoint()),
    ),
    "flight_time": (
        "flight_time_limit_exceeded",
        "vehicle_status",
        VehicleStatus(takeoff_time=1),
        VehicleStatus(takeoff_time=0),
    ),
    "wind": ("wind_limit_exceeded", "wind", WindEstimate(1, 6.0, -6.0), WindEstimate(1, 5.0, -5.0)),
}
"""Check -> its flag, its topic, a bad and a good record of it."""


def check(vehicle: FakeVehicle) -> None:
    """One round of all checks on the topics as they are."""
    vehicle.commander._checks.update(vehicle.now_us)


def test_every_check_stands_in_the_list_and_here() -> None:
    files = {path.stem for path in pathlib.Path(arming_checks.__file__).parent.glob("*.py")} - NOT_CHECKS
    # a compiled method does not know its module, but its class does
    modules = (each.__module__ or type(getattr(each, "__self__")).__module__ for each in all_checks())  # noqa: B009
    in_list = {module.rsplit(".", 1)[1] for module in modules}
    assert files == in_list
    assert files - ONLY_WARN == FORBIDS.keys() | FLAGS.keys()


def test_what_forbids_arming_is_told_in_px4s_order() -> None:
    """Its list in HealthAndArmingChecks.hpp; a summary is before them, and another after."""
    vehicle = settled(COM_PARACHUTE=2, COM_ARM_ODID=2, COM_ARM_TRAFF=2, NAV_DLL_ACT=2, COM_ARMABLE=0)
    vehicle.topics.failure_detector_status = FailureDetectorStatus(fd_pitch=True)
    vehicle.topics.battery_status = BatteryStatus(vehicle.now_us, True, warning=2)
    vehicle.topics.gcs_heartbeats = GcsHeartbeats()
    status = vehicle.topics.estimator_status
    vehicle.topics.estimator_status = status._replace(pre_flt_fail_innov_heading=True, gps_check_fail_flags=1)
    check(vehicle)
    told = [failure.event for failure in vehicle.commander._checks._findings.failures]
    order = ["armable_configuration", "estimator_heading_not_stable", "estimator_gps_fix_too_low"]
    order += ["failure_detector_pitch", "open_drone_id_missing", "parachute_missing"]
    order += ["battery_critical", "rc_dl_no_dllink", "traffic_avoidance_missing"]
    assert [event for event in told if not event.startswith("check_modes")] == [f"check_{name}" for name in order]


@pytest.mark.parametrize("name", FORBIDS)
def test_forbids_arming(name: str) -> None:
    vehicle = settled(COM_RC_IN_MODE=3)
    if name in WANTS:
        vehicle.parameters.set(*WANTS[name])
    topic, bad = FORBIDS[name]
    if topic:
        setattr(vehicle.topics, topic, bad)
    check(vehicle)
    assert vehicle.topics.health_report.can_arm_mode_flags & VALID_MODES == 0
    assert not vehicle.topics.health_report.health & PREARM_CHECK
    assert vehicle.take_texts() or name == HAS_NO_TEXT


def test_modes_hear_of_sticks_one_run_later() -> None:
    """PX4's list: the modes' check is before that of sticks (flights of a PX4 v1.18: two rounds of events)."""
    vehicle = settled()
    vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True)
    for hears in (False, True):
        check(vehicle)
        assert not vehicle.topics.failsafe_flags.manual_control_signal_lost
        assert bool(vehicle.topics.health_report.can_run_mode_flags >> NavState.POSCTL & 1) is hears


def test_each_limit_of_the_fence_is_told_by_its_own_text() -> None:
    """PX4's geofenceCheck.cpp."""
    vehicle = settled()
    vehicle.topics.geofence_result = GeofenceResult(0, True, False, True, action=2)
    check(vehicle)
    texts = ["Geofence: exceeding maximum distance to Home", "Geofence: approaching or outside geofence"]
    assert vehicle.said == texts  # without the tab of other texts that have an event


def test_a_mission_that_cannot_be_completed_is_told() -> None:
    """PX4's missionCheck."""
    vehicle = settled()
    vehicle.topics.mission_result = MissionResult(valid=True, failure=True)
    check(vehicle)
    assert vehicle.topics.failsafe_flags.mission_failure
    assert vehicle.take_texts() == ["Mission cannot be completed"]


def test_a_fence_that_sends_home_needs_one() -> None:
    vehicle = settled()
    vehicle.topics.geofence_result = GeofenceResult(action=3)
    check(vehicle)
    assert vehicle.take_texts() == []
    vehicle.topics.home_position = HomePosition()
    check(vehicle)
    assert "Preflight Fail: Geofence RTL requires valid home" in vehicle.take_texts()
    assert vehicle.topics.health_report.can_arm_mode_flags == 0


@pytest.mark.parametrize("name", [name for name in FLAGS if name != "gps"])
def test_flags(name: str) -> None:
    vehicle = settled(COM_FLT_TIME_MAX=1, COM_WIND_MAX=8, COM_WIND_MAX_ACT=2)
    flag, topic, bad, good = FLAGS[name]
    for record, expected in ((bad, True), (good, False)):
        setattr(vehicle.topics, topic, record)
        check(vehicle)
        assert getattr(vehicle.topics.failsafe_flags, flag) is expected


@pytest.mark.parametrize(("com_arm_wo_gps", "may_arm", "texts"), [
    (0, False, ["Preflight Fail: GPS fix too low"]),
    (1, True, ["Preflight: GPS fix too low"]),
    (2, True, []),
    (3, False, ["Preflight Fail: GPS fix too low"]),
])  # fmt: skip
def test_gps(com_arm_wo_gps: int, may_arm: bool, texts: list[str]) -> None:
    vehicle = settled(COM_ARM_WO_GPS=com_arm_wo_gps)
    vehicle.topics.estimator_status = vehicle.topics.estimator_status._replace(gps_check_fail_flags=0b11)
    check(vehicle)
    assert bool(vehicle.topics.health_report.can_arm_mode_flags >> NavState.AUTO_LOITER & 1) is may_arm
    assert vehicle.take_texts() == texts


def test_a_poor_gps_that_nobody_minds_is_a_round_of_events_without_its_own() -> None:
    """GnssArmingCheck::Disabled is a failure of that level: it counts as a change, and mavlink_main.cpp drops it."""
    vehicle = settled(COM_ARM_WO_GPS=2)
    vehicle.events.recent.clear()
    vehicle.topics.estimator_status = vehicle.topics.estimator_status._replace(gps_check_fail_flags=0b11)
    check(vehicle)
    told = {event.id for event in vehicle.events.recent}
    assert layout("commander_arming_check_summary")[0] in told
    assert layout("check_estimator_gps_fix_too_low")[0] not in told
    assert not vehicle.commander._checks._findings.blamed & Component.GPS


def test_a_vehicle_that_lies_on_its_side_is_not_armed() -> None:
    """FD_FAIL_R 60 deg for 0.3 s."""
    vehicle = settled()
    vehicle.euler = (math.radians(61.0), 0.0, 0.0)
    vehicle.run(0.2)
    assert vehicle.topics.health_report.can_arm_mode_flags
    vehicle.run(0.4)
    assert not vehicle.topics.health_report.can_arm_mode_flags
    assert vehicle.take_texts() == ["Preflight Fail: Attitude failure (roll)"]
    vehicle.parameters.set("FD_FAIL_R", 0)
    vehicle.run(0.2)
    assert vehicle.topics.health_report.can_arm_mode_flags


@pytest.mark.parametrize(("limit", "found"), [(0.0, False), (5.0, True)])
def test_a_propeller_out_of_balance_is_looked_for_where_there_is_a_limit(limit: float, found: bool) -> None:
    """FD_IMB_PROP_THR (PX4's FailureDetector::update)."""
    vehicle = settled(FD_IMB_PROP_THR=limit)
    for _ in range(100):
        vehicle.topics.vehicle_imu_status = VehicleImuStatus(vehicle.now_us, var_accel=(100.0, 100.0, 0.0))
        vehicle.step()
    assert vehicle.topics.failure_detector_status.fd_imbalanced_prop is found


def test_position_that_may_be_two_and_a_half_times_too_far_off_is_none() -> None:
    vehicle = settled(COM_POS_FS_EPH=5.0)
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(eph=13.0)
    check(vehicle)
    assert vehicle.topics.failsafe_flags.local_position_invalid
    assert not vehicle.topics.failsafe_flags.local_position_invalid_relaxed


def test_offboard_position_needs_a_position() -> None:
    vehicle = settled()
    setpoint = TrajectorySetpoint(position=(0.0, 0.0, -5.0))
    vehicle.topics.offboard_setpoint = OffboardSetpoint(vehicle.now_us, trajectory=setpoint)
    check(vehicle)
    assert not vehicle.topics.failsafe_flags.offboard_control_signal_lost
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(xy_valid=False)
    check(vehicle)
    assert vehicle.topics.failsafe_flags.offboard_control_signal_lost


NAN = math.nan


@pytest.mark.parametrize(
    ("setpoint", "invalid", "event"),
    [
        (TrajectorySetpoint(position=(NAN, NAN, -5.0)), "local_position", "no_local_position"),
        (TrajectorySetpoint(velocity=(NAN, NAN, -1.0)), "local_velocity", "no_local_velocity"),
        (TrajectorySetpoint(0, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0)), "local_velocity", "no_local_velocity"),
        (TrajectorySetpoint(acceleration=(NAN, NAN, -1.0)), "attitude", "no_attitude"),
        (TrajectorySetpoint(velocity=(NAN, NAN, -1.0)), "local_position", None),
    ],
)
def test_offboard_needs_what_any_axis_of_the_setpoint_asks_for(
    setpoint: TrajectorySetpoint, invalid: str, event: str | None
) -> None:
    """PX4's offboardCheck, of offboard_control_mode as the MAVLink receiver fills it."""
    vehicle, findings = FakeVehicle(), Findings()
    vehicle.topics.offboard_setpoint = OffboardSetpoint(READY_US, trajectory=setpoint)
    setattr(findings, f"{invalid}_invalid", True)
    offboard.check(READY_US, vehicle.topics, vehicle.commander._checks._settings, findings)
    assert findings.offboard_control_signal_lost is (event is not None)
    assert [failure.event for failure in findings.failures] == ([f"check_modes_offboard_{event}"] if event else [])


def test_a_battery_that_falls_silent_is_not_well() -> None:
    vehicle = settled()
    for silent_us, unhealthy in ((5_000_000, False), (5_004_000, True)):
        vehicle.topics.battery_status = vehicle.battery._replace(timestamp=vehicle.now_us - silent_us)
        check(vehicle)
        assert vehicle.topics.failsafe_flags.battery_unhealthy is unhealthy
        assert bool(vehicle.topics.health_report.can_arm_mode_flags) is not unhealthy


@pytest.mark.parametrize(
    ("topic", "bad", "parameter", "value"),
    [
        ("sensor_mag", SensorMag(), "SYS_HAS_MAG", 0),
        ("sensor_baro", SensorBaro(), "SYS_HAS_BARO", 0),
        ("battery_status", BatteryStatus(connected=True, warning=3), "CBRK_SUPPLY_CHK", 894281),
    ],
)
def test_what_there_is_not_is_not_asked_for(topic: str, bad: object, parameter: str, value: int) -> None:
    vehicle = settled(**{parameter: value})
    setattr(vehicle.topics, topic, bad)
    check(vehicle)
    assert vehicle.topics.health_report.can_arm_mode_flags
    assert vehicle.topics.failsafe_flags.battery_warning == 0


def test_parameters_that_ask_for_more_before_arming() -> None:
    assert settled(COM_ARM_MIS_REQ=1).arm() == 1
    half_empty = settled(COM_ARM_BAT_MIN=0.8)
    half_empty.battery = half_empty.battery._replace(remaining=0.5)
    half_empty.run(0.2)
    assert half_empty.arm() == 1


def test_a_log_is_present_while_it_is_written_and_three_seconds_longer() -> None:
    vehicle = settled()
    check(vehicle)
    assert not vehicle.topics.health_report.present & LOGGING
    vehicle.topics.logger_status = LoggerStatus(vehicle.now_us, True)
    check(vehicle)
    assert vehicle.topics.health_report.present & vehicle.topics.health_report.enabled & LOGGING
    vehicle.topics.logger_status = LoggerStatus(vehicle.now_us - 3_000_000, True)
    check(vehicle)
    assert not vehicle.topics.health_report.present & LOGGING


@pytest.mark.parametrize(
    ("degrees", "limit", "told_us", "warns"),
    [
        (80, 80.0, 9_000_000, True),
        (79, 80.0, 9_000_000, False),
        (127, 80.0, 9_000_000, False),
        (90, 80.0, 4_900_000, False),
        (90, 80.0, 0, False),
        (90, -1.0, 9_000_000, False),
    ],
)
def test_a_hot_companion_is_a_warning_that_forbids_nothing(
    degrees: int, limit: float, told_us: int, warns: bool
) -> None:
    vehicle = FakeVehicle(COM_CC_TEMP_WARN=limit)
    vehicle.topics.onboard_computer_status = OnboardComputerStatus(told_us, degrees)
    findings = Findings()
    companion_computer.check(10_000_000, vehicle.topics, vehicle.commander._checks._settings, findings)
    assert [failure.arguments for failure in findings.failures] == [(degrees,)] * warns
    assert bool(findings.health_warning) is warns and not findings.arming_forbidden


def test_texts_come_with_each_round_of_events_which_is_every_two_seconds_at_most() -> None:
    """PX4's Report::report; measured: a poor fix is told again with every change (arm_denied_no_gps)."""
    vehicle = settled()
    vehicle.battery = vehicle.battery._replace(warning=1)
    vehicle.run(0.3)
    assert vehicle.take_texts() == ["Low battery"]
    vehicle.parameters.set("CAL_MAG0_ID", 0)
    vehicle.run(1.0)
    assert vehicle.take_texts() == []
    vehicle.run(5.0)
    assert vehicle.take_texts() == ["Preflight Fail: Compass 0 uncalibrated", "Low battery"]
    assert vehicle.result(mavlink.MAV_CMD_RUN_PREARM_CHECKS) == 0
    assert vehicle.take_texts() == ["Preflight Fail: Compass 0 uncalibrated", "Low battery"]


def test_a_failsafe_has_told_before_it_what_waits_but_by_events_alone() -> None:
    """FailsafeBase::notifyUser; measured: no text of an emergency 1.2 s after the critical warning (battery_drain)."""
    vehicle = settled()
    vehicle.take_off(10.0)
    vehicle.run(3.0)
    vehicle.take_texts()
    vehicle.battery = vehicle.battery._replace(warning=2)
    vehicle.run(1.0)
    vehicle.battery = vehicle.battery._replace(warning=3)
    vehicle.run(1.0)
    assert "Critical battery" in vehicle.said[0]
    assert not any("Emergency battery level" in text for text in vehicle.said)
    ids = [event.id for event in vehicle.events.recent]
    told = [layout(name)[0] for name in ("check_battery_emergency", "commander_failsafe_enter_crit_low_bat_warn")]
    assert ids.index(told[0]) < ids.index(told[1])


def test_a_gps_that_falls_silent_is_healthy_but_no_longer_present_once_it_is_not_fused() -> None:
    """PX4's estimatorCheck tells a poor fix and no silence; what the position then lacks denies arming."""
    vehicle = settled(COM_ARM_WO_GPS=0)
    for fused in (True, False):
        flags = 0b111 if fused else 0b011
        vehicle.topics.estimator_status = vehicle.topics.estimator_status._replace(control_mode_flags=flags)
        check(vehicle)
        assert bool(vehicle.topics.health_report.present & GPS) is fused
    assert vehicle.topics.health_report.health & GPS


def test_a_sensor_is_unhealthy_with_any_failure_of_it_and_then_wanted_whether_it_is_there_or_not() -> None:
    """PX4's SYS_STATUS.hpp: not calibrated, or not used by the filter."""
    vehicle = settled(CAL_MAG0_ID=0)
    vehicle.topics.estimator_status = EstimatorStatus(vehicle.now_us, gps_check_fail_flags=1)
    check(vehicle)
    report = vehicle.topics.health_report
    assert not report.health & MAG and report.present & report.enabled & MAG
    assert not report.health & GPS and not report.present & GPS and report.enabled & GPS


def test_a_poor_fix_and_a_lost_position_are_unhealthy() -> None:
    vehicle = settled()
    vehicle.topics.estimator_status = vehicle.topics.estimator_status._replace(gps_check_fail_flags=1)
    check(vehicle)
    assert not vehicle.topics.health_report.health & GPS
    vehicle.topics.vehicle_local_position = VehicleLocalPosition()
    check(vehicle)
    assert not vehicle.topics.health_report.health & XY_POSITION_CONTROL


def test_who_has_never_been_ready_is_told_why_two_seconds_after_the_start() -> None:
    """Report::report: its interval counts from 0, and HealthAndArmingChecks::update holds no text back."""
    vehicle, text = FakeVehicle(COM_ARMABLE=0), "Preflight Fail: Vehicle is in safety configuration"
    summary = layout("commander_arming_check_summary")[0]
    vehicle.run(1.9)
    assert vehicle.take_texts() == []
    assert summary not in {event.id for event in vehicle.events.recent}
    vehicle.run(0.4)
    assert text in vehicle.take_texts()
    assert summary in {event.id for event in vehicle.events.recent}
    vehicle.run(3.0)
    vehicle.take_texts()
    assert vehicle.result(mavlink.MAV_CMD_RUN_PREARM_CHECKS) == 0
    assert vehicle.take_texts() == [text]
