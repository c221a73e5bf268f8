"""Flown from ROS 2 alone, by samples as DDS brings them: offboard control, its loss, what a hostile node sends."""

import math
import random
import struct
from collections.abc import Iterator
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, PUBLICATIONS, SUBSCRIPTIONS, Sample

from .pilot import Pilot

SET_MODE, ARM, TAKEOFF, LAND = 176, 400, 22, 21
OFFBOARD_MODE = (1.0, 6.0)
"""DO_SET_MODE: custom mode enabled, PX4's OFFBOARD."""
FREE = (math.nan, math.nan, math.nan)
NUMBERS = {topic.name: number for number, topic in enumerate(SUBSCRIPTIONS)}
TYPES = {topic.name: topic.type for topic in SUBSCRIPTIONS}


class Node:
    """A ROS 2 node beside a vehicle in memory; its messages are stamped with its clock."""

    def __init__(self, pilot: Pilot) -> None:
        self.pilot = pilot
        self.client = pilot.autopilot.start_uxrce_dds_client()
        self.heard: list[tuple[str, dict[str, Any]]] = []

    def send(self, topic: str, **fields: Any) -> None:
        """One message of /fmu/in/TOPIC."""
        now_us = self.pilot.autopilot.now_us
        told = {"timestamp": now_us + self.client.time_offset_us, **fields}
        sample = Sample(NUMBERS[topic], cdr.Writer(TYPES[topic]).write(**told))
        self.client.on_sample(now_us, sample)

    def command(self, number: int, *params: float, target_system: int = 1) -> None:
        """A VehicleCommand, as PX4's offboard example sends it."""
        told = {f"param{place}": value for place, value in enumerate(params, 1)}
        who = {"target_component": 1, "source_system": 1, "source_component": 1, "from_external": True}
        self.send("vehicle_command", command=number, target_system=target_system, **who, **told)

    def hold(self, position: tuple[float, float, float]) -> None:
        """Position control, one beat of it."""
        self.send("offboard_control_mode", position=True)
        free = {"velocity": FREE, "acceleration": FREE, "jerk": FREE, "yawspeed": math.nan}
        self.send("trajectory_setpoint", position=position, yaw=0.0, **free)

    def hear(self, topic: str) -> Iterator[dict[str, Any]]:
        """What came on /fmu/out/TOPIC since the last time."""
        for number, data in self.client.outbox:
            self.heard.append((PUBLICATIONS[number].name, cdr.Reader(PUBLICATIONS[number].type).read(data)))
        self.client.outbox.clear()
        found = [fields for name, fields in self.heard if name == topic]
        self.heard = [each for each in self.heard if each[0] != topic]
        yield from found

    def acks(self) -> list[tuple[int, int]]:
        """Commands and results."""
        return [(ack["command"], ack["result"]) for ack in self.hear("vehicle_command_ack")]


def offboard(pilot: Pilot, node: Node, place: list[float], on: list[bool]) -> None:
    """Setpoints for a place that may be moved, at 10 Hz; armed in OFFBOARD, as in PX4's ROS 2 example."""

    def beat() -> None:
        if on[0]:
            north, east, down = place
            node.hold((north, east, down))

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)


def test_a_square_is_flown_from_ros_alone() -> None:
    pilot = Pilot("iris")
    node, place, on = Node(pilot), [0.0, 0.0, -5.0], [True]
    offboard(pilot, node, place, on)
    pilot.until(lambda: -pilot.truth.down_m > 4.5, 30.0)
    assert node.acks()[-2:] == [(SET_MODE, 0), (ARM, 0)]
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD
    for north, east in ((5.0, 0.0), (5.0, 5.0), (0.0, 5.0), (0.0, 0.0)):
        place[:2] = north, east
        pilot.until(
            lambda north=north, east=east: (
                math.hypot(  # type: ignore[misc]
                    pilot.topics.vehicle_local_position.x - north, pilot.topics.vehicle_local_position.y - east
                )
                < 0.5
            ),
            20.0,
        )
    *_, status = node.hear("vehicle_status")
    assert (status["nav_state"], status["arming_state"]) == (14, 2)
    *_, odometry = node.hear("vehicle_odometry")
    assert odometry["position"][2] == pytest.approx(-5.0, abs=0.5)


