"""Takeoff, hold, land and return, on a point that is where its setpoint says."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.storage.dataman import RALLY, MissionItem, Plan
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, flying, place

NAN = math.nan


def test_takeoff_without_a_height_takes_the_parameter() -> None:
    vehicle = FakeVehicle(MIS_TAKEOFF_ALT=7.0)
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, NAN)
    vehicle.run(15.0)
    assert vehicle.take_texts() == [
        "Armed by external command",
        "Using default takeoff altitude: 7.0 m",
        "Takeoff detected",
    ]
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_TAKEOFF", "AUTO_LOITER"]
    assert vehicle.up == pytest.approx(7.0, abs=0.1)


def test_takeoff_before_arming_waits_and_keeps_the_height() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, HOME_ALT + 6.0)
    vehicle.run(1.0)
    vehicle.arm()
    vehicle.run(12.0)
    assert vehicle.take_texts() == ["Armed by external command", "Takeoff detected"]
    assert vehicle.up == pytest.approx(6.0, abs=0.1)


def test_a_takeoff_goes_up_where_the_vehicle_was_when_it_was_commanded() -> None:
    """Navigator::run; here it is carried elsewhere before it is armed."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, HOME_ALT + 6.0)
    vehicle.run(0.2)
    vehicle.north = 5.0
    vehicle.run(1.0)
    vehicle.arm()
    vehicle.run(0.2)
    current = vehicle.topics.position_setpoint_triplet.current
    assert PLACE.project(current.lat, current.lon)[0] == pytest.approx(0.0, abs=0.01)


def test_a_takeoff_that_is_refused_is_the_next_ones_height() -> None:
    """Navigator::run takes each NAV_TAKEOFF, whatever the commander answers."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.gps = False
    vehicle.run(1.0)
    assert vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, HOME_ALT + 6.0) == 1
    vehicle.gps = True
    vehicle.run(2.0)
    assert vehicle.set_mode(4, 2) == 0
    vehicle.run(0.2)
    assert vehicle.topics.position_setpoint_triplet.current.alt == pytest.approx(HOME_ALT + 6.0)


def test_a_takeoff_has_no_leg() -> None:
    """Takeoff::set_takeoff_position."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, HOME_ALT + 6.0)
    vehicle.run(1.0)
    triplet = vehicle.topics.position_setpoint_triplet
    assert (triplet.current.valid, triplet.previous.valid) == (True, False)


def test_hold_after_takeoff_stays_at_the_takeoff_setpoint() -> None:
    vehicle = flying(10.0)
    current = vehicle.topics.position_setpoint_triplet.current
    assert current.type == SetpointType.LOITER
    assert current.alt == pytest.approx(HOME_ALT + 10.0, abs=0.01)


def test_reposition_flies_there_with_its_speed_and_yaw() -> None:
    vehicle = flying()
    assert vehicle.reposition(50.0, 10.0, 15.0, speed=8.0, yaw=1.5) == 0
    vehicle.run(0.1)
    triplet = vehicle.topics.position_setpoint_triplet
    assert (triplet.current.cruising_speed, triplet.current.yaw) == (8.0, 1.5)
    assert not triplet.previous.valid
    vehicle.run(20.0)
    assert place(vehicle) == (50.0, 10.0, 15.0)
    assert vehicle.modes == ["AUTO_LOITER"]


def test_reposition_keeps_what_it_does_not_say() -> None:
    vehicle = flying()
    vehicle.result(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, NAN, NAN, NAN, HOME_ALT + 20.0)
    vehicle.run(10.0)
    assert place(vehicle) == (0.0, 0.0, 20.0)
    lat, lon = PLACE.reproject(5.0, 0.0)
    vehicle.result(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, NAN, lat, lon, NAN)
    vehicle.run(10.0)
    assert place(vehicle) == (5.0, 0.0, 20.0)


