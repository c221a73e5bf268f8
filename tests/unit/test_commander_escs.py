"""Speed controllers that are hot, silent, or do not let their motors turn.

What is expected is what a PX4 v1.18 did (its SIH, hexacopter and rover, with these parameters), where no other source
is named.
"""

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import EscStatus
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from tests.typed import now

from .navigation_fake import FakeVehicle

MOTORS_ESCS = 1 << 8
MOTOR_OUTPUTS = 0x8000
"""MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS."""
HOT = "High ESC temperature. Reduce throttle!"


def ready(kind: VehicleKind = VehicleKind.MULTICOPTER, /, **parameters: float) -> FakeVehicle:
    vehicle = FakeVehicle(kind, **parameters)
    vehicle.run(4.0)
    vehicle.take_texts()
    return vehicle


def failures(vehicle: FakeVehicle) -> list[tuple[str, tuple[float, ...]]]:
    """Of the last round of checks, by speed controllers."""
    found = vehicle.commander._checks._findings.failures
    return [(each.event, each.arguments) for each in found if each.component == MOTORS_ESCS]


@pytest.mark.parametrize(("warned_from", "told", "said"), [
    (40.0, 6, [HOT]),
    (50.0, 0, [HOT]),
    (52.0, 0, []),
    (-1.0, 0, []),
])  # fmt: skip
def test_controllers_of_50_degrees_are_too_hot_for_some(warned_from: float, told: int, said: list[str]) -> None:
    vehicle = ready()
    vehicle.parameters.set("ESC_TEMP_WARN_TH", warned_from)
    vehicle.run(3.0)
    vehicle.arm()  # which reports
    vehicle.run(1.0)
    event = "check_esc_over_temperature"
    assert failures(vehicle) == [(event, (number, 50)) for number in range(1, told + 1)]
    assert [text for text in vehicle.take_texts() if "ESC" in text] == said
    assert vehicle.armed


def test_heat_is_told_again_only_after_five_degrees_less() -> None:
    """escCheck.cpp, checkEscTemperature."""
    vehicle = ready(ESC_TEMP_WARN_TH=45.0)
    for warned_from, said in ((52.0, 0), (45.0, 0), (56.0, 0), (45.0, 1)):
        vehicle.parameters.set("ESC_TEMP_WARN_TH", warned_from)
        vehicle.run(2.2)
        assert vehicle.take_texts().count(HOT) == said


def test_a_rover_whose_motor_rests_is_disarmed_where_controllers_have_to_let_it_turn() -> None:
    rover = ready(VehicleKind.ROVER_ACKERMANN, FD_ACT_EN=1)
    assert not rover.topics.health_report.present & MOTOR_OUTPUTS
    assert rover.arm() == 0
    rover.run(0.4)
    assert now(rover.armed)
    assert rover.topics.health_report.present & MOTOR_OUTPUTS
    rover.run(0.3)
    assert not rover.armed
    texts = [text for text in rover.take_texts() if text != "Takeoff detected"]  # the fake rover drives off meanwhile
    assert texts == ["Armed by external command", "Failsafe activated", "Disarmed by failsafe"]


def test_motors_that_turn_are_let() -> None:
    vehicle = ready(FD_ACT_EN=1)
    vehicle.rpm = (1000,) * 6
    assert vehicle.arm() == 0
    vehicle.run(2.0)
    assert vehicle.armed
    vehicle.rpm = (0,) * 6
    vehicle.run(2.5)  # it is no failsafe after spoolup
    assert vehicle.armed
    assert "ESC failure: Not all ESCs are armed. Land now!" in vehicle.take_texts()


def test_telemetry_that_never_came_is_missed() -> None:
    vehicle = FakeVehicle(COM_ARM_CHK_ESCS=1)
    vehicle.rpm = ()
    vehicle.run(2.9)
    assert failures(vehicle) == []
    vehicle.run(0.3)
    assert failures(vehicle) == [("check_escs_telem_missing", ())]
    assert vehicle.arm() != 0


@pytest.mark.parametrize(("act", "mode"), [
    (0, NavState.AUTO_LOITER),
    (2, NavState.AUTO_LAND),
    (3, NavState.AUTO_RTL),
    (4, NavState.TERMINATION),
])  # fmt: skip
def test_controllers_that_fall_silent_are_a_failure_of_motors(act: int, mode: NavState) -> None:
    """COM_ACT_FAIL_ACT after the hold (PX4's escCheck.cpp and failsafe.cpp)."""
    vehicle = ready(COM_ARM_CHK_ESCS=1, COM_ACT_FAIL_ACT=act, COM_FAIL_ACT_T=1.0)
    vehicle.take_off(20.0)
    vehicle.take_texts()
    vehicle.rpm = ()
    vehicle.topics.esc_status = EscStatus(vehicle.now_us, (4000,) * 6)
    vehicle.run(0.4)
    assert failures(vehicle) == []
    vehicle.run(0.2)
    assert failures(vehicle) == [("check_escs_offline", (number,)) for number in range(1, 7)]
    vehicle.run(2.5)
    assert vehicle.mode is mode
    assert "ESC1 ESC2 ESC3 ESC4 ESC5 ESC6 offline. Land now!" in vehicle.take_texts()
    vehicle.run(0.5)
    detected = vehicle.topics.failure_detector_status
    assert (detected.fd_motor, detected.fd_arm_escs, detected.motor_failure_mask) == (True, True, 0b111111)
