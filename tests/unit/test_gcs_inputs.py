"""What a companion tells an autopilot: poses, distances, targets, sticks, clocks; heard by our own services."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs import (
    debug_values,
    landing_target,
    obstacle_distance,
    odometry,
    onboard_computer_status,
    optical_flow,
)
from sitl_emu.gcs.adsb_vehicle import adsb_vehicle
from sitl_emu.gcs.battery_status import battery_status
from sitl_emu.gcs.follow_target import FollowTarget, Target
from sitl_emu.gcs.global_position_sensor import global_position_sensor
from sitl_emu.gcs.gps_global_origin import SetGpsGlobalOrigin
from sitl_emu.gcs.manual_control import ManualControl, Sticks
from sitl_emu.gcs.ping import Ping
from sitl_emu.gcs.rc_override import RcOverride
from sitl_emu.gcs.system_time import system_time
from sitl_emu.gcs.timesync import Timesync
from sitl_emu.gcs.velocity_limits import velocity_limits
from tests.unit.companion_px4 import on_the_wire

from .gcs_link import converse
from .mavlink_peer import Peer, names

US = 1_000_000


def test_odometry_brings_pose_velocity_and_variances() -> None:
    peer = Peer()
    half = math.sqrt(0.5)
    peer.send(
        odometry.odometry(
            1, (1.0, 2.0, -3.0), (half, 0.0, 0.0, half), (0.5, 0.0, 0.0), position_variance=(0.1, 0.2, 0.3)
        )
    )
    heard = peer.topics.vehicle_visual_odometry
    assert heard.position == (1.0, 2.0, -3.0)
    assert heard.q == pytest.approx((half, 0.0, 0.0, half))
    assert heard.velocity == (0.5, 0.0, 0.0)
    assert heard.position_variance == pytest.approx((0.1, 0.2, 0.3))
    assert math.isnan(heard.velocity_variance[0]), "not known"


def test_a_pose_of_vision_has_angles() -> None:
    peer = Peer()
    peer.send(odometry.vision_position(1, (4.0, 5.0, -6.0), 0.0, 0.0, math.pi / 2.0))
    heard = peer.topics.vehicle_visual_odometry
    assert heard.position == (4.0, 5.0, -6.0)
    assert heard.q == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)), abs=1e-6)


def test_obstacles_around() -> None:
    peer = Peer()
    peer.send(obstacle_distance.obstacles(1, (1.5, math.inf, None), 5.0, first_deg=-5.0))
    heard = peer.topics.obstacle_distance
    assert heard.distances[:4] == (150, 4001, 65535, 65535)
    assert (heard.increment, heard.angle_offset) == (5.0, -5.0)
    with pytest.raises(ValueError, match="73 distances"):
        obstacle_distance.obstacles(1, (1.0,) * 73, 5.0)


def test_a_distance_below() -> None:
    peer = Peer()
    peer.send(obstacle_distance.distance(1, 3.25))
    assert peer.topics.distance_sensors_outside[0].current_distance == pytest.approx(3.25)
    peer.send(obstacle_distance.distance(1, math.inf))
    (sensor,) = peer.topics.distance_sensors_outside
    assert math.isnan(sensor.current_distance)


def test_a_landing_target() -> None:
    peer = Peer()
    peer.send(landing_target.at_place(1, 2.0, -1.0, 0.5))
    heard = peer.topics.landing_target_pose
    assert (heard.x_abs, heard.y_abs, heard.z_abs) == (2.0, -1.0, 0.5)
    seen = on_the_wire(landing_target.at_angles(1, 0.1, -0.2), 1, 191)
    assert (seen.position_valid, seen.angle_x, seen.angle_y) == (0, pytest.approx(0.1), pytest.approx(-0.2))


def test_how_hot_a_companion_computer_is() -> None:
    peer = Peer()
    peer.now_us = 7_000_000
    peer.send(onboard_computer_status.board_temperature(1, 2, 85))
    assert peer.topics.onboard_computer_status[:2] == (7_000_000, 85)


def test_flow_of_the_ground() -> None:
    peer = Peer()
    peer.send(optical_flow.optical_flow(1, 100_000, (0.02, -0.01), (0.0, 0.0, 0.0), quality=200))
    heard = peer.topics.vehicle_optical_flow
    assert heard[1:3] == pytest.approx((0.2, -0.1))


def test_sticks_are_streamed_until_they_are_let_go() -> None:
    peer, sticks = Peer(), ManualControl(1, Sticks(pitch=0.5, roll=-0.25, throttle=0.75, yaw=2.0))
    converse(peer, sticks, 0.1)
    heard = peer.topics.manual_control_mavlink
    assert (heard.pitch, heard.roll, heard.throttle, heard.yaw) == (0.5, -0.25, 0.5, 1.0)
    assert sum(len(sticks.on_time(US + t)) for t in range(0, US, 1000)) == 25
    sticks.stop()
    assert sticks.on_time(10 * US) == []


def test_radio_channels_are_streamed_and_let_go() -> None:
    peer, channels = Peer(), RcOverride(1, {1: 1500, 3: 1100, 9: 1900})
    converse(peer, channels, 0.1)
    assert peer.topics.input_rc.values == (1500, 65535, 1100, *(65535,) * 5, 1900)
    channels.stop()
    (last,) = channels.on_time(US)
    assert (last.chan1_raw, last.chan2_raw, last.chan9_raw) == (0, 65535, 65534)
    assert channels.done
    with pytest.raises(ValueError, match="radio channel 19"):
        RcOverride(1, {19: 1500})


def test_being_followed_streams_a_place_and_asks_for_the_mode() -> None:
    asked: list[Any] = []

    def decide(now_us: int, command: Any) -> CommandResult:
        asked.append(command)
        return CommandResult(0)

    peer = Peer(decide)
    follow = FollowTarget(1, Target(47.4, 8.5, 500.0, v_north=1.0))
    converse(peer, follow, 1.0)
    heard = peer.topics.follow_target
    assert (heard.lat, heard.lon, heard.alt) == pytest.approx((47.4, 8.5, 500.0))
    assert [(command.command, command.param2, command.param3) for command in asked] == [(176, 4.0, 8.0)]
    assert follow.command.done
    follow.stop()
    assert follow.on_time(peer.now_us + US) == []


def test_the_clock_of_a_vehicle_is_found_over_a_slow_way_back() -> None:
    ahead_us, sync = 7 * US, Timesync(1)
    for sent_us, back_us in ((0, 30_000), (200_000, 4_000), (400_000, 90_000)):
        (question,) = sync.on_time(sent_us)
        answer = mavlink.MAVLink_timesync_message((sent_us + 1_000 + ahead_us) * 1000, question.ts1)
        assert sync.on_message(sent_us + 1_000 + back_us, on_the_wire(answer, 1, 1)) == []
    assert sync.round_trip_us == 5_000
    assert sync.offset_us == ahead_us - 1_500


def test_clocks_are_compared_with_our_autopilot_both_ways() -> None:
    peer, sync = Peer(), Timesync(1)
    heard = converse(peer, sync, 2.0)
    assert abs(sync.offset_us or 0) <= 20_000
    question = next(message for message in heard if message.get_type() == "TIMESYNC" and message.tc1 == 0)
    (answer,) = sync.on_message(5 * US, question)
    assert (answer.tc1, answer.ts1) == (5 * US * 1000, question.ts1)


def test_pings_come_back_and_are_given_back() -> None:
    peer, ping = Peer(), Ping(1)
    converse(peer, ping, 3.5)
    assert (ping.sent, ping.answered) == (4, 4)
    assert ping.round_trip_us == 0
    theirs = on_the_wire(mavlink.MAVLink_ping_message(123, 9, 0, 0), 1, 1)
    (answer,) = ping.on_message(0, theirs)
    assert (answer.time_usec, answer.seq, answer.target_system, answer.target_component) == (123, 9, 1, 1)


@pytest.mark.parametrize("lost", [frozenset[str](), frozenset({"GPS_GLOBAL_ORIGIN"})])
def test_an_origin_is_set_until_the_vehicle_says_that_it_is(lost: frozenset[str]) -> None:
    origin = SetGpsGlobalOrigin(1, 47.397742, 8.545594, 489.4)
    peer = Peer()
    peer.fly()
    converse(peer, origin, 5.0, lambda: origin.done, lost=lost)
    assert origin.accepted


def test_an_origin_that_is_not_taken_is_told() -> None:
    origin = SetGpsGlobalOrigin(1, 10.0, 20.0, 0.0)
    peer = Peer()
    peer.fly()
    converse(peer, origin, 10.0, lambda: origin.done)
    assert (origin.done, origin.accepted) == (True, False)


def test_an_aircraft_nearby() -> None:
    peer = Peer()
    peer.send(adsb_vehicle(0xABC123, "LX-ABC", 47.4, 8.5, 700.0, v_north=-30.0, v_east=40.0))
    (heard,) = peer.topics.transponder_reports
    assert (heard.icao_address, heard.callsign) == (0xABC123, b"LX-ABC")
    assert (heard.lat, heard.lon, heard.altitude) == pytest.approx((47.4, 8.5, 700.0))
    assert heard.hor_velocity == pytest.approx(50.0)


def test_limits_of_speed_and_a_place_from_elsewhere() -> None:
    peer = Peer()
    peer.send(velocity_limits(1, 2.0, yaw_rate_deg_s=90.0))
    limits = peer.topics.velocity_limits
    assert limits.horizontal_velocity == 2.0
    assert limits.yaw_rate == pytest.approx(math.pi / 2.0)
    assert math.isnan(limits.vertical_velocity)
    peer.send(global_position_sensor(1, 7, 47.4, 8.5, 490.0, 2.0, 3.0))
    (place,) = peer.topics.aux_global_position
    assert (place.id, place.alt, place.eph, place.epv) == (7, 490.0, 2.0, 3.0)
    assert (place.lat, place.lon) == pytest.approx((47.4, 8.5))


def test_a_battery_that_tells_of_itself() -> None:
    peer = Peer(system=1, component=180)
    peer.fly()
    peer.send(battery_status((4.1, 4.0, 3.9), 0.1, 2.5))
    heard = peer.topics.battery_status
    assert heard.cells_v == pytest.approx((4.1, 4.0, 3.9))
    assert (heard.voltage_v, heard.current_a, heard.remaining, heard.warning) == pytest.approx((12.0, 2.5, 0.1, 1))


def test_numbers_to_look_at() -> None:
    peer = Peer()
    peer.send(debug_values.named_value(5_000, "temperature", 21.5))
    peer.send(debug_values.vector(5_000, "wind", 1.0, 2.0, 3.0))
    assert (peer.topics.debug_key_value.key, peer.topics.debug_key_value.value) == (b"temperatu", 21.5)
    assert (peer.topics.debug_vect.name, peer.topics.debug_vect.xyz) == (b"wind", (1.0, 2.0, 3.0))


def test_a_date_is_told() -> None:
    assert names(Peer().send(system_time(1_700_000_000_000_000, 5_000_000))) == []
    assert on_the_wire(system_time(1_700_000_000_000_000, 5_000_000), 1, 191).time_boot_ms == 5000