def test_change_speed_acts_on_the_leg_in_progress_and_ends_with_the_mode() -> None:
    vehicle = flying()
    vehicle.reposition(100.0, 0.0, 10.0)
    vehicle.run(0.1)
    vehicle.command(mavlink.MAV_CMD_DO_CHANGE_SPEED, 1, 3, -1)
    vehicle.run(0.1)
    current = vehicle.topics.position_setpoint_triplet.current
    assert current.cruising_speed == 3.0
    assert current.type == SetpointType.LOITER
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run(0.1)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == -1.0


def test_a_speed_that_is_no_ground_speed_waits_for_the_next_setpoint() -> None:
    vehicle = flying()
    vehicle.reposition(100.0, 0.0, 10.0)
    vehicle.run(0.1)
    vehicle.command(mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 3, -1)
    vehicle.run(0.1)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == -1.0
    vehicle.reposition(90.0, 0.0, 10.0)
    vehicle.run(0.1)
    assert vehicle.topics.position_setpoint_triplet.current.cruising_speed == 3.0


def test_land_ends_in_hold_disarmed() -> None:
    vehicle = flying()
    vehicle.result(mavlink.MAV_CMD_NAV_LAND)
    vehicle.run_until_disarmed()
    assert vehicle.take_texts() == ["Landing at current position", "Landing detected", "Disarmed by landing"]
    vehicle.run(0.1)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_LAND", "AUTO_LOITER"]
    assert not vehicle.topics.position_setpoint_triplet.current.valid


@pytest.mark.parametrize(
    ("north", "up", "parameters", "return_up"),
    [
        (80.0, 10.0, {}, 30),
        (40.0, 45.0, {}, 45),
        (4.0, 8.0, {}, 8),
        (50.0, 10.0, {"RTL_RETURN_ALT": 20.0}, 20),
        (12.0, 10.0, {}, 30),
        (12.0, 10.0, {"RTL_MIN_DIST": 20.0}, 20),
        (18.0, 10.0, {"RTL_MIN_DIST": 20.0, "RTL_CONE_ANG": 40}, 22),
        (8.0, 10.0, {}, 16),
        (8.0, 10.0, {"RTL_CONE_ANG": 0}, 30),
        (50.0, 5.0, {"RTL_RETURN_ALT": 4.0}, 4),
        (50.0, 5.0, {"RTL_RETURN_ALT": 4.0, "RTL_CONE_ANG": 0}, 5),
    ],
)
def test_return_height(north: float, up: float, parameters: dict[str, float], return_up: int) -> None:
    vehicle = flying(up, **parameters)
    vehicle.reposition(north, 0.0, up)
    vehicle.run(30.0)
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run_until_disarmed()
    texts = vehicle.take_texts()
    assert texts[0] == "Returning to launch"
    assert texts[1].endswith(f"({return_up} m above destination)")
    assert texts[2:] == ["RTL: land at destination", "Landing detected", "Disarmed by landing"]
    assert place(vehicle)[:2] == (0.0, 0.0)


def test_return_with_a_delay_waits_at_the_descend_height() -> None:
    vehicle = flying(RTL_LAND_DELAY=5.0, RTL_DESCEND_ALT=8.0)
    vehicle.reposition(50.0, 0.0, 10.0)
    vehicle.run(15.0)
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    lowest_before_landing = 99.0
    while "RTL: land at destination\t" not in vehicle.said:
        vehicle.step()
        lowest_before_landing = min(lowest_before_landing, vehicle.up)
    home_up_m = vehicle.topics.home_position.alt - HOME_ALT
    assert lowest_before_landing == pytest.approx(home_up_m + 8.0, abs=0.1)


def test_a_return_climbs_as_it_stands() -> None:
    """RtlDirect::set_rtl_item: LOITER_TO_ALT, with the heading of that moment."""
    vehicle = flying(RTL_RETURN_ALT=30.0, NAV_ACC_RAD=2.0)
    vehicle.reposition(50.0, 0.0, 10.0)
    vehicle.run(15.0)
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run(0.2)
    triplet = vehicle.topics.position_setpoint_triplet
    assert (triplet.current.type, triplet.current.yaw) == (SetpointType.LOITER, 0.0)
    assert triplet.current.alt == pytest.approx(vehicle.topics.home_position.alt + 30.0)
    assert not triplet.previous.valid
    vehicle.north = 60.0  # blown away, but still on a fixed wing's circle
    while vehicle.topics.position_setpoint_triplet.current.type == SetpointType.LOITER:
        vehicle.north = 60.0
        vehicle.step()
    assert vehicle.up > 29.0


