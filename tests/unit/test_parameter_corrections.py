"""What PX4's modules make of parameters without sense; values as a real PX4 v1.18 told them."""

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.events import layout, pack
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters.corrections import ParameterCorrections
from sitl_emu.autopilot.parameters.subscription_interval import SubscriptionInterval
from sitl_emu.autopilot.vehicle_kind import VehicleKind

SECOND_US = 1_000_000


@pytest.mark.parametrize(
    ("name", "value", "corrected"),
    [
        ("LNDMC_Z_VEL_MAX", 3.0, 0.25),
        ("LNDMC_Z_VEL_MAX", 0.2, pytest.approx(0.2)),
        ("CAL_MAG_SIDES", 1, 63),
        ("IMU_INTEG_RATE", 20_000, 1000),
        ("IMU_INTEG_RATE", 0, 50),
        ("IMU_GYRO_RATEMAX", 0, 800),
        ("IMU_GYRO_RATEMAX", 20_000, 10_000),
        ("EKF2_MAG_TYPE", 3, 0),
        ("EKF2_MAG_TYPE", 5, 5),
        ("MAV_TYPE", 99, 0),
        ("CAL_MAG0_PRIO", 200, -1),
        ("CAL_BARO0_PRIO", -2, -1),
        ("CAL_ACC0_PRIO", 100, 100),
    ],
)
def test_a_value_without_sense_is_set_right(name: str, value: float, corrected: float) -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER, {"IMU_GYRO_RATEMAX": 800})
    corrections = ParameterCorrections(parameters, Texts(), VehicleKind.MULTICOPTER.traits)
    parameters.set(name, value)
    corrections.update(SECOND_US)
    assert parameters[name] == corrected


def test_the_sides_to_calibrate_are_told_under_their_old_name_too() -> None:
    parameters = Parameters(VehicleKind.ROVER_ACKERMANN)
    corrections = ParameterCorrections(parameters, Texts(), VehicleKind.ROVER_ACKERMANN.traits)
    parameters.set("SENS_MAG_SIDES", 34)
    corrections.update(SECOND_US)
    assert parameters["CAL_MAG_SIDES"] == 34


def test_a_rover_has_no_land_detector_that_would_correct_its_speed() -> None:
    parameters = Parameters(VehicleKind.ROVER_ACKERMANN)
    corrections = ParameterCorrections(parameters, Texts(), VehicleKind.ROVER_ACKERMANN.traits)
    parameters.set("LNDMC_Z_VEL_MAX", 3.0)
    corrections.update(SECOND_US)
    assert parameters["LNDMC_Z_VEL_MAX"] == 3.0


def test_ekf2_says_what_it_reset() -> None:
    texts, parameters = Texts(), Parameters(VehicleKind.MULTICOPTER)
    corrections = ParameterCorrections(parameters, texts, VehicleKind.MULTICOPTER.traits)
    parameters.set("EKF2_MAG_TYPE", 3)
    corrections.update(SECOND_US)
    (said,), (event,) = texts.recent, texts.events.recent
    assert (said.module, said.text) == ("ekf2", "EKF2_MAG_TYPE invalid, resetting to default")
    event_id, formats = layout("ekf2_mag_type_invalid")
    assert (event.id, event.arguments) == (event_id, pack(formats, (3.0,)))


def test_the_land_detector_tells_the_log_alone() -> None:
    texts, parameters = Texts(), Parameters(VehicleKind.MULTICOPTER, {"LNDMC_Z_VEL_MAX": 0.9})
    ParameterCorrections(parameters, texts, VehicleKind.MULTICOPTER.traits)
    (said,) = texts.lines
    told = "LNDMC_Z_VEL_MAX > MPC_LAND_CRWL or MPC_LAND_SPEED, updating 0.900 -> 0.250"
    assert (said.severity, said.line, len(texts.recent)) == (Severity.ERROR, f"[land_detector] {told}", 0)


def test_the_estimator_lags_behind_as_long_as_its_latest_sensor() -> None:
    """EKF2.cpp, VerifyParams: an event without a text."""
    texts, parameters = Texts(), Parameters(VehicleKind.MULTICOPTER)
    corrections = ParameterCorrections(parameters, texts, VehicleKind.MULTICOPTER.traits)
    parameters.set("EKF2_EV_DELAY", 200.0)
    corrections.update(SECOND_US)
    assert not texts.events.recent
    parameters.set("EKF2_EV_DELAY", 250.0)
    corrections.update(3 * SECOND_US)
    assert parameters["EKF2_DELAY_MAX"] == 250.0
    (event,) = texts.events.recent
    event_id, formats = layout("nf_delay_max_too_small")
    assert (event.id, event.arguments, len(texts.recent)) == (event_id, pack(formats, (200.0, 250.0)), 0)


@pytest.mark.parametrize(
    ("kind", "wanted", "corrected", "event"),
    [
        (VehicleKind.MULTICOPTER, {"RC_MAP_ARM_SW": 7}, ("MAN_ARM_GESTURE", 0), "stick_gesture_disabled_by_arm_switch"),
        (VehicleKind.MULTICOPTER, {"MC_AIRMODE": 2}, ("MC_AIRMODE", 1), "commander_airmode_requires_no_arm_gesture"),
        (VehicleKind.MULTICOPTER, {"MC_AIRMODE": 2, "MAN_ARM_GESTURE": 0}, ("MC_AIRMODE", 2), None),
        (
            VehicleKind.ROVER_ACKERMANN,
            {"RC_MAP_ARM_SW": 7},
            ("MAN_ARM_GESTURE", 0),
            "stick_gesture_disabled_by_arm_switch",
        ),
    ],
)
def test_sticks_arm_neither_beside_a_switch_nor_against_an_air_mode_with_yaw(
    kind: VehicleKind, wanted: dict[str, int], corrected: tuple[str, int], event: str | None
) -> None:
    """PX4's ManualControl::updateParams."""
    texts, parameters = Texts(), Parameters(kind)
    corrections = ParameterCorrections(parameters, texts, kind.traits)
    for name, value in wanted.items():
        parameters.set(name, value)
    corrections.update(SECOND_US)
    name, value = corrected
    assert parameters[name] == value
    assert [(said.module, sent.id) for said, sent in zip(texts.recent, texts.events.recent, strict=True)] == (
        [("manual_control", layout(event)[0])] if event else []
    )


def test_some_corrections_are_not_told() -> None:
    """param_set_no_notification: LNDMC_Z_VEL_MAX is told with the next change of another parameter."""
    parameters = Parameters(VehicleKind.MULTICOPTER)
    corrections = ParameterCorrections(parameters, Texts(), VehicleKind.MULTICOPTER.traits)
    parameters.set("LNDMC_Z_VEL_MAX", 3.0)
    before = parameters.notifications
    corrections.update(SECOND_US)
    assert parameters.notifications == before
    assert "LNDMC_Z_VEL_MAX" in parameters.unsaved


def test_news_comes_once_an_interval_and_twice_after_a_pause() -> None:
    interval = SubscriptionInterval(SECOND_US, seen=0)
    assert not interval.updated(5 * SECOND_US, 0)
    assert interval.updated(5 * SECOND_US, 1)
    assert interval.updated(5 * SECOND_US + 1, 2)
    assert not interval.updated(6 * SECOND_US - 1, 3)
    assert interval.updated(6 * SECOND_US, 4)
    assert not interval.updated(7 * SECOND_US, 4)
