"""Tells the autopilot of obstacles around, as a companion computer with a lidar does: component 196.

https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE, MAV_COMP_ID_OBSTACLE_AVOIDANCE. A state machine on
simulated time. PX4 takes OBSTACLE_DISTANCE on its MAVLink links (mavlink_receiver.cpp), from whatever component, and
not on its simulator's (SimulatorMavlink.cpp).
"""

from collections.abc import Sequence

from sitl_emu.components.component import Component
from sitl_emu.core import dialect as mavlink

PLACES = 72


class ObstacleDetector:
    """What stands between a sensor and the autopilot."""

    def __init__(self, system_id: int) -> None:
        """`system_id` is the vehicle's."""
        component_id, mav_type = mavlink.MAV_COMP_ID_OBSTACLE_AVOIDANCE, mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        self._component = Component(system_id, component_id, mav_type)
        self.outbox = self._component.outbox

    def on_time(self, now_us: int) -> None:
        """The heartbeat, when it is due."""
        self._component.beat(now_us)

    def tell(self, measured_us: int, sensor: int, distances: Sequence[int], nearest: int, farthest: int) -> None:
        """72 distances (cm) clockwise from straight ahead; `sensor` is a MAV_DISTANCE_SENSOR.

        65535 means that nothing is known, more than `farthest` that nothing is there.
        """
        increment = 360.0 / PLACES
        self._component.send(
            mavlink.MAVLink_obstacle_distance_message(
                measured_us,
                sensor,
                distances,
                round(increment),
                nearest,
                farthest,
                increment,
                0.0,
                mavlink.MAV_FRAME_BODY_FRD,
            )
        )
