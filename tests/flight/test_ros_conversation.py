"""What a ROS 2 node and a vehicle tell each other beside setpoints; and what a hostile node sends."""

import math
import random
import struct

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, PUBLICATIONS, SUBSCRIPTIONS, Sample

from .pilot import Pilot
from .ros_node import ARM, FREE, LAND, SET_MODE, TAKEOFF, Node, offboard


def test_a_mode_that_has_done_its_work_says_so() -> None:
    """As px4_ros2's executors await it: after take-off, while it goes over to HOLD, and after landing."""
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.until_armable()
    nan = math.nan
    node.command(TAKEOFF, 0.0, 0.0, 0.0, nan, nan, nan, nan)
    node.command(ARM, 1.0)
    for nav_state in (NavState.AUTO_TAKEOFF, NavState.AUTO_LOITER):
        pilot.until(lambda nav_state=nav_state: pilot.topics.vehicle_status.nav_state is nav_state, 30.0)  # type: ignore[misc]
    pilot.run(1.0)
    completed = {(told["nav_state"], told["result"]) for told in node.hear("mode_completed")}
    assert completed == {(NavState.AUTO_TAKEOFF, 0)}
    node.command(LAND, 0.0, 0.0, 0.0, nan, nan, nan, nan)
    pilot.until(lambda: not pilot.topics.vehicle_status.armed, 30.0)
    pilot.run(1.0)
    times_us = [told["timestamp"] for told in node.hear("mode_completed") if told["nav_state"] == NavState.AUTO_LAND]
    assert 2 <= len(times_us) <= 6, "twice a second until it is disarmed (COM_DISARM_LAND, 2 s)"
    pilot.run(1.0)
    assert not list(node.hear("mode_completed"))


def test_commands_for_others_are_not_heard() -> None:
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.until_armable()
    node.acks()
    node.command(ARM, 1.0, target_system=7)
    pilot.run(0.5)
    assert node.acks() == [] and not pilot.topics.vehicle_status.armed
    node.command(ARM, 1.0, target_system=0)
    pilot.run(0.5)
    assert node.acks() == [(ARM, 0)]
    node.command(31000, 1.0)
    pilot.run(0.1)
    assert node.acks() == [(31000, 3)]


def test_numbers_that_are_none_change_nothing() -> None:
    """A hovering vehicle hovers on, whatever bytes come, on any topic but those that command it rightly."""
    pilot = Pilot("iris")
    node, place, on = Node(pilot), [0.0, 0.0, -5.0], [True]
    offboard(pilot, node, place, on)
    pilot.until(lambda: -pilot.truth.down_m > 4.5, 30.0)
    inf, nan = math.inf, math.nan
    node.send("vehicle_attitude_setpoint", q_d=(nan,) * 4, thrust_body=(nan,) * 3)
    node.send("vehicle_rates_setpoint", roll=inf, pitch=nan, yaw=nan, thrust_body=(inf, nan, 0.0))
    node.send("vehicle_visual_odometry", pose_frame=9, position=(inf,) * 3, q=(nan,) * 4, velocity_frame=200)
    node.send("obstacle_distance", increment=nan, angle_offset=inf)
    node.send("distance_sensor", current_distance=nan, max_distance=inf, orientation=25)
    node.send("sensor_optical_flow", pixel_flow=(nan, inf), integration_timespan_us=2**32 - 1)
    node.send("manual_control_input", valid=True, data_source=2, roll=nan)
    node.command(SET_MODE, nan, inf)
    for topic in SUBSCRIPTIONS:
        for none in (nan, inf, -inf):
            floats = [each for each in cdr.places(topic.type) if each.code in "fd"]
            told = {each.path: none if each.length == 1 else (none,) * each.length for each in floats}
            node.send(topic.name, **told)
    pilot.run(0.2)
    for number, topic in enumerate(SUBSCRIPTIONS):
        node.client.on_sample(pilot.autopilot.now_us, Sample(number, b""))
        node.client.on_sample(pilot.autopilot.now_us, Sample(number, bytes(cdr.size(topic.type) - 1)))
    node.client.on_sample(pilot.autopilot.now_us, Sample(999, b"x" * 100))
    pilot.run(5.0)
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD
    assert -pilot.truth.down_m == pytest.approx(5.0, abs=0.6)


def test_random_bytes_end_no_vehicle() -> None:
    """Armed and flying: it may go anywhere, but it goes on."""
    pilot = Pilot("iris")
    node, place, on = Node(pilot), [0.0, 0.0, -5.0], [True]
    offboard(pilot, node, place, on)
    chance = random.Random(1)
    for _ in range(300):
        number = chance.randrange(len(SUBSCRIPTIONS))
        name = SUBSCRIPTIONS[number].type
        data = bytearray(chance.randbytes(cdr.size(name)))
        for each in cdr.places(name):
            if each.path in ("target_system", "target_component"):
                data[each.offset] = 1
            elif each.path == "command":
                struct.pack_into("<I", data, each.offset, chance.choice((16, 20, 21, 22, 92, 176, 178, 179, 192, 195)))
        node.client.on_sample(pilot.autopilot.now_us, Sample(number, bytes(data)))
        pilot.run(0.02)
    pilot.run(1.0)
    assert math.isfinite(pilot.truth.down_m)


