"""Where a vehicle holds that has been moving, and what setpoints other modes leave to HOLD; after PX4's navigator."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, item
from .navigator_missions import LOITER_TIME, TAKEOFF, WAYPOINT, run_until

NAN = math.nan
REPOSITION, CHANGE_ALTITUDE = mavlink.MAV_CMD_DO_REPOSITION, mavlink.MAV_CMD_DO_CHANGE_ALTITUDE
CHANGE_SPEED, AIRSPEED, GROUND_SPEED = mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 1
MANUAL, POSITION, TAKEOFF_MODE, HOLD, MISSION, LAND_MODE = (1,), (3,), (4, 2), (4, 3), (4, 4), (4, 6)
"""DO_SET_MODE."""
NORTH_M_S = 4.0
BRAKES_WITHIN_M = NORTH_M_S * (NORTH_M_S / (2.0 * 3.0) + 0.6)
"""At MPC_ACC_HOR 3 m/s^2 (Navigator::preproject_stop_point)."""


class Moving(FakeVehicle):
    """A vehicle that is told to move north once `vx` is set."""

    vx = 0.0

    def _sense(self) -> None:
        super()._sense()
        self.topics.vehicle_local_position = self.topics.vehicle_local_position._replace(vx=self.vx)


def flying(up_m: float = 20.0, **parameters: float) -> Moving:
    vehicle = Moving(**{"MPC_ACC_HOR": 3.0, "COM_RC_IN_MODE": 4} | parameters)
    vehicle.run(3.0)
    vehicle.take_off(up_m)
    return vehicle


def on_a_mission(*items: MissionItem, **parameters: float) -> Moving:
    """20 m up, on the way to its second item."""
    vehicle = Moving(**{"MPC_ACC_HOR": 3.0} | parameters)
    vehicle.run(3.0)
    vehicle.upload(item(TAKEOFF, 0, 0, 20), *items)
    vehicle.run(0.1)
    assert vehicle.set_mode(*MISSION) == 0
    assert vehicle.arm() == 0
    run_until(vehicle, 0)
    vehicle.run(2.0)
    return vehicle


def current(vehicle: FakeVehicle) -> Any:
    return vehicle.topics.position_setpoint_triplet.current


def ahead_m(vehicle: FakeVehicle) -> float:
    """How far north of the vehicle its setpoint is."""
    return PLACE.project(current(vehicle).lat, current(vehicle).lon)[0] - vehicle.north


# --- where it comes to rest -------------------------------------------------------------------------------------


def test_a_mission_that_is_paused_brakes_ahead() -> None:
    vehicle = on_a_mission(item(WAYPOINT, 200, 0, 20))
    vehicle.vx = NORTH_M_S
    assert vehicle.set_mode(*HOLD) == 0
    vehicle.step()
    before = vehicle.north
    while current(vehicle).type != SetpointType.LOITER:
        before = vehicle.north
        vehicle.step()
    north = PLACE.project(current(vehicle).lat, current(vehicle).lon)[0]
    assert north - before == pytest.approx(BRAKES_WITHIN_M, abs=0.3)


def test_a_mission_paused_while_it_holds_goes_on_holding_there() -> None:
    vehicle = on_a_mission(item(LOITER_TIME, 15, 0, 20, 60.0, 0.0, 30.0), NAV_ACC_RAD=2.0)
    vehicle.run(10.0)
    vehicle.vx = NORTH_M_S
    assert vehicle.set_mode(*HOLD) == 0
    vehicle.run(0.2)
    held = current(vehicle)
    assert PLACE.project(held.lat, held.lon)[0] == pytest.approx(15.0, abs=0.1)
    assert (held.type, held.loiter_radius) == (SetpointType.LOITER, 30.0)


def test_without_a_mission_it_holds_where_it_is_and_brakes_no_way() -> None:
    """MissionBase::setEndOfMissionItems; HOLD, which the commander changes to, goes on from that setpoint."""
    vehicle = flying(NAV_MIN_LTR_ALT=30.0)
    vehicle.dataman.current_seq = 0
    vehicle.vx = NORTH_M_S
    vehicle.upload()
    vehicle.topics.vehicle_status = vehicle.topics.vehicle_status._replace(nav_state=NavState.AUTO_MISSION)
    vehicle.navigator.update(vehicle.now_us + 1)
    assert current(vehicle).type == SetpointType.LOITER
    assert ahead_m(vehicle) == pytest.approx(0.0, abs=0.01)
    assert current(vehicle).alt == pytest.approx(vehicle.topics.home_position.alt + 30.0)


def test_a_landing_brakes_ahead_and_its_altitude_is_the_seas() -> None:
    vehicle = flying()
    vehicle.vx = NORTH_M_S
    assert vehicle.set_mode(*LAND_MODE) == 0
    vehicle.step()
    while current(vehicle).type != SetpointType.LAND:
        vehicle.step()
    assert ahead_m(vehicle) == pytest.approx(BRAKES_WITHIN_M, abs=0.3)
    assert current(vehicle).alt == 0.0


def test_a_rover_holds_where_it_is() -> None:
    rover = Moving(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    rover.arm()
    rover.run(1.0)
    rover.vx = NORTH_M_S
    assert rover.result(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == 0
    rover.step()
    assert current(rover).type == SetpointType.LOITER
    assert ahead_m(rover) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(("least_m", "held_m"), [(-1.0, 20.0), (15.0, 20.0), (30.9, 30.0)])
def test_it_holds_no_lower_than_nav_min_ltr_alt_in_whole_metres(least_m: float, held_m: float) -> None:
    vehicle = on_a_mission(item(WAYPOINT, 200, 0, 20), NAV_MIN_LTR_ALT=least_m)
    assert vehicle.set_mode(*HOLD) == 0
    vehicle.run(0.2)
    assert current(vehicle).alt - vehicle.topics.home_position.alt == pytest.approx(held_m, abs=0.2)


# --- without a ground station -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("goes_back", "there_m"), [(1, 11.8), (0, 280.0)])
def test_a_failsafes_hold_goes_back_to_where_a_ground_station_was_heard(goes_back: int, there_m: float) -> None:
    """NAV_LTR_LAST_DL; a link tells of its station for 2.36 s more. Here HOLD is flown already."""
    vehicle = flying(NAV_LTR_LAST_DL=goes_back, NAV_DLL_ACT=1, COM_DL_LOSS_T=5, COM_FAIL_ACT_T=1.0)
    vehicle.reposition(300.0, 0.0, 20.0)
    vehicle.run(4.0)
    vehicle.gcs = False
    heard_north = vehicle.north
    vehicle.run(14.0)
    assert (vehicle.mode, vehicle.topics.vehicle_status.failsafe) == (NavState.AUTO_LOITER, True)
    north_m = PLACE.project(current(vehicle).lat, current(vehicle).lon)[0]
    assert north_m - heard_north == pytest.approx(there_m, abs=1.0)


def test_a_mission_without_a_ground_station_goes_back_in_hold() -> None:
    vehicle = on_a_mission(item(WAYPOINT, 200, 0, 20), NAV_LTR_LAST_DL=1, NAV_DLL_ACT=1, COM_DL_LOSS_T=5)
    vehicle.gcs = False
    heard_north = vehicle.north
    vehicle.run(14.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    north_m = PLACE.project(current(vehicle).lat, current(vehicle).lon)[0]
    assert north_m - heard_north == pytest.approx(11.8, abs=1.0)


# --- repositions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("yaw", "altitude_m"), [(1.5, NAN), (NAN, HOME_ALT + 25.0)])
def test_a_reposition_without_a_place_keeps_that_of_the_mission(yaw: float, altitude_m: float) -> None:
    """It is worked out before the mode changes (Navigator::run)."""
    vehicle = on_a_mission(item(WAYPOINT, 200, 0, 20))
    assert vehicle.result(REPOSITION, -1, 1, 0, yaw, NAN, NAN, altitude_m) == 0
    vehicle.run(0.2)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert PLACE.project(current(vehicle).lat, current(vehicle).lon)[0] == pytest.approx(200.0, abs=0.1)
    assert current(vehicle).alt == pytest.approx(HOME_ALT + (20.0 if math.isnan(altitude_m) else 25.0), abs=0.3)


def test_a_change_to_no_altitude_holds_the_present_one_at_the_setpoint() -> None:
    vehicle = flying()
    vehicle.reposition(100.0, 0.0, 30.0)
    vehicle.run(4.0)
    vehicle.vx = NORTH_M_S
    assert vehicle.result(CHANGE_ALTITUDE, NAN, 1) == 0
    up_m = vehicle.up
    vehicle.run(0.1)
    assert PLACE.project(current(vehicle).lat, current(vehicle).lon)[0] == pytest.approx(100.0, abs=0.1)
    assert current(vehicle).alt == pytest.approx(HOME_ALT + up_m, abs=0.2)


# --- takeoff, landing and the speed -----------------------------------------------------------------------------


def test_hold_before_the_takeoff_has_lifted_off_takes_off_all_the_same() -> None:
    """Loiter::set_loiter_position leaves the setpoint as it is on the ground."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, HOME_ALT + 6.0)
    vehicle.run(0.2)
    assert vehicle.set_mode(*HOLD) == 0
    vehicle.run(0.2)
    assert (vehicle.mode, vehicle.landed) == (NavState.AUTO_LOITER, True)
    assert current(vehicle).type == SetpointType.TAKEOFF
    vehicle.run(10.0)
    assert vehicle.up == pytest.approx(6.0, abs=0.1)