def test_how_long_a_return_would_take() -> None:
    """20 m up at 3 m/s, 60 m along at 5 m/s (already on its way), 30 m down at 1.5 m/s; safe: times 1.1, plus 100 s."""
    vehicle = flying(10.0, RTL_RETURN_ALT=30.0, RTL_DESCEND_ALT=10.0, MPC_XY_CRUISE=5.0)
    vehicle.north = 60.0
    vehicle.run(2.2)  # it is told every 2 s
    estimate = vehicle.topics.rtl_time_estimate
    assert estimate.valid
    assert estimate.time_estimate == pytest.approx(20.0 / 3.0 + 60.0 / 5.0 + 30.0 / 1.5, abs=1.2)
    assert estimate.safe_time_estimate == pytest.approx(1.1 * estimate.time_estimate + 100.0)


def test_a_vehicle_on_the_ground_has_no_return() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    assert vehicle.topics.rtl_time_estimate.timestamp > 0
    assert (vehicle.topics.rtl_time_estimate.valid, vehicle.topics.rtl_time_estimate.safe_time_estimate) == (False, 0.0)


def test_a_rover_has_a_return_wherever_it_stands() -> None:
    """It takes no time (only the way down would count), and RTL_TIME_MARGIN to be safe; none once it has ended."""
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN, COM_DISARM_LAND=-1.0)
    rover.run(3.0)
    estimate = rover.topics.rtl_time_estimate
    assert (estimate.valid, estimate.time_estimate, estimate.safe_time_estimate) == (True, 0.0, 100.0)
    rover.arm()
    rover.run(1.0)
    assert rover.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == 0
    rover.run(3.0)
    assert not rover.topics.rtl_time_estimate.valid


@pytest.mark.parametrize(
    ("rally_north", "north", "parameters", "end_north"),
    [
        (60.0, 50.0, {}, 60.0),
        (60.0, 31.0, {}, 0.0),  # no nearer by 2 m
        (60.0, 5.0, {"RTL_TYPE": 1}, 60.0),
        (60.0, 50.0, {"RTL_TYPE": 2}, 0.0),
        (8.0, 20.0, {}, 0.0),  # at home
    ],
)
def test_return_goes_to_a_rally_point(
    rally_north: float, north: float, parameters: dict[str, float], end_north: float
) -> None:
    vehicle = flying(**parameters)
    lat, lon = PLACE.reproject(rally_north, 0.0)
    rally = MissionItem(
        0, 3, mavlink.MAV_CMD_NAV_RALLY_POINT, 1, 0.0, 0.0, 0.0, NAN, round(lat * 1e7), round(lon * 1e7), 0.0
    )
    vehicle.dataman.store(RALLY, Plan((rally,)), 0)
    vehicle.reposition(north, 0.0, 10.0)
    vehicle.run(15.0)
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run_until_disarmed()
    assert place(vehicle)[0] == end_north


def test_a_return_on_the_ground_goes_nowhere() -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.take_texts()
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run(3.0)
    assert vehicle.up == 0.0
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.IDLE
    assert "RTL: land at destination" not in vehicle.take_texts()


def test_a_return_that_does_not_land_says_so() -> None:
    vehicle = flying(RTL_LAND_DELAY=-1.0)
    vehicle.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    vehicle.run(40.0)
    assert vehicle.take_texts()[-1] == "RTL: completed, loitering"
    assert vehicle.armed


def test_a_fence_may_look_at_the_receivers_own_position() -> None:
    """GF_SOURCE 1."""
    vehicle = flying(GF_ACTION=1, GF_MAX_HOR_DIST=25.0, GF_SOURCE=1)
    vehicle.gps_error_north = 30.0
    vehicle.run(0.5)
    assert vehicle.topics.geofence_result.breached


