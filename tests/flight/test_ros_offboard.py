"""Flown from ROS 2 alone, by samples as DDS brings them: OFFBOARD by places, attitudes and rates, and its loss."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState

from .pilot import Pilot
from .ros_node import ARM, OFFBOARD_MODE, SET_MODE, Node, offboard


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
