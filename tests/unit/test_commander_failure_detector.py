"""What the failure detector finds, and what follows from it."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.system.failure_injection import MOTOR, OFF, STUCK
from sitl_emu.autopilot.topics import FailureInjection, VehicleLocalPositionSetpoint
from tests.typed import now

from .navigation_fake import FakeVehicle
from .test_commander_failsafe import flying


def sink(vehicle: FakeVehicle, to_up_m: float, wanted_up_m: float, seconds: float) -> None:
    """Down at 10 m/s while something higher is asked for."""
    for _ in range(round(seconds * 25)):
        vehicle.up = max(to_up_m, vehicle.up - 0.4)
        vehicle.topics.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint(vehicle.now_us, z=-wanted_up_m)
        vehicle.step()


@pytest.mark.parametrize(
    ("parameters", "to_up_m", "wanted_up_m", "found"),
    [
        ({"FD_ALT_LOSS": 3.0}, 16.0, 20.0, True),
        ({"FD_ALT_LOSS": 3.0}, 18.0, 20.0, False),
        ({"FD_ALT_LOSS": 3.0}, 16.0, 15.0, False),
        ({"FD_ALT_LOSS": 3.0}, 16.0, math.nan, False),
        ({"FD_ALT_LOSS": 3.0, "FD_ALT_LOSS_T": 3.0}, 16.0, 20.0, False),
        ({}, 1.0, 20.0, False),
    ],
)
def test_a_multicopter_that_sinks_below_its_setpoint(
    parameters: dict[str, float], to_up_m: float, wanted_up_m: float, found: bool
) -> None:
    """PX4's updateAltitudeStatus: from the highest place below the setpoint down, for FD_ALT_LOSS_T (1 s)."""
    vehicle = flying(20.0)
    for name, value in parameters.items():
        vehicle.parameters.set(name, value)
    sink(vehicle, to_up_m, wanted_up_m, 2.0)
    assert vehicle.topics.failure_detector_status.fd_alt is found
    assert vehicle.topics.failsafe_flags.fd_alt_loss is found
    assert ("Preflight Fail: Altitude failure" in vehicle.take_texts()) is found
    assert vehicle.mode is NavState.AUTO_LOITER


def test_a_loss_of_altitude_terminates_where_that_is_wanted() -> None:
    """CBRK_FLIGHTTERM 0; a height that is only corrected is no loss."""
    vehicle = flying(20.0, FD_ALT_LOSS=3.0, CBRK_FLIGHTTERM=0)
    sink(vehicle, 19.0, 20.0, 1.0)
    vehicle.up -= 10.0
    vehicle.z_resets, vehicle.delta_z = 1, 10.0
    sink(vehicle, 9.0, 20.0, 3.0)
    assert now(vehicle.mode) is NavState.AUTO_LOITER
    sink(vehicle, 1.0, 20.0, 3.0)
    assert vehicle.mode is NavState.TERMINATION


def test_motors_that_were_stopped_stand_in_its_status() -> None:
    """PX4's FailureInjector: the bits of failures that are OFF."""
    vehicle = FakeVehicle()
    vehicle.topics.failure_injection = FailureInjection(((MOTOR, OFF, 0b101), (MOTOR, STUCK, 0b010)))
    vehicle.run(0.6)
    assert vehicle.topics.failure_detector_status.motor_stop_mask == 0b101
