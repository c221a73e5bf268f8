"""Checks before arming that ask the estimator: what it complains of, what it uses, and what it needs."""

from typing import Any

import pytest

from sitl_emu.autopilot.commander.mode_requirements import VALID_MODES
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.topics import (
    EstimatorSensorBias,
    EstimatorStatus,
    EstimatorStatusFlags,
    HomePosition,
    ManualControlSetpoint,
    VehicleGlobalPosition,
    WindEstimate,
)

from .navigation_fake import FakeVehicle, settled
from .test_commander_arming_checks import check


def levels_of(vehicle: FakeVehicle, name: str) -> list[int]:
    return [event.log_levels for event in vehicle.events.recent if event.id == layout(name)[0]]


def test_a_gps_that_is_no_longer_used_in_flight_is_told() -> None:
    """PX4's estimatorCheck: the event alone, an error for people and a remark for the log."""
    vehicle = settled()
    vehicle.take_off(5.0)
    for fused in (False, True):
        vehicle.topics.estimator_status = EstimatorStatus(vehicle.now_us, control_mode_flags=0b111 if fused else 0b011)
        check(vehicle)
        check(vehicle)
    assert levels_of(vehicle, "check_estimator_gnss_fusion_stopped") == [0x63]
    assert levels_of(vehicle, "check_estimator_gnss_fusion_started") == [0x66]


def test_a_position_that_is_about_to_be_lost_is_told_once() -> None:
    """0.9 of 2.5 times COM_POS_FS_EPH (setModeRequirementFlags)."""
    vehicle = settled(COM_POS_FS_EPH=5.0)
    flags = EstimatorStatusFlags(vehicle.now_us, cs_inertial_dead_reckoning=True, cs_yaw_align=True)
    vehicle.topics.estimator_status_flags = flags
    for eph, told in ((11.2, []), (11.3, [0x63]), (11.4, [0x63])):
        vehicle.topics.vehicle_global_position = vehicle.topics.vehicle_global_position._replace(eph=eph)
        check(vehicle)
        assert levels_of(vehicle, "check_estimator_position_failure_imminent") == told


@pytest.mark.parametrize(
    ("status", "flags", "text", "may_hold", "may_fly_acro"),
    [
        ({"pre_flt_fail_innov_heading": True}, {}, "heading estimate invalid", False, True),
        ({"pre_flt_fail_innov_vel_vert": True}, {}, "vertical velocity unstable", False, True),
        ({}, {"cs_yaw_align": False}, "no heading reference", False, True),
        ({"pre_flt_fail_mag_field_disturbed": True}, {}, "Strong magnetic interference", True, True),
    ],
)
def test_what_the_filter_complains_of_forbids_the_modes_that_need_it(
    status: dict[str, Any], flags: dict[str, Any], text: str, may_hold: bool, may_fly_acro: bool
) -> None:
    vehicle = settled()
    topics = vehicle.topics
    topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True)
    topics.failsafe_flags = topics.failsafe_flags._replace(manual_control_signal_lost=False)  # of the run before
    topics.estimator_status = topics.estimator_status._replace(**status)
    topics.estimator_status_flags = EstimatorStatusFlags(vehicle.now_us, cs_yaw_align=True)._replace(**flags)
    check(vehicle)
    can_arm = topics.health_report.can_arm_mode_flags
    assert bool(can_arm >> NavState.AUTO_LOITER & 1) is may_hold
    assert bool(can_arm >> NavState.ACRO & 1) is may_fly_acro
    assert vehicle.take_texts() == [f"Preflight Fail: {text}"]