def test_it_goes_to_a_place_no_faster_than_asked() -> None:
    """By goto_setpoint, as PX4's ROS 2 library has it: up at 1 m/s, 10 m north at 2 m/s, turned east meanwhile.

    Not at take-off: the trajectory's height does not wait for a vehicle that stands yet, in PX4 neither.
    """
    pilot = Pilot("iris")
    node, place = Node(pilot), [0.0, 0.0, -5.0]

    def beat() -> None:
        node.send("offboard_control_mode", position=True)
        limits = {"max_horizontal_speed": 2.0, "max_vertical_speed": 1.0, "max_heading_rate": 0.3}
        flags = {f"flag_set_{name}": True for name in limits}
        heading = {"flag_control_heading": True, "heading": math.pi / 2}
        node.send("goto_setpoint", position=tuple(place), **limits, **flags, **heading)

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.until(lambda: -pilot.truth.down_m > 4.8, 30.0)
    pilot.run(3.0)
    local = []
    pilot.every(50.0, lambda: local.append(pilot.topics.vehicle_local_position))
    place[:] = 10.0, 0.0, -9.0
    pilot.until(lambda: math.dist((10.0, -9.0), (pilot.truth.north_m, pilot.truth.down_m)) < 0.4, 30.0)
    assert 0.9 < -min(here.vz for here in local) < 1.4
    assert 1.8 < max(math.hypot(here.vx, here.vy) for here in local) < 2.3
    assert pilot.topics.vehicle_local_position.heading == pytest.approx(math.pi / 2, abs=0.1)


def test_a_place_that_is_asked_for_no_more_is_kept_and_a_trajectory_counts_more() -> None:
    pilot = Pilot("iris")
    node, place, on = Node(pilot), [3.0, 0.0, -5.0], [True]

    def beat() -> None:
        node.send("offboard_control_mode", position=True)
        if on[0]:
            north, east, down = place
            node.send("goto_setpoint", position=(north, east, down))

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.until(lambda: -pilot.truth.down_m > 4.8 and pilot.topics.vehicle_local_position.x > 2.7, 30.0)
    on[0] = False
    place[0] = 30.0
    pilot.run(3.0)
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD
    assert pilot.topics.vehicle_local_position.x == pytest.approx(3.0, abs=0.4)
    node.send("goto_setpoint", position=(math.nan, 0.0, -5.0))
    node.hold((0.0, 0.0, -5.0))
    pilot.until(lambda: pilot.topics.vehicle_local_position.x < 0.5, 20.0)


def test_a_rover_is_driven_by_throttle_and_heading_and_by_throttle_and_rate() -> None:
    """As PX4's own rover: OFFBOARD's attitude and rates take rover_*_setpoint straight from ROS 2."""
    pilot = Pilot("rover")
    node, rates, throttle = Node(pilot), [False], [0.0]

    def beat() -> None:
        node.send("offboard_control_mode", attitude=not rates[0], body_rate=rates[0])
        node.send("rover_throttle_setpoint", throttle_body_x=throttle[0])
        if rates[0]:
            node.send("rover_rate_setpoint", yaw_rate_setpoint=0.2)
        else:
            node.send("rover_attitude_setpoint", yaw_setpoint=math.pi / 2)

    def local() -> Any:
        return pilot.topics.vehicle_local_position

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.run(1.0)
    assert node.acks()[-2:] == [(SET_MODE, 0), (ARM, 0)]
    assert math.hypot(local().vx, local().vy) < 0.1
    throttle[0] = 0.3
    pilot.until(lambda: abs(local().heading - math.pi / 2) < 0.1 and local().vy > 0.5, 30.0)
    rates[0] = True
    pilot.run(3.0)
    assert pilot.topics.vehicle_angular_velocity.xyz[2] == pytest.approx(0.2, abs=0.06)
    node.send("rover_throttle_setpoint", throttle_body_x=math.nan)
    node.send("rover_rate_setpoint", yaw_rate_setpoint=math.inf)
    told = pilot.topics.offboard_setpoint.rover
    assert told is not None and math.isnan(told.throttle[1]) and math.isnan(told.yaw_rate[1])
    throttle[0] = 0.0
    pilot.until(lambda: math.hypot(local().vx, local().vy) < 0.1, 20.0)
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD


def test_a_rover_asked_for_acceleration_drives_at_a_speed() -> None:
    """Its speed, heading and rate controllers run, and OFFBOARD tells them nothing (AckermannOffboardMode.cpp)."""
    pilot = Pilot("rover")
    node = Node(pilot)

    def beat() -> None:
        node.send("offboard_control_mode", acceleration=True)
        node.send("rover_speed_setpoint", speed_body_x=0.8)
        node.send("rover_attitude_setpoint", yaw_setpoint=math.pi / 2)

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.run(10.0)
    local = pilot.topics.vehicle_local_position
    assert (local.vx, local.vy) == pytest.approx((0.0, 0.8), abs=0.1)