def test_on_the_ground_hold_has_no_setpoint() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.run(1.0)
    assert (current(vehicle).valid, current(vehicle).type) == (False, SetpointType.IDLE)


def test_a_landing_forgets_the_speed_that_was_asked_for() -> None:
    """Its own setpoint still has it (Land::on_activation)."""
    vehicle = flying()
    vehicle.command(CHANGE_SPEED, AIRSPEED, 3.0, -1)
    vehicle.run(0.1)
    assert vehicle.set_mode(*LAND_MODE) == 0
    vehicle.run(0.2)
    assert current(vehicle).cruising_speed == 3.0
    assert vehicle.set_mode(*HOLD) == 0
    vehicle.run(0.2)
    assert current(vehicle).cruising_speed == -1.0


def test_a_speed_asked_for_on_the_ground_is_the_takeoffs() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.command(CHANGE_SPEED, GROUND_SPEED, 3.0, -1)
    vehicle.run(0.1)
    vehicle.arm()
    vehicle.set_mode(*TAKEOFF_MODE)
    vehicle.run(0.3)
    assert (current(vehicle).type, current(vehicle).cruising_speed) == (SetpointType.TAKEOFF, 3.0)
    vehicle.run(20.0)
    assert (current(vehicle).type, current(vehicle).cruising_speed) == (SetpointType.LOITER, -1.0)


