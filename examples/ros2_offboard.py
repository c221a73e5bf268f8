"""A ROS 2 node flies a square by offboard control, 5 m up, and lands: PX4's "offboard control" in Python.

    sitl-emu launch iris --dds              # in one terminal; pip install 'sitl-emu[ros2]'
    python examples/ros2_offboard.py        # in another, with ROS 2 and px4_msgs of PX4 v1.18 sourced

Instances above 0 have a namespace: `python examples/ros2_offboard.py px4_1` flies the second. The same node is meant
for a real PX4 with its uXRCE-DDS agent, too. Setpoints have to come at more than 2 Hz before PX4 arms in OFFBOARD, and
to keep coming: a node that dies ends it, by COM_OF_LOSS_T and COM_OBL_RC_ACT.
https://docs.px4.io/main/en/ros2/offboard_control
"""

import math
import sys

import rclpy
from px4_msgs.msg import OffboardControlMode, TrajectorySetpoint, VehicleCommand, VehicleLocalPosition, VehicleStatus
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

PX4_QOS = QoSProfile(
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
)
SQUARE = ((0.0, 0.0), (5.0, 0.0), (5.0, 5.0), (0.0, 5.0), (0.0, 0.0))
HEIGHT_M, REACHED_M, PERIOD_S = 5.0, 0.4, 0.05
BEATS_BEFORE = 30
"""Setpoints that are sent before OFFBOARD is asked for."""
ASK_AGAIN = 20
FREE = [math.nan] * 3
CMD_DO_SET_MODE, CMD_COMPONENT_ARM_DISARM, CMD_NAV_LAND = 176, 400, 21
OFFBOARD, AUTO_LAND, ARMED = 14, 18, 2


class OffboardControl(Node):
    """Sends setpoints at 20 Hz, and the next corner when one is reached."""

    def __init__(self, namespace: str) -> None:
        super().__init__("offboard_control")
        fmu = f"/{namespace}/fmu" if namespace else "/fmu"
        self._mode = self.create_publisher(OffboardControlMode, f"{fmu}/in/offboard_control_mode", PX4_QOS)
        self._setpoint = self.create_publisher(TrajectorySetpoint, f"{fmu}/in/trajectory_setpoint", PX4_QOS)
        self._command = self.create_publisher(VehicleCommand, f"{fmu}/in/vehicle_command", PX4_QOS)
        # versioned messages carry their version: https://docs.px4.io/main/en/middleware/uorb#message-versioning
        self.create_subscription(VehicleStatus, f"{fmu}/out/vehicle_status_v4", self._on_status, PX4_QOS)
        self.create_subscription(
            VehicleLocalPosition, f"{fmu}/out/vehicle_local_position_v1", self._on_local_position, PX4_QOS
        )
        self._status, self._position = VehicleStatus(), VehicleLocalPosition()
        self._beats, self._corner, self.done = 0, 0, False
        self.create_timer(PERIOD_S, self._on_time)

    def _on_status(self, status: VehicleStatus) -> None:
        if self._status.arming_state == ARMED and status.arming_state != ARMED and self._corner == len(SQUARE):
            print("landed", flush=True)
            self.done = True
        self._status = status

    def _on_local_position(self, position: VehicleLocalPosition) -> None:
        self._position = position

    def _on_time(self) -> None:
        if self._corner == len(SQUARE):
            if self._status.nav_state != AUTO_LAND:
                self._send_command(CMD_NAV_LAND)
            return
        self._send_setpoint(*SQUARE[self._corner])
        if not self._status.pre_flight_checks_pass and self._status.arming_state != ARMED:
            return
        self._beats += 1
        if self._beats >= BEATS_BEFORE and self._beats % ASK_AGAIN == 0:
            if self._status.nav_state != OFFBOARD:
                self._send_command(CMD_DO_SET_MODE, 1.0, 6.0)  # a mode of PX4's own: OFFBOARD
            elif self._status.arming_state != ARMED:
                self._send_command(CMD_COMPONENT_ARM_DISARM, 1.0)
        self._look_for_corner()

    def _look_for_corner(self) -> None:
        north, east = SQUARE[self._corner]
        here = self._position
        if math.dist((here.x, here.y, here.z), (north, east, -HEIGHT_M)) < REACHED_M:
            self._corner += 1
            print(f"corner {self._corner} of {len(SQUARE)}", flush=True)

    def _send_setpoint(self, north: float, east: float) -> None:
        mode = OffboardControlMode()
        mode.timestamp, mode.position = self._now_us(), True
        self._mode.publish(mode)
        setpoint = TrajectorySetpoint()
        setpoint.timestamp = mode.timestamp
        setpoint.position = [north, east, -HEIGHT_M]
        setpoint.velocity, setpoint.acceleration, setpoint.jerk = FREE, FREE, FREE
        setpoint.yaw, setpoint.yawspeed = 0.0, math.nan
        self._setpoint.publish(setpoint)

    def _send_command(self, command: int, param1: float = 0.0, param2: float = 0.0) -> None:
        message = VehicleCommand()
        message.timestamp, message.command = self._now_us(), command
        message.param1, message.param2 = param1, param2
        message.param4 = message.param5 = message.param6 = message.param7 = math.nan
        message.target_system, message.target_component = self._status.system_id, 1
        message.source_system, message.source_component, message.from_external = 1, 1, True
        self._command.publish(message)

    def _now_us(self) -> int:
        return int(self.get_clock().now().nanoseconds / 1000)


def main(namespace: str = "") -> None:
    """Fly until landed."""
    rclpy.init()
    node = OffboardControl(namespace)
    while rclpy.ok() and not node.done:
        rclpy.spin_once(node, timeout_sec=1.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:2])