def test_without_setpoints_it_falls_back() -> None:
    """COM_OF_LOSS_T, then COM_OBL_RC_ACT: the same as over MAVLink."""
    pilot = Pilot("iris", COM_OBL_RC_ACT=4)
    node, place, on = Node(pilot), [0.0, 0.0, -5.0], [True]
    offboard(pilot, node, place, on)
    pilot.until(lambda: -pilot.truth.down_m > 4.5, 30.0)
    on[0] = False
    pilot.run(0.5)
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD
    pilot.until(lambda: pilot.topics.vehicle_status.failsafe, 10.0)
    pilot.until(lambda: pilot.topics.vehicle_status.nav_state is NavState.AUTO_LAND, 10.0)


@pytest.mark.parametrize(("asked", "result"), [({}, 1), ({"attitude": True}, 0), ({"direct_actuator": True}, 0)])
def test_what_is_asked_for_is_the_signal_with_or_without_setpoints(asked: dict[str, bool], result: int) -> None:
    """offboardCheck.cpp. Until the first setpoint comes there is the thrust that PX4 keeps to tell an attitude by.

    0.001 (PositionControl::setThrustLimits), of which the control of rates turns off one motor and doubles another:
    so it stands in a real PX4's log just after arming, too. The outputs are the root of that (THR_MDL_FAC 1).
    """
    pilot = Pilot("iris")
    node = Node(pilot)
    pilot.until_armable()
    pilot.every(10.0, lambda: node.send("offboard_control_mode", **asked))
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.run(0.5)
    assert node.acks()[-1] == (ARM, result)
    assert pilot.topics.failsafe_flags.offboard_control_signal_lost == (not asked)
    assert max(pilot.topics.actuator_outputs.controls) <= math.sqrt(2 * 0.001) + 1e-6


class Balancer:
    """A node that holds an iris level at a height by its own controller, from what vehicle_odometry tells."""

    def __init__(self, node: Node, mode: str) -> None:
        """`mode`: field of offboard_control_mode."""
        self.node, self.mode, self.height_m, self.motor_off = node, mode, 3.0, False

    def beat(self) -> None:
        """A step of it, with the newest odometry."""
        for odometry in self.node.hear("vehicle_odometry"):
            self.odometry = odometry
        (_, x, y, z), (p, q, r) = self.odometry["q"], self.odometry["angular_velocity"]
        down, down_speed = self.odometry["position"][2], self.odometry["velocity"][2]
        torque = (-2.0 * x - 0.15 * p, -2.0 * y - 0.15 * q, -0.5 * z - 0.2 * r)
        thrust = max(0.1, min(0.8, 0.56 + 0.1 * (down + self.height_m) + 0.15 * down_speed))
        self.node.send("offboard_control_mode", **{self.mode: True})
        if self.mode == "thrust_and_torque":
            self.node.send("vehicle_thrust_setpoint", xyz=(0.0, 0.0, -thrust))
            self.node.send("vehicle_torque_setpoint", xyz=torque)
            return
        roll, pitch, yaw = (0.7 * part for part in torque)
        arms = ((-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1))
        motors = [max(0.0, thrust + a * roll + b * pitch + c * yaw) for a, b, c in arms]
        if self.motor_off:
            motors[0] = math.nan
        self.node.send("actuator_motors", control=(*motors, *(math.nan,) * 8))


@pytest.mark.parametrize("mode", ["thrust_and_torque", "direct_actuator"])
def test_a_node_balances_it_by_itself_and_when_it_stops_px4_does(mode: str) -> None:
    """No controller of the vehicle runs meanwhile; they take over at once when the signal is lost."""
    pilot = Pilot("iris", COM_OBL_RC_ACT=4)
    node, on = Node(pilot), [True]
    balancer = Balancer(node, mode)
    pilot.until_armable()
    pilot.every(100.0, lambda: balancer.beat() if on[0] else None)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.until(lambda: -pilot.truth.down_m > 2.5, 15.0)
    pilot.run(5.0)
    assert -pilot.truth.down_m == pytest.approx(3.0, abs=0.5)
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD
    *_, told = node.hear("vehicle_control_mode")
    flags = {name for name, value in told.items() if value is True}
    allocates = {"flag_control_allocation_enabled"} if mode == "thrust_and_torque" else set()
    assert flags == {"flag_armed", "flag_control_offboard_enabled"} | allocates
    assert pilot.topics.vehicle_rates_setpoint.timestamp < pilot.autopilot.now_us - 5_000_000
    assert not pilot.topics.vehicle_land_detected.landed
    on[0] = False
    pilot.until(lambda: pilot.topics.vehicle_status.nav_state is NavState.AUTO_LAND, 10.0)
    assert max(map(abs, pilot.topics.vehicle_attitude.euler[:2])) < 0.5
    pilot.until(lambda: not pilot.topics.vehicle_status.armed, 30.0)
    assert pilot.topics.vehicle_land_detected.landed


