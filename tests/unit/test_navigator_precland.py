"""Precision landing: onto the target where one is seen, and what happens where none is."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.navigator.precland import Slewed, slewed
from sitl_emu.autopilot.topics import LandingTargetPose, VehicleAttitude, VehicleLocalPosition
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion

from .mavlink_peer import Peer
from .navigation_fake import HOME_ALT, PLACE, FakeVehicle, item

TAKEOFF, WAYPOINT, LAND = 22, 16, 21


class Rig(FakeVehicle):
    """A vehicle above a target that it sees from `seen_from_m` away."""

    target: tuple[float, float] | None = (4.0, -3.0)
    seen_from_m = 15.0
    target_down_m = 0.0

    def hide(self) -> None:
        self.target = None
        self.topics.landing_target_pose = LandingTargetPose()

    def step(self) -> None:
        if self.target is not None:
            away_m = math.hypot(self.target[0] - self.north, self.target[1] - self.east)
            if away_m < self.seen_from_m:
                self.topics.landing_target_pose = LandingTargetPose(self.now_us, *self.target, self.target_down_m)
        super().step()


def flying(**parameters: float) -> Rig:
    rig = Rig(**parameters)
    rig.run(3.0)
    rig.take_off(20.0)
    return rig


def test_it_lands_on_the_target() -> None:
    rig = flying()
    assert rig.set_mode(4, 9) == 0
    rig.run(0.1)
    assert rig.mode is NavState.AUTO_PRECLAND
    rig.run_until_disarmed()
    assert (rig.north, rig.east) == pytest.approx((4.0, -3.0), abs=0.3)


def test_it_is_above_the_target_before_it_descends() -> None:
    rig = flying()
    rig.set_mode(4, 9)
    while math.hypot(rig.north - 4.0, rig.east + 3.0) > 0.3:
        assert rig.up > 18.0
        rig.step()


def test_the_setpoint_moves_to_the_target_no_faster_than_the_vehicle_may() -> None:
    """PrecLand::slewrate: MPC_XY_CRUISE, MPC_ACC_HOR, and so that it can stop at the target."""
    rig = flying(MPC_XY_CRUISE=2.0, MPC_ACC_HOR=1.0)
    rig.target = (14.0, 0.0)
    rig.set_mode(4, 9)
    places: list[tuple[int, float]] = []
    while rig.setpoints[-1] is not SetpointType.LAND:
        rig.step()
        current = rig.topics.position_setpoint_triplet.current
        if current.type == SetpointType.POSITION and (not places or current.timestamp > places[-1][0]):
            places.append((current.timestamp, PLACE.project(current.lat, current.lon)[0]))
    # over a second: each run of the navigator moves it by 50 ms' worth, and here they come every 40 or 80 ms
    speeds = [
        (there - here) * 1e6 / (then - now)
        for number, (now, here) in enumerate(places)
        for then, there in [later for later in places[number:] if later[0] - now >= 1_000_000][:1]
    ]
    assert max(speeds) == pytest.approx(2.0, abs=0.2)
    assert speeds[0] < 1.0
    assert max(north for _, north in places) < 14.05
    assert places[-1][1] == pytest.approx(14.0, abs=0.2)


def test_a_setpoint_moves_by_its_last_two_places() -> None:
    """Worked out by hand: 1 m/s before, 3 m/s^2 for 50 ms; faster than 5 m/s, and nearer than it can stop."""
    at_1_m_s = Slewed(0, (0.0, 0.0), (-0.05, 0.0))
    assert slewed(at_1_m_s, (20.0, 0.0), 0.05, 5.0, 3.0) == pytest.approx((1.15 * 0.05, 0.0))
    at_5_m_s = Slewed(0, (0.0, 0.0), (-0.25, 0.0))
    assert slewed(at_5_m_s, (0.0, 200.0), 0.05, 5.0, 1000.0) == pytest.approx((0.0, 0.25))
    assert slewed(at_5_m_s, (3.0, 0.0), 0.05, 5.0, 3.0) == pytest.approx((3.0 * 0.05, 0.0))


def test_it_stays_above_the_target_for_two_seconds() -> None:
    rig = flying(PLD_HACC_RAD=0.5)
    rig.set_mode(4, 9)
    while max(abs(rig.north - 4.0), abs(rig.east + 3.0)) >= 0.5:
        rig.step()
    rig.run(1.8)
    before = rig.setpoints[-1]
    rig.run(0.5)
    assert (before, rig.setpoints[-1]) == (SetpointType.POSITION, SetpointType.LAND)


def test_a_target_lost_on_the_way_is_flown_to_and_looked_for_from_there() -> None:
    rig = flying(PLD_BTOUT=1.0, PLD_SRCH_TOUT=5.0, PLD_SRCH_ALT=25.0)
    rig.target = (14.0, 0.0)
    rig.set_mode(4, 9)
    rig.run(0.3)
    rig.target = None
    rig.run(7.0)
    assert rig.north == pytest.approx(14.0, abs=0.3)
    assert rig.up == pytest.approx(20.0, abs=0.5)
    rig.run_until_disarmed()
    assert rig.north == pytest.approx(14.0, abs=0.3)


def test_without_time_for_a_search_it_lands_at_once() -> None:
    rig = flying(PLD_SRCH_TOUT=0.0)
    rig.hide()
    rig.set_mode(4, 9)
    rig.run(0.3)
    assert rig.setpoints[-1] is SetpointType.LAND


def test_a_search_stops_climbing_where_it_sees_the_target() -> None:
    rig = flying(PLD_SRCH_TOUT=60.0, PLD_SRCH_ALT=60.0)
    rig.hide()
    rig.set_mode(4, 9)
    rig.run(8.0)
    seen_at_m, rig.target = rig.up, (4.0, -3.0)
    rig.run(0.9)
    assert rig.topics.position_setpoint_triplet.current.alt == pytest.approx(HOME_ALT + seen_at_m + 1.0, abs=0.2)
    assert (rig.north, rig.east) == (0.0, 0.0)
    rig.run(2.0)
    assert rig.north > 1.0


@pytest.mark.parametrize(("target_down_m", "lands"), [(-3.0, True), (9.0, False)])
def test_near_the_target_it_lands_though_it_is_lost(target_down_m: float, lands: bool) -> None:
    """PLD_FAPPR_ALT counts from the target's own height."""
    rig = flying(PLD_FAPPR_ALT=8.0, PLD_BTOUT=1.0)
    rig.target, rig.target_down_m = (0.0, 0.0), target_down_m
    rig.set_mode(4, 9)
    while rig.up > 10.0:
        rig.step()
    rig.target = None
    rig.run(2.0)
    assert (rig.setpoints[-1] is SetpointType.LAND) is lands


