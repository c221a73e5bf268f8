"""Where home is: set by itself, by command, and what moves or turns it."""

import math

import pytest

from sitl_emu.autopilot.commander.home_position import in_local_frame
from sitl_emu.autopilot.topics import HomePosition
from sitl_emu.core import dialect as mavlink

from .navigation_fake import PLACE, FakeVehicle, item

ACCEPTED, TEMPORARILY_REJECTED, DENIED = range(3)


@pytest.fixture
def vehicle() -> FakeVehicle:
    ready = FakeVehicle()
    ready.run(3.0)
    return ready


def test_home_is_set_at_the_first_position_and_again_at_arming(vehicle: FakeVehicle) -> None:
    home = vehicle.topics.home_position
    assert home.valid
    vehicle.north = 0.4
    vehicle.step()
    assert vehicle.topics.home_position is home
    vehicle.arm()
    assert abs(vehicle.topics.home_position.x - 0.4) < 0.01


def test_home_follows_a_vehicle_that_is_carried_away_but_not_a_home_that_was_set(vehicle: FakeVehicle) -> None:
    vehicle.north = 20.0
    vehicle.run(0.3)
    assert abs(vehicle.topics.home_position.x - 20.0) < 0.1
    home = vehicle.topics.home_position
    there = (home.lat, home.lon, home.alt)
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, *there) == ACCEPTED
    vehicle.north = 0.0
    vehicle.run(0.3)
    vehicle.arm()
    assert vehicle.topics.home_position.x == pytest.approx(20.0, abs=0.1)
    assert vehicle.topics.home_position.manual_home
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, 1) == ACCEPTED
    assert vehicle.topics.home_position.x == pytest.approx(0.0, abs=0.1)
    assert not vehicle.topics.home_position.manual_home


@pytest.mark.parametrize("com_home_in_air", [0, 1])
def test_a_home_that_is_not_known_yet_may_be_set_in_the_air(com_home_in_air: int) -> None:
    vehicle = FakeVehicle(COM_HOME_IN_AIR=com_home_in_air)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.topics.home_position = HomePosition()
    vehicle.run(0.3)
    assert vehicle.topics.home_position.valid is bool(com_home_in_air)


def test_home_turns_with_a_heading_that_is_corrected(vehicle: FakeVehicle) -> None:
    """PX4's HomePosition::update."""
    vehicle.turned = 0.5
    vehicle.take_off(10.0)
    local = vehicle.topics.vehicle_local_position
    vehicle.topics.vehicle_local_position = local._replace(heading_reset_counter=1, delta_heading=0.2)
    for _ in range(2):
        vehicle.commander.update(vehicle.now_us)
        assert vehicle.topics.home_position.yaw == pytest.approx(0.7)


def test_home_follows_nobody_who_is_about_to_fly_a_mission(vehicle: FakeVehicle) -> None:
    """PX4's Commander::run: MISSION is chosen, and has not ended."""
    vehicle.upload(item(22, 0, 0, 10), item(16, 20, 0, 10))
    vehicle.run(0.2)
    assert vehicle.set_mode(4, 4) == ACCEPTED
    vehicle.step()
    vehicle.north = 20.0
    vehicle.run(0.3)
    assert vehicle.topics.home_position.x == pytest.approx(0.0, abs=0.1)
    vehicle.set_mode(4, 3)
    vehicle.run(0.3)
    assert vehicle.topics.home_position.x == pytest.approx(20.0, abs=0.1)


def test_home_stays_when_the_local_frame_moves(vehicle: FakeVehicle) -> None:
    home, local = vehicle.topics.home_position, vehicle.topics.vehicle_local_position
    lat, lon = PLACE.reproject(-100.0, 0.0)
    vehicle.topics.vehicle_local_position = local._replace(ref_lat=lat, ref_lon=lon, ref_timestamp=vehicle.now_us)
    moved = in_local_frame(vehicle.topics)
    assert (moved.lat, moved.lon, moved.update_count) == (home.lat, home.lon, home.update_count)
    assert abs(moved.x - home.x - 100.0) < 0.1


def test_home_is_denied_without_a_place_and_where_the_parameter_forbids_it(vehicle: FakeVehicle) -> None:
    nan = math.nan
    set_home = mavlink.MAV_CMD_DO_SET_HOME
    assert vehicle.result(set_home, 0, 0, 0, 0, nan, 8.5, 490.0) == DENIED
    assert vehicle.result(set_home, 0, 0, 0, -90.0, 47.4, 8.5, 490.0) == ACCEPTED
    assert abs(vehicle.topics.home_position.yaw - math.radians(270.0)) < 1e-6
    vehicle.parameters.set("COM_HOME_EN", 0)
    assert vehicle.result(set_home, 1) == DENIED


def test_home_has_the_attitude_that_it_was_given(vehicle: FakeVehicle) -> None:
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, 0, 10.0, -10.0, 90.0, 47.4, 8.5, 490.0) == ACCEPTED
    home = vehicle.topics.home_position
    assert [round(math.degrees(angle)) for angle in (home.roll, home.pitch, home.yaw)] == [10, 350, 90]
    nan = math.nan
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, 0, nan, nan, 90.0, 47.4, 8.5, 490.0) == ACCEPTED
    assert (vehicle.topics.home_position.roll, vehicle.topics.home_position.pitch) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("param1", "here"), [(-1.0, False), (0.0, False), (0.5, False), (0.51, True), (1.0, True), (math.nan, False)]
)
def test_home_is_set_here_from_a_half_on(vehicle: FakeVehicle, param1: float, here: bool) -> None:
    """PX4's Commander::handle_command: `param1 > 0.5` takes the vehicle's place, all else the place that is given."""
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, param1, 0, 0, 0, 47.4, 8.5, 490.0) == ACCEPTED
    home, position = vehicle.topics.home_position, vehicle.topics.vehicle_global_position
    assert (home.lat, home.lon) == ((position.lat, position.lon) if here else (47.4, 8.5))
    assert home.manual_home is not here


@pytest.mark.parametrize("place", [(math.nan, 8.5, 490.0), (47.4, math.nan, 490.0), (47.4, 8.5, math.nan)])
def test_a_home_wants_its_whole_place(vehicle: FakeVehicle, place: tuple[float, float, float]) -> None:
    before = vehicle.topics.home_position
    assert vehicle.result(mavlink.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, *place) == DENIED
    assert vehicle.topics.home_position is before
