"""Choosing modes, on the ground and in the air, as a person or a ground station sees it."""

import math

import pytest

from sitl_emu.autopilot.commander.custom_mode import base_mode_of, custom_mode_of
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, ready

ACCEPTED, TEMPORARILY_REJECTED, DENIED = range(3)
UNINIT = 0


@pytest.fixture
def vehicle() -> FakeVehicle:
    return ready()


@pytest.mark.parametrize(("main", "sub"), [(1, 0), (2, 0), (3, 0), (4, 4), (4, 5), (4, 6), (5, 0), (6, 0), (7, 0)])
def test_modes_that_cannot_be_flown_may_be_chosen_on_the_ground_but_not_armed(
    vehicle: FakeVehicle, main: int, sub: int
) -> None:
    assert vehicle.set_mode(main, sub) == ACCEPTED
    vehicle.step()
    assert vehicle.topics.vehicle_status.system_status == UNINIT
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Arming denied: Resolve system health failures first"]


@pytest.mark.parametrize(("main", "sub"), [(0, 0), (4, 1), (4, 7), (4, 10), (4, 20), (8, 0), (9, 0), (10, 0), (99, 0)])
def test_modes_that_nobody_may_choose(vehicle: FakeVehicle, main: int, sub: int) -> None:
    assert vehicle.set_mode(main, sub) == TEMPORARILY_REJECTED
    vehicle.step()
    assert vehicle.mode is NavState.AUTO_LOITER


def test_every_other_mode_is_accepted_on_the_ground_and_refused_in_the_air(vehicle: FakeVehicle) -> None:
    vehicle.take_off(5.0)
    vehicle.take_texts()
    for main, sub, name in ((1, 0, "Manual"), (3, 0, "Position"), (4, 4, "Mission"), (6, 0, "Offboard")):
        assert vehicle.set_mode(main, sub) == TEMPORARILY_REJECTED
        assert vehicle.take_texts() == [f"Switching to {name} is currently not available"]
        assert vehicle.set_mode(1, 0) == TEMPORARILY_REJECTED
        assert not vehicle.take_texts()  # one a second is enough
        vehicle.run(1.1)
    assert vehicle.mode is NavState.AUTO_LOITER


def test_standard_modes(vehicle: FakeVehicle) -> None:
    command = mavlink.MAV_CMD_DO_SET_STANDARD_MODE
    assert [vehicle.result(command, mode) for mode in range(10)] == [4, 0, 0, 4, 0, 0, 0, 0, 0, 4]
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    assert [rover.result(command, mode) for mode in range(10)] == [4, 4, 4, 4, 4, 0, 0, 0, 0, 4]


@pytest.mark.parametrize(
    ("flags", "result", "mode"),
    [
        (0, TEMPORARILY_REJECTED, NavState.AUTO_LOITER),
        (4, ACCEPTED, NavState.AUTO_MISSION),
        (148, ACCEPTED, NavState.AUTO_MISSION),
        (64, ACCEPTED, NavState.MANUAL),
        (64 + 16, ACCEPTED, NavState.STAB),
        (64 + 16 + 8, ACCEPTED, NavState.POSCTL),
    ],
)
def test_modes_by_base_mode_flags(vehicle: FakeVehicle, flags: int, result: int, mode: NavState) -> None:
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_MODE, flags) == result
    vehicle.step()
    assert vehicle.mode is mode


