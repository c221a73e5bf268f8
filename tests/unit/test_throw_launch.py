"""A multicopter that is thrown into the air (COM_THROW_EN)."""

import pytest

from sitl_emu.autopilot.commander.throw_launch import State
from sitl_emu.core import dialect as mavlink

from .navigation_fake import FakeVehicle


def moving(vehicle: FakeVehicle, vz: float) -> None:
    """One look of the commander at a vehicle of this velocity."""
    vehicle.topics.vehicle_local_position = vehicle.topics.vehicle_local_position._replace(vx=1.0, vz=vz)
    vehicle.commander.update(vehicle.now_us)


def test_motors_are_locked_until_it_falls() -> None:
    """PX4's MulticopterThrowLaunch: faster than COM_THROW_SPEED first, then downward."""
    vehicle = FakeVehicle(COM_THROW_EN=1)
    vehicle.run(3.0)
    assert vehicle.topics.actuator_armed.lockdown
    assert vehicle.topics.vehicle_status.system_status == mavlink.MAV_STATE_FLIGHT_TERMINATION
    assert vehicle.arm() == 0
    for vz, state, locked in (
        (1.0, State.ARMED, True),
        (1.0, State.ARMED, True),
        (-6.0, State.UNSAFE, True),
        (-1.0, State.UNSAFE, True),
        (0.5, State.FLYING, False),
        (0.0, State.FLYING, False),
    ):
        moving(vehicle, vz)
        assert (vehicle.commander._throw_launch.state, vehicle.topics.actuator_armed.lockdown) == (state, locked)
    assert vehicle.topics.vehicle_status.system_status == mavlink.MAV_STATE_ACTIVE
    assert vehicle.noted[-2:] == [
        "[commander] Throw detected, motors will start once falling",
        "[commander] Throw and fall detected, starting motors",
    ]


def test_who_waits_for_the_throw_is_not_disarmed() -> None:
    vehicle = FakeVehicle(COM_THROW_EN=1, COM_DISARM_PRFLT=2.0)
    vehicle.run(3.0)
    assert vehicle.arm() == 0
    vehicle.run(10.0)
    assert vehicle.armed


@pytest.mark.parametrize("armed", [False, True])
def test_who_flies_already_is_not_locked_by_the_parameter(armed: bool) -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    if armed:
        vehicle.take_off(5.0)
    vehicle.parameters.set("COM_THROW_EN", 1)
    vehicle.run(0.2)
    assert vehicle.topics.actuator_armed.lockdown is not armed