def test_a_required_target_is_searched_for_and_then_it_lands_all_the_same() -> None:
    rig = flying(PLD_SRCH_ALT=25.0, PLD_SRCH_TOUT=5.0)
    rig.hide()
    rig.set_mode(4, 9)
    rig.run(6.0)
    assert rig.up > 20.5
    rig.run_until_disarmed()
    assert math.hypot(rig.north, rig.east) < 1.0


def test_a_target_that_comes_into_sight_ends_the_search() -> None:
    rig = flying(PLD_SRCH_TOUT=60.0)
    rig.hide()
    rig.set_mode(4, 9)
    rig.run(8.0)
    rig.target = (4.0, -3.0)
    rig.run_until_disarmed()
    assert (rig.north, rig.east) == pytest.approx((4.0, -3.0), abs=0.3)


@pytest.mark.parametrize(("mode", "place"), [(0, (0.0, 0.0)), (1, (4.0, -3.0)), (2, (4.0, -3.0))])
def test_return_lands_as_rtl_pld_md_says(mode: int, place: tuple[float, float]) -> None:
    rig = flying(RTL_PLD_MD=mode)
    rig.reposition(40.0, 0.0, 20.0)
    rig.run(20.0)
    rig.set_mode(4, 5)
    rig.run_until_disarmed()
    assert (rig.north, rig.east) == pytest.approx(place, abs=0.5)


def test_an_opportunistic_landing_without_target_does_not_search() -> None:
    rig = flying(RTL_PLD_MD=1)
    rig.hide()
    rig.set_mode(4, 5)
    highest = 0.0
    for _ in range(5000):
        rig.step()
        highest = max(highest, rig.up)
        if not rig.armed:
            break
    assert not rig.armed and highest < 31.5


def test_an_opportunistic_landing_does_not_wait_for_the_target() -> None:
    rig = flying(RTL_PLD_MD=1)
    rig.hide()
    rig.set_mode(4, 5)
    while "RTL: land at destination\t" not in rig.said:
        rig.step()
    rig.run(0.2)
    rig.target = (4.0, -3.0)
    rig.run_until_disarmed()
    assert (rig.north, rig.east) == pytest.approx((0.0, 0.0), abs=0.5)


