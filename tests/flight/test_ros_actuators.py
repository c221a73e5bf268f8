"""Controlled from ROS 2 alone: thrust and torque, motors and servos, where no controller of the vehicle runs."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState

from .pilot import Pilot
from .ros_node import ARM, OFFBOARD_MODE, SET_MODE, Node


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