@pytest.mark.parametrize(
    ("bias", "event", "told"),
    [
        ({"accel_bias": (0.0, -0.34, 0.0)}, "accel", (1, -0.34, pytest.approx(0.3), pytest.approx(0.03))),
        ({"accel_bias": (0.0, -0.32, 0.0)}, None, ()),
        ({"accel_bias": (0.0, -0.34, 0.0), "accel_bias_valid": False}, None, ()),
        ({"gyro_bias": (0.0, 0.0, 0.2)}, "gyro", (2, 0.2, pytest.approx(0.1125), pytest.approx(0.03))),
    ],
)
def test_a_bias_near_its_limit_forbids_arming(bias: dict[str, Any], event: str | None, told: tuple[float, ...]) -> None:
    """PX4's checkSensorBias; measured: High Accelerometer Bias (flight orbit_15m)."""
    vehicle, variance = settled(), (1e-4, 1e-4, 1e-4)
    vehicle.topics.estimator_sensor_bias = EstimatorSensorBias(
        vehicle.now_us, gyro_bias=(0.0, 0.0, 0.0), gyro_bias_limit=0.15, gyro_bias_variance=variance,
        gyro_bias_valid=True, accel_bias=(0.0, 0.0, 0.0), accel_bias_limit=0.4, accel_bias_variance=variance,
        accel_bias_valid=True,
    )._replace(**bias)  # fmt: skip
    check(vehicle)
    failures = [each for each in vehicle.commander._checks._findings.failures if each.event.endswith("_bias")]
    expected = [(f"check_estimator_high_{event}_bias", told)] if event else []
    assert [(failure.event, failure.arguments) for failure in failures] == expected


def test_a_magnetic_field_that_is_another_forbids_arming_where_that_is_wanted() -> None:
    vehicle = settled(COM_ARM_MAG_STR=1)
    status = vehicle.topics.estimator_status
    vehicle.topics.estimator_status = status._replace(pre_flt_fail_mag_field_disturbed=True)
    check(vehicle)
    assert not vehicle.topics.health_report.can_arm_mode_flags & VALID_MODES


def test_a_global_position_and_a_home_may_be_wanted_for_arming() -> None:
    """COM_ARM_WO_GPS 0 (systemCheck)."""
    vehicle = settled(COM_ARM_WO_GPS=0)
    home = vehicle.topics.home_position
    vehicle.topics.home_position = HomePosition()
    check(vehicle)
    assert vehicle.take_texts() == ["Preflight Fail: Home position required"]
    vehicle.topics.home_position = home
    vehicle.run(2.1)
    assert vehicle.arm() == 0
    vehicle = settled(COM_ARM_WO_GPS=0)
    vehicle.topics.vehicle_global_position = VehicleGlobalPosition()
    check(vehicle)
    assert vehicle.take_texts() == ["Preflight Fail: Global position estimate required"]
    assert not vehicle.topics.health_report.can_arm_mode_flags


@pytest.mark.parametrize(
    ("parameters", "mode", "told"),
    [
        ({"COM_WIND_WARN": 5.0}, NavState.AUTO_LOITER, [("check_high_wind_warning", 0x64)]),
        ({"COM_WIND_WARN": 5.0}, NavState.AUTO_RTL, []),
        ({"COM_WIND_WARN": 7.0}, NavState.AUTO_LOITER, []),
        (
            {"COM_WIND_WARN": 5.0, "COM_WIND_MAX": 6.0, "COM_WIND_MAX_ACT": 1},
            NavState.AUTO_LOITER,
            [("check_above_wind_limits_warning", 0x44)],
        ),
        ({"COM_WIND_MAX": 6.0}, NavState.AUTO_LOITER, []),
    ],
)
def test_high_wind_is_told_at_once_and_every_minute(
    parameters: dict[str, float], mode: NavState, told: list[tuple[str, int]]
) -> None:
    """PX4's windCheck: events alone, and nobody who comes home already is advised to."""
    vehicle = settled(**parameters)
    vehicle.topics.vehicle_status = vehicle.topics.vehicle_status._replace(nav_state=mode)
    vehicle.topics.wind = WindEstimate(vehicle.now_us, 0.0, -6.5)
    vehicle.events.recent.clear()
    for later_s in (0, 59, 60, 61):
        vehicle.commander._checks.update(vehicle.now_us + later_s * 1_000_000)
        assert not vehicle.topics.failsafe_flags.wind_limit_exceeded
    names = ("check_high_wind_warning", "check_above_wind_limits_warning", "check_wind_too_high")
    heard = [(name, levels) for name in names for levels in levels_of(vehicle, name)]
    assert heard == [each for each in told for _ in range(2)]