def test_direct_actuators_stop_one_by_one_and_all_when_it_is_disarmed() -> None:
    """NaN stops a motor (ActuatorMotors.msg). Nobody asks for thrust: it counts as flying, and is disarmed by force."""
    pilot = Pilot("iris")
    node = Node(pilot)
    balancer = Balancer(node, "direct_actuator")
    balancer.motor_off, balancer.height_m = True, -2.0
    pilot.until_armable()
    pilot.every(50.0, balancer.beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.run(2.0)
    first, *others = pilot.topics.actuator_outputs.pwm
    assert first == 900 and all(1050 < other < 2000 for other in others)
    assert not pilot.topics.vehicle_land_detected.landed
    node.command(ARM, 0.0)
    node.command(ARM, 0.0, 21196.0)
    pilot.run(0.5)
    assert node.acks()[-2:] == [(ARM, 1), (ARM, 0)]
    assert not pilot.topics.vehicle_status.armed
    assert set(pilot.topics.actuator_outputs.pwm) == {900} and set(pilot.topics.actuator_outputs.controls) == {0.0}


def test_a_rover_is_driven_by_throttle_and_steering_and_by_its_actuators() -> None:
    """thrust_and_torque leaves a rover its actuators' control alone, direct_actuator nothing (RoverAckermann.cpp)."""
    pilot = Pilot("rover")
    node, direct, throttle, flags = Node(pilot), [False], [0.3], [1]

    def beat() -> None:
        node.send("offboard_control_mode", thrust_and_torque=not direct[0], direct_actuator=direct[0])
        if direct[0]:
            node.send("actuator_motors", control=(throttle[0],) * 12, reversible_flags=flags[0])
            node.send("actuator_servos", control=(-0.5,) + (math.nan,) * 14)
        else:
            node.send("rover_throttle_setpoint", throttle_body_x=throttle[0])
            node.send("rover_steering_setpoint", normalized_steering_setpoint=0.5)

    def yaw_rate() -> float:
        return pilot.topics.vehicle_angular_velocity.xyz[2]

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
    pilot.run(4.0)
    assert pilot.topics.actuator_outputs.controls == pytest.approx((0.5, 0.3))
    assert yaw_rate() > 0.1 and pilot.topics.vehicle_local_position.vx > 0.2
    direct[0] = True
    pilot.run(3.0)
    assert pilot.topics.actuator_outputs.controls == pytest.approx((-0.5, 0.3))
    assert yaw_rate() < -0.1
    throttle[0] = -0.3
    pilot.run(3.0)
    assert pilot.topics.actuator_outputs.controls == pytest.approx((-0.5, -0.3))
    flags[0] = 0
    pilot.run(0.5)
    assert pilot.topics.actuator_outputs.controls == pytest.approx((-0.5, 0.0))
    assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD


def test_it_climbs_by_attitude_and_by_rates() -> None:
    for mode, topic in (("attitude", "vehicle_attitude_setpoint"), ("body_rate", "vehicle_rates_setpoint")):
        pilot = Pilot("iris")
        node = Node(pilot)
        up = (0.0, 0.0, -0.8)
        fields = {"thrust_body": up} | ({"q_d": (1.0, 0.0, 0.0, 0.0)} if mode == "attitude" else {})

        def beat(node: Node = node, mode: str = mode, topic: str = topic, fields: dict[str, Any] = fields) -> None:
            node.send("offboard_control_mode", **{mode: True})
            node.send(topic, **fields)

        pilot.until_armable()
        pilot.every(50.0, beat)
        pilot.run(1.0)
        node.command(SET_MODE, *OFFBOARD_MODE)
        node.command(ARM, 1.0)
        pilot.until(lambda pilot=pilot: -pilot.truth.down_m > 3.0, 15.0)  # type: ignore[misc]
        assert pilot.topics.vehicle_status.nav_state is NavState.OFFBOARD


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
    """Of four sources; a fifth, and what is no place, change nothing."""
    pilot = Pilot("iris", EKF2_GPS_CTRL=0, EKF2_AGP0_ID=40, EKF2_AGP0_CTRL=1)
    node = Node(pilot)

    def see() -> None:
        pose = pilot.truth
        places = [(40, pose.lat_deg), (40, math.nan), (40, 91.0), *((number, 0.0) for number in (1, 2, 3, 4))]
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