@pytest.mark.parametrize(("precision", "place"), [(0, (60.0, 0.0)), (2, (62.0, 1.0))])
def test_a_missions_landing(precision: int, place: tuple[float, float]) -> None:
    rig = Rig()
    rig.target = (62.0, 1.0)
    rig.run(3.0)
    rig.upload(item(TAKEOFF, 0, 0, 20), item(WAYPOINT, 60, 0, 20), item(LAND, 60, 0, 0, 0, precision))
    rig.run(0.1)
    rig.set_mode(4, 4)
    rig.arm()
    rig.run_until_disarmed()
    assert (rig.north, rig.east) == pytest.approx(place, abs=0.5)


@pytest.mark.parametrize("sub_mode", [5, 9])
def test_a_rover_lands_precisely_too_where_it_is(sub_mode: int) -> None:
    """PX4's PrecLand asks for no kind of vehicle; no target is told of here."""
    rover = FakeVehicle(VehicleKind.ROVER_ACKERMANN, RTL_PLD_MD=1)
    rover.run(3.0)
    rover.arm()
    rover.run(1.0)
    rover.reposition(25.0, 0.0, 0.0)
    rover.run(3.0)
    assert rover.set_mode(4, sub_mode) == 0
    before = rover.north
    rover.run(4.0)
    assert rover.north == pytest.approx(before, abs=1.0)
    kinds = {5: SetpointType.LAND, 9: SetpointType.POSITION}
    assert rover.topics.position_setpoint_triplet.current.type == kinds[sub_mode]


def test_a_missions_precision_landing_ends_as_a_landing() -> None:
    """MissionBase::advance_mission waits for the work to end, so that the item is set once more, landed."""
    rig = FakeVehicle(NAV_ACC_RAD=2.0)
    rig.run(3.0)
    rig.upload(item(TAKEOFF, 0, 0, 6), item(LAND, 0, 0, 0, 0.0, 1.0))
    rig.run(0.1)
    assert rig.set_mode(4, 4) == 0
    assert rig.arm() == 0
    while rig.topics.mission_result.seq_reached != 1:
        rig.step()
    assert rig.take_texts()[-1] == "Landing detected"
    assert rig.topics.navigator_mission_item.timestamp == rig.now_us
    rig.run(0.2)
    assert "Mission finished, landed" in rig.take_texts()


# --- messages -----------------------------------------------------------------------------------------------


def landing_target(**changes: Any) -> Any:
    fields = {"angle_x": 0.0, "angle_y": 0.0, "x": 0.0, "y": 0.0, "z": 0.0, "position_valid": 0, "frame": 1} | changes
    return mavlink.MAVLink_landing_target_message(
        0, 0, fields["frame"], fields["angle_x"], fields["angle_y"], 0.0, 0.0, 0.0, fields["x"], fields["y"],
        fields["z"], (1.0, 0.0, 0.0, 0.0), 0, fields["position_valid"],
    )  # fmt: skip


def test_a_position_is_taken_in_local_ned_alone() -> None:
    peer = Peer()
    peer.send(landing_target(x=4.0, y=-3.0, z=0.5, position_valid=1))
    assert peer.topics.landing_target_pose[1:4] == (4.0, -3.0, 0.5)
    before = peer.topics.landing_target_pose
    peer.send(landing_target(x=9.0, position_valid=1, frame=12))
    assert peer.topics.landing_target_pose is before
    assert [text.text for text in peer.texts.recent] == ["Landing target: coordinate frame 12 unsupported\t"]


def target_relative(frame: int, q: tuple[float, ...] = (0.0,) * 4, kind: int = 2) -> Any:
    return mavlink.MAVLink_target_relative_message(0, 4.0, -3.0, 0.5, (0.1,) * 3, 0.1, (0.0,) * 4, q, 0, frame, kind)


@pytest.mark.parametrize(
    ("frame", "q", "place"),
    [
        (0, (), (4.0, -3.0, 0.5)),
        (1, (), (13.0, 24.0, -7.5)),
        (1, (1.0, 0.0, 0.0, 0.0), (14.0, 17.0, -7.5)),
        (2, (), (14.0, 17.0, -7.5)),
        (2, (0.0, 0.0, 0.0, 1.0), (14.0, 17.0, -7.5)),
        (3, (0.0, 0.0, 0.0, 2.0), (6.0, 23.0, -7.5)),
    ],
)
def test_a_target_is_seen_from_the_vehicle(frame: int, q: tuple[float, ...], place: tuple[float, ...]) -> None:
    """In the local frame; along the axes of a vehicle that heads east, or of what it tells; of NED; of the sensor."""
    peer = Peer()
    peer.parameters.set("VTE_EN", 0)
    peer.topics.vehicle_local_position = VehicleLocalPosition(1, xy_valid=True, z_valid=True, x=10.0, y=20.0, z=-8.0)
    peer.topics.vehicle_attitude = VehicleAttitude(1, quaternion(0.0, 0.0, math.pi / 2.0))
    peer.send(target_relative(frame, q or (0.0,) * 4))
    assert peer.topics.landing_target_pose[1:4] == pytest.approx(place, abs=1e-4)