def test_a_rover_that_takes_off_elsewhere_drives_back_to_where_it_was() -> None:
    """Takeoff::on_active: its item is where the vehicle was."""
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    rover.arm()
    rover.run(1.0)
    rover.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, *PLACE.reproject(30.0, 0.0), HOME_ALT)
    rover.run(0.3)
    assert rover.modes == ["AUTO_LOITER", "AUTO_TAKEOFF", "AUTO_LOITER"]
    assert ahead_m(rover) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize(("moves", "at_once"), [(False, True), (True, False)])
def test_behind_a_place_to_hold_at_the_navigator_takes_no_command_before_it_hears_its_status(
    moves: bool, at_once: bool
) -> None:
    """Navigator::run, _wait_for_vehicle_status_timestamp: which is told every 0.5 s, and when it changes."""
    vehicle = flying()
    if moves:
        assert vehicle.reposition(20.0, 0.0, 10.0) == 0
    assert vehicle.command(CHANGE_SPEED, GROUND_SPEED, 3.0) is None
    vehicle.run(0.2)
    assert (len(vehicle.topics.vehicle_command_acks) == 1) is at_once
    vehicle.run(0.5)
    (ack,) = vehicle.topics.vehicle_command_acks
    assert (ack.command.command, ack.result) == (CHANGE_SPEED, 0)
    assert vehicle.navigator._state.cruising_speed_m_s == 3.0


def test_a_command_a_moment_after_a_place_to_hold_at_is_not_delayed() -> None:
    """It tells the status itself (Commander::handle_command)."""
    vehicle = flying()
    assert vehicle.reposition(20.0, 0.0, 10.0) == 0
    vehicle.step()
    vehicle.command(CHANGE_SPEED, GROUND_SPEED, 3.0)
    vehicle.run(0.2)
    assert len(vehicle.topics.vehicle_command_acks) == 1