def test_a_rover_returns_straight_home() -> None:
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN, RTL_RETURN_ALT=60.0)
    rover.run(3.0)
    rover.arm()
    rover.run(1.0)
    rover.reposition(25.0, 0.0, 0.0)
    rover.run(8.0)
    assert place(rover)[0] == 25.0
    rover.take_texts()
    rover.result(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    rover.run_until_disarmed()
    assert rover.take_texts() == [
        "Returning to launch",
        "RTL: land at destination",
        "RTL: start return at 550 m (61 m above destination)",  # 549.4 - 489.4 of float32
        "Landing detected",
        "Disarmed by landing",
    ]
    assert rover.mode is NavState.AUTO_LOITER


def test_a_rover_that_takes_off_holds_at_once() -> None:
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN)
    rover.run(3.0)
    rover.arm()
    rover.run(1.0)
    rover.result(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, NAN)
    rover.run(0.3)
    assert rover.modes == ["AUTO_LOITER", "AUTO_TAKEOFF", "AUTO_LOITER"]


class LowCeiling(FakeVehicle):
    """Over flat ground, and its estimate rests on sensors that measure no more than `ceiling_m`."""

    ceiling_m = math.inf

    def _sense(self) -> None:
        super()._sense()
        local, position = self.topics.vehicle_local_position, self.topics.vehicle_global_position
        self.topics.vehicle_local_position = local._replace(hagl_max_z=self.ceiling_m, hagl_max_xy=math.inf)
        self.topics.vehicle_global_position = position._replace(terrain_alt=HOME_ALT, terrain_alt_valid=True)


def below_ceiling(**parameters: float) -> LowCeiling:
    """Holds 10 m up, and may not go above 20 m."""
    vehicle = LowCeiling(**parameters)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.take_texts()
    vehicle.ceiling_m = 20.0
    return vehicle


@pytest.mark.parametrize(("up_m", "texts"), [(19.0, []), (30.0, ["Target altitude higher than max HAGL"])])
def test_it_goes_no_higher_than_its_sensors_measure(up_m: float, texts: list[str]) -> None:
    """MissionBlock::updateMaxHaglFailsafe; the failsafe holds, in HOLD too."""
    vehicle = below_ceiling()
    assert vehicle.reposition(0.0, 0.0, up_m) == 0
    vehicle.run(1.0)
    assert [text for text in vehicle.take_texts() if text.startswith("Target")] == texts
    assert vehicle.topics.navigator_status[1:] == (NavState.AUTO_LOITER, len(texts))
    assert vehicle.topics.vehicle_status.failsafe is (up_m > 20.0)
    vehicle.run(10.0)
    assert vehicle.up == pytest.approx(19.0 if up_m < 20.0 else 10.0, abs=0.3)


def test_a_return_that_would_go_higher_than_its_sensors_measure_lands() -> None:
    vehicle = below_ceiling(RTL_RETURN_ALT=30.0)
    vehicle.reposition(50.0, 0.0, 10.0)
    vehicle.run(12.0)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(6.0)
    assert vehicle.modes[-3:] == ["AUTO_RTL", "AUTO_LOITER", "AUTO_LAND"]
    vehicle.run_until_disarmed()
    assert place(vehicle)[0] == pytest.approx(50.0, abs=0.5)


def test_while_disarmed_an_automatic_mode_has_no_setpoint_again_and_again() -> None:
    """Navigator::run: every 50 ms; of what the pilot flies, once."""
    vehicle = FakeVehicle(COM_RC_IN_MODE=1)
    vehicle.run(3.0)

    def published() -> int:
        seen = set()
        for _ in range(25):
            vehicle.step()
            seen.add(vehicle.topics.position_setpoint_triplet.timestamp)
        assert not vehicle.topics.position_setpoint_triplet.current.valid
        return len(seen)

    assert published() >= 19
    vehicle.commander._intention.change(NavState.POSCTL, armed=False)
    vehicle.run(0.5)
    assert vehicle.mode is NavState.POSCTL
    assert published() == 1