@pytest.mark.parametrize(
    ("frame", "q", "seen", "attitude"),
    [
        (0, (), (-6.0, -23.0, 8.5), (1.0, 0.0, 0.0, 0.0)),
        (1, (), (4.0, -3.0, 0.5), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))),
        (2, (), (4.0, -3.0, 0.5), (1.0, 0.0, 0.0, 0.0)),
        (3, (0.0, 0.0, 0.0, 2.0), (4.0, -3.0, 0.5), (0.0, 0.0, 0.0, 1.0)),
    ],
)
def test_the_vision_target_estimator_is_told_what_is_seen(
    frame: int, q: tuple[float, ...], seen: tuple[float, ...], attitude: tuple[float, ...]
) -> None:
    """VTE_EN is 1 by default: from the vehicle, in the frame that the attitude turns into NED, with variances."""
    peer = Peer()
    peer.now_us = 7000
    peer.topics.vehicle_local_position = VehicleLocalPosition(1, xy_valid=True, z_valid=True, x=10.0, y=20.0, z=-8.0)
    peer.topics.vehicle_attitude = VehicleAttitude(1, quaternion(0.0, 0.0, math.pi / 2.0))
    peer.send(target_relative(frame, q or (0.0,) * 4))
    report = peer.topics.fiducial_marker_pos_report
    assert report.timestamp == 7000
    assert report.rel_pos == pytest.approx(seen) and report.q == pytest.approx(attitude)
    assert report.cov_rel_pos == pytest.approx((0.01, 0.01, 0.01))
    assert peer.topics.landing_target_pose.timestamp == 0


@pytest.mark.parametrize(
    ("frame", "kind", "text"),
    [
        (4, 2, "coordinate frame 4 unsupported."),
        (0, 3, "type 3 unsupported."),
        (3, 2, "coordinate frame 3 unsupported when the q_sensor is not filled."),
    ],
)
def test_what_px4_refuses_of_targets(frame: int, kind: int, text: str) -> None:
    peer = Peer()
    peer.send(target_relative(frame, kind=kind))
    assert peer.topics.landing_target_pose.timestamp == peer.topics.fiducial_marker_pos_report.timestamp == 0
    assert [said.text for said in peer.texts.recent] == [f"target relative: {text}\t"]


@pytest.mark.parametrize(("frame", "estimator"), [(1, 0), (2, 0), (0, 1)])
def test_a_target_is_not_kept_while_nobody_knows_where_the_vehicle_is(frame: int, estimator: int) -> None:
    peer = Peer()
    peer.now_us = 1000
    peer.parameters.set("VTE_EN", estimator)
    peer.send(target_relative(frame))
    assert peer.topics.landing_target_pose.timestamp == peer.topics.fiducial_marker_pos_report.timestamp == 0
    assert list(peer.texts.recent) == []


def test_nothing_comes_of_angles() -> None:
    """SITL's PX4 has no landing_target_estimator; what is seen is above the ground, so that they would say where."""
    peer = Peer()
    peer.topics.vehicle_local_position = VehicleLocalPosition(1, True, True, dist_bottom=8.0, dist_bottom_valid=True)
    peer.send(landing_target(angle_x=math.atan(0.5)))
    assert peer.topics.landing_target_pose.timestamp == 0
    assert list(peer.texts.recent) == []


@pytest.mark.parametrize("precisely", [True, False])
def test_who_leaves_it_for_a_place_flies_there_without_the_heading_that_was_asked_for(precisely: bool) -> None:
    """As a real PX4 v1.18 (SIH) did twice of twice: its mode is ended after the next one has begun."""
    rig = flying()
    rig.hide()
    if precisely:
        rig.set_mode(4, 9)
        rig.run(2.0)
    assert rig.reposition(50.0, 0.0, 20.0, yaw=1.5) == 0
    rig.run(0.2)
    current = rig.topics.position_setpoint_triplet.current
    assert rig.mode is NavState.AUTO_LOITER
    assert math.isnan(current.yaw) if precisely else current.yaw == pytest.approx(1.5)
    assert rig.reposition(50.0, 0.0, 20.0, yaw=1.5) == 0
    rig.run(0.2)
    assert rig.topics.position_setpoint_triplet.current.yaw == pytest.approx(1.5), "in Hold it is as asked for"