def test_a_node_with_another_clock_is_heard_all_the_same() -> None:
    """0 is now, and nothing is later than now; what is old is old."""
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.run(2.0)
    for told_us, age_us in ((0, 0), (2**63, 0), (12, 0), (node.client.time_offset_us + 1_500_000, 500_000)):
        now_us = pilot.autopilot.now_us
        node.send("offboard_control_mode", timestamp=told_us, position=True)
        assert now_us - pilot.topics.offboard_setpoint.timestamp == pytest.approx(age_us, abs=20_000)


def test_a_mode_of_ones_own_is_refused() -> None:
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.run(1.0)
    node.send(
        "register_ext_component_request", request_id=77, name=b"my mode", px4_ros2_api_version=2, register_mode=True
    )
    (reply,) = node.hear("register_ext_component_reply")
    assert (reply["request_id"], reply["success"], reply["mode_id"]) == (77, False, -1)
    assert reply["name"].startswith(b"my mode\0") and reply["timestamp"] > 0
    node.send("setpoint_config", type=4, source_id=23)
    (reply,) = node.hear("setpoint_config_reply")
    assert (reply["type"], reply["source_id"], reply["result"]) == (4, 23, 1)


def test_formats_of_messages_are_told() -> None:
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.run(1.0)
    for name, success in ((b"/fmu/in/vehicle_command", True), (b"/fmu/in/nobody", False), (b"vehicle_command", False)):
        node.send("message_format_request", protocol_version=1, topic_name=name)
        (reply,) = node.hear("message_format_response")
        assert reply["success"] is success
        assert reply["message_hash"] == (MESSAGES["VehicleCommand"].hash if success else 0)
    for topic in (*PUBLICATIONS, *SUBSCRIPTIONS):  # px4_ros2 asks for many of them before it registers a mode
        node.send("message_format_request", protocol_version=1, topic_name=f"/px4_1/fmu/out/{topic.name}".encode())
        (reply,) = node.hear("message_format_response")
        assert (reply["success"], reply["message_hash"]) == (True, MESSAGES[topic.type].hash)
    node.send("message_format_request", protocol_version=2, topic_name=b"/fmu/in/vehicle_command")
    (reply,) = node.hear("message_format_response")
    assert (reply["success"], reply["protocol_version"]) == (False, 1)


def test_without_gps_it_knows_its_place_by_auxiliary_positions() -> None:
    """Of four sources; a fifth, and those that tell what is no place, change nothing."""
    pilot = Pilot("iris", EKF2_GPS_CTRL=0, EKF2_AGP0_ID=40, EKF2_AGP0_CTRL=1)
    node = Node(pilot)

    def see() -> None:
        pose = pilot.truth
        places = [(40, pose.lat_deg), (1, math.nan), (2, 91.0), (3, 0.0), (4, 0.0)]
        for number, lat in places:
            node.send("aux_global_position", id=number, lat=lat, lon=pose.lon_deg, alt=489.4, eph=0.5, epv=1.0)

    pilot.every(10.0, see)
    pilot.run(12.0)
    here = pilot.topics.vehicle_global_position
    assert here.valid and here.lat == pytest.approx(pilot.truth.lat_deg, abs=1e-5)
    assert [each.id for each in pilot.topics.aux_global_position] == [40, 1, 2, 3]


def test_heartbeats_and_the_temperature_of_a_companion_are_heard() -> None:
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.run(1.0)
    heard = {"heartbeat_type_parachute": True, "parachute_system_healthy": True, "heartbeat_type_flarm": True}
    node.send("telemetry_status", **heard)
    node.send("onboard_computer_status", temperature_board=85)
    pilot.run(0.5)
    *_, status = node.hear("vehicle_status")
    assert status["parachute_system_present"] and status["parachute_system_healthy"]
    assert status["traffic_avoidance_system_present"] and not status["open_drone_id_system_present"]
    assert pilot.topics.onboard_computer_status.temperature_board == 85


def test_without_gps_it_knows_its_place_by_visual_odometry() -> None:
    pilot = Pilot("iris", EKF2_GPS_CTRL=0, EKF2_EV_CTRL=15)
    node = Node(pilot)

    def see() -> None:
        pose = pilot.truth
        node.send(
            "vehicle_visual_odometry",
            timestamp_sample=pilot.autopilot.now_us + node.client.time_offset_us,
            pose_frame=1,
            position=(pose.north_m, pose.east_m, pose.down_m),
            q=pose.q,
            velocity_frame=1,
            velocity=(pose.vn_m_s, pose.ve_m_s, pose.vd_m_s),
            position_variance=FREE,
            orientation_variance=FREE,
            velocity_variance=FREE,
        )

    pilot.every(30.0, see)
    pilot.run(10.0)
    local = pilot.topics.vehicle_local_position
    assert local.xy_valid and math.isnan(local.ref_lat)
