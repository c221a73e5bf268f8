"""Where home is: set by itself, by command, and what moves or turns it."""

import math

import pytest

from sitl_emu.autopilot.commander.home_altitude import HomeAltitude
from sitl_emu.autopilot.topics import HomePosition, SensorGps, VehicleAirData, VehicleGlobalPosition
from sitl_emu.core import dialect as mavlink

from .navigation_fake import FakeVehicle, item, ready

ACCEPTED, TEMPORARILY_REJECTED, DENIED = range(3)


@pytest.fixture
def vehicle() -> FakeVehicle:
    return ready()


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


@pytest.mark.parametrize(("risen_m", "follows"), [(1.2, False), (1.7, True)])
def test_home_follows_a_vehicle_that_was_lifted(vehicle: FakeVehicle, risen_m: float, follows: bool) -> None:
    """By 1.5 m, or twice what the height may be off (0.8 m here); PX4's hasMovedFromCurrentHomeLocation."""
    vehicle.up = risen_m
    vehicle.run(0.2)
    assert (vehicle.topics.home_position.z == -risen_m) is follows


def test_home_stays_where_it_was_when_the_local_frame_moves(vehicle: FakeVehicle) -> None:
    """PX4 works out a home's x, y, z when it is set, and never again."""
    vehicle.take_off(5.0)
    home, local = vehicle.topics.home_position, vehicle.topics.vehicle_local_position
    vehicle.topics.vehicle_local_position = local._replace(ref_lat=47.0, ref_timestamp=vehicle.now_us)
    vehicle.commander.update(vehicle.now_us + 200_000)
    assert vehicle.topics.home_position is home


GOOD_GPS = SensorGps(1, 47.4, 8.5, 490.0, fix_type=3, eph=0.9, epv=1.8, s_variance_m_s=0.3)


@pytest.mark.parametrize(
    ("gps", "ekf2_gps_ctrl", "is_set"),
    [
        (GOOD_GPS, 7, True),
        (GOOD_GPS, 1, False),
        (GOOD_GPS._replace(fix_type=1), 7, False),
        (GOOD_GPS._replace(eph=5.1), 7, False),
        (GOOD_GPS._replace(epv=10.1), 7, False),
        (GOOD_GPS._replace(s_variance_m_s=1.1), 7, False),
    ],
)
def test_a_good_receiver_gives_a_home_before_the_filter_knows_a_place(
    gps: SensorGps, ekf2_gps_ctrl: int, is_set: bool
) -> None:
    """PX4's HomePosition::update; it has no place in the local frame yet."""
    vehicle = FakeVehicle(EKF2_GPS_CTRL=ekf2_gps_ctrl)
    vehicle.topics.sensor_gps = gps
    vehicle.commander.update(100_000)
    vehicle.commander.update(200_000)
    home = vehicle.topics.home_position
    assert (home.valid, home.valid_lpos) == (is_set, False)
    assert not is_set or (home.lat, home.lon, home.alt) == (47.4, 8.5, 490.0)
    assert vehicle.topics.failsafe_flags.home_position_invalid is not is_set
    vehicle.run(3.0)
    assert vehicle.topics.home_position.valid and vehicle.topics.home_position.valid_lpos


@pytest.mark.parametrize(
    ("drift_m", "climbs_as_well", "after_s", "lowered_m"),
    [
        (5.0, False, 10.0, -5.0),  # the receiver says that it is higher and higher, and its climb rate does not
        (-5.0, False, 10.0, 5.0),
        (0.9, False, 10.0, 0.0),
        (5.0, True, 10.0, 0.0),  # so is the barometer wrong
        (5.0, False, 121.0, 0.0),
    ],
)
def test_home_follows_a_drift_of_the_receivers_height_after_takeoff(
    vehicle: FakeVehicle, drift_m: float, climbs_as_well: bool, after_s: float, lowered_m: float
) -> None:
    """PX4's HomePosition::update: barometer and climb rate agree against the receiver's height."""
    vehicle.take_off(5.0)
    home, topics = vehicle.topics.home_position, vehicle.topics
    altitude = HomeAltitude(topics)
    altitude.takeoff_us = takeoff_us = vehicle.now_us
    now_us = takeoff_us + round(after_s * 1e6)
    for step in range(11):
        gps_m, vel_d = 490.0 + drift_m * step / 10, -drift_m if climbs_as_well else 0.0
        topics.sensor_gps = GOOD_GPS._replace(timestamp=now_us, altitude_msl_m=gps_m, vel_d_m_s=vel_d)
        topics.vehicle_air_data = VehicleAirData(now_us, now_us, 480.0)
        altitude.update(now_us, trusted=True)
        now_us += 100_000
    assert topics.home_position.alt - home.alt == pytest.approx(-lowered_m, abs=1.0)
    assert topics.home_position.z - home.z == pytest.approx(lowered_m, abs=1.0)
    assert (topics.home_position is home) is (lowered_m == 0.0)


def test_home_is_corrected_in_flight(vehicle: FakeVehicle) -> None:
    vehicle.take_off(5.0)
    home, topics = vehicle.topics.home_position, vehicle.topics
    for step in range(20):
        topics.sensor_gps = GOOD_GPS._replace(timestamp=vehicle.now_us, altitude_msl_m=490.0 + step, vel_d_m_s=0.0)
        topics.vehicle_air_data = VehicleAirData(vehicle.now_us, vehicle.now_us, 480.0)
        vehicle.commander.update(vehicle.now_us)
        vehicle.now_us += 20_000
    assert topics.home_position.alt == pytest.approx(home.alt + 17.0, abs=2.0)


@pytest.mark.parametrize("com_home_in_air", [0, 1])
def test_a_home_without_a_place_on_the_globe_gets_one_in_the_air(com_home_in_air: int) -> None:
    """It is where the vehicle took off, not where it is (setInAirHomePosition)."""
    vehicle = FakeVehicle(COM_HOME_IN_AIR=com_home_in_air)
    vehicle.run(3.0)
    vehicle.take_off(5.0)
    home = vehicle.topics.home_position
    vehicle.topics.home_position = home._replace(valid=False, lat=math.nan, lon=math.nan, alt=math.nan)
    vehicle.north = 40.0
    vehicle.run(0.2)
    now = vehicle.topics.home_position
    assert now.valid is bool(com_home_in_air) and (now.x, now.y, now.z) == (home.x, home.y, home.z)
    assert not now.valid or (now.lat, now.lon) == pytest.approx((home.lat, home.lon), abs=1e-6)


def test_a_home_without_a_place_in_the_local_frame_gets_one_in_the_air(vehicle: FakeVehicle) -> None:
    vehicle.parameters.set("COM_HOME_IN_AIR", 1)
    vehicle.take_off(5.0)
    home = vehicle.topics.home_position
    vehicle.topics.home_position = home._replace(x=math.nan, y=math.nan, z=math.nan)
    vehicle.run(0.2)
    now = vehicle.topics.home_position
    assert (now.x, now.y, now.z) == pytest.approx((home.x, home.y, home.z), abs=0.01)
    assert math.isnan(now.yaw)


def test_a_place_in_the_local_frame_alone_is_half_a_home(vehicle: FakeVehicle) -> None:
    """As by optical flow: nobody returns to it."""
    vehicle.topics.home_position = HomePosition()
    vehicle.topics.vehicle_global_position = VehicleGlobalPosition()
    vehicle.commander.update(vehicle.now_us + 200_000)
    home = vehicle.topics.home_position
    assert not home.valid and home.valid_lpos
    assert vehicle.topics.failsafe_flags.home_position_invalid


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