def test_change_altitude_is_for_who_holds_and_keeps_the_place(vehicle: FakeVehicle) -> None:
    vehicle.take_off(10.0)
    vehicle.set_mode(4, 5)
    vehicle.step()
    assert vehicle.result(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, HOME_ALT + 15.0) == TEMPORARILY_REJECTED
    assert now(vehicle.mode) is NavState.AUTO_RTL
    vehicle.set_mode(4, 3)
    vehicle.step()
    assert vehicle.result(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, HOME_ALT + 15.0) == ACCEPTED
    vehicle.run(5.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert abs(vehicle.up - 15.0) < 0.5
    assert math.hypot(vehicle.north, vehicle.east) < 0.5


def test_reposition_without_its_flag_is_for_who_holds(vehicle: FakeVehicle) -> None:
    vehicle.take_off(10.0)
    lat, lon = PLACE.reproject(20.0, 0.0)
    target = (-1, 0, 0, math.nan, lat, lon, HOME_ALT + 10.0)
    vehicle.set_mode(4, 2)
    vehicle.step()
    assert vehicle.result(mavlink.MAV_CMD_DO_REPOSITION, *target) == DENIED
    vehicle.step()
    assert vehicle.mode is NavState.AUTO_TAKEOFF
    vehicle.set_mode(4, 3)
    vehicle.run(6.0)
    assert abs(vehicle.north) < 1.0
    assert vehicle.result(mavlink.MAV_CMD_DO_REPOSITION, *target) == ACCEPTED
    vehicle.run(6.0)
    assert abs(vehicle.north - 20.0) < 1.0


def test_takeoff_never_descends(vehicle: FakeVehicle) -> None:
    vehicle.take_off(10.0)
    vehicle.take_texts()
    nan = math.nan
    assert vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 90.0, nan, nan, HOME_ALT + 3.0) == ACCEPTED
    vehicle.run(3.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert abs(vehicle.up - 10.0) < 0.5
    assert vehicle.take_texts() == ["Already higher than takeoff altitude"]


@pytest.mark.parametrize(
    ("flags", "main", "sub", "text"),
    [
        (0, 4, 3, "Unsupported base mode"),
        (1, 99, 0, "Unsupported main mode"),
        (1, 4, 99, "Unsupported auto mode"),
        (257, 260, 259, None),
    ],
)
def test_modes_that_px4_does_not_know_are_told(
    vehicle: FakeVehicle, flags: int, main: int, sub: int, text: str | None
) -> None:
    """Its numbers are eight bits wide: 257, 260, 259 are 1, 4, 3."""
    result = vehicle.result(mavlink.MAV_CMD_DO_SET_MODE, flags, main, sub)
    assert result == (ACCEPTED if text is None else TEMPORARILY_REJECTED)
    assert vehicle.take_texts() == ([] if text is None else [text])


def test_a_refused_mode_is_told_to_a_ground_station_alone(vehicle: FakeVehicle) -> None:
    vehicle.take_off(5.0)
    vehicle.take_texts()
    manual = VehicleCommand(mavlink.MAV_CMD_DO_SET_MODE, 1.0, 3.0, 0.0, source_component=191)
    for command in (manual, VehicleCommand(mavlink.MAV_CMD_DO_SET_STANDARD_MODE, 1.0, source_component=190)):
        answer = vehicle.commander.handle_command(vehicle.now_us, command)
        assert answer is not None
        assert (answer.result, vehicle.take_texts()) == (TEMPORARILY_REJECTED, [])
    assert vehicle.set_mode(3) == TEMPORARILY_REJECTED
    assert vehicle.take_texts() == ["Switching to Position is currently not available"]


def test_landing_is_never_refused(vehicle: FakeVehicle) -> None:
    """Without a position it comes down by the barometer; PX4 refuses DO_SET_STANDARD_MODE alone."""
    vehicle.take_off(30.0)
    vehicle.gps = False
    vehicle.run(2.0)
    assert vehicle.mode is NavState.DESCEND
    land = mavlink.MAV_STANDARD_MODE_LAND
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_STANDARD_MODE, land) == TEMPORARILY_REJECTED
    assert vehicle.result(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED
    assert vehicle.set_mode(4, 6) == ACCEPTED
    vehicle.step()
    assert vehicle.mode is NavState.DESCEND


@pytest.mark.parametrize(
    ("number", "mode"),
    [
        (9, NavState.FREE3),
        (11, NavState.FREE2),
        (16, NavState.FREE1),
        (31, NavState.FREE1),
        (99, NavState.FREE1),
        (-1, NavState.FREE1),
        (256 + 15, NavState.STAB),
        (17, NavState.AUTO_TAKEOFF),
    ],
)
def test_whatever_mode_it_shall_boot_into_it_starts(number: int, mode: NavState) -> None:
    """Commander's constructor takes eight bits of COM_FLTMODE_BOOT, whatever they mean."""
    vehicle = FakeVehicle(COM_FLTMODE_BOOT=number)
    vehicle.run(3.0)
    assert vehicle.mode is mode


def test_a_mode_that_is_none_is_armed_in_and_left() -> None:
    """As on PX4: custom mode 0, no controller, and nothing that it needs."""
    vehicle = FakeVehicle(COM_FLTMODE_BOOT=16)
    vehicle.run(3.0)
    control = vehicle.topics.vehicle_status.control_mode
    assert (custom_mode_of(vehicle.mode), base_mode_of(control, armed=False)) == (0, 1)
    assert vehicle.arm() == ACCEPTED
    assert vehicle.set_mode(4, 3) == ACCEPTED
    vehicle.step()
    assert vehicle.mode is NavState.AUTO_LOITER


def test_who_boots_into_takeoff_comes_back_to_position() -> None:
    """UserModeIntention.hpp: _nav_state_after_disarming, until a mode was chosen in which one can stay."""
    vehicle = FakeVehicle(COM_FLTMODE_BOOT=17)
    vehicle.run(3.0)
    assert vehicle.arm() == ACCEPTED
    assert vehicle.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196) == ACCEPTED
    vehicle.step()
    assert vehicle.mode is NavState.POSCTL
