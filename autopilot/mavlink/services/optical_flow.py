"""OPTICAL_FLOW_RAD: how the ground moves under a camera that looks down (topics.vehicle_optical_flow; EKF2_OF_CTRL).

https://mavlink.io/en/messages/common.html#OPTICAL_FLOW_RAD: angles integrated over a time, with the rotation that the
sensor itself made. Height comes from the range sensor, and not from this message, as it does in PX4's filter.
"""

import math
from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleOpticalFlow
from sitl_emu.core import dialect as mavlink

LONGEST_S = 1.0
PARAMETERS = tuple(f"SENS_FLOW_{what}" for what in ("MAXHGT", "MAXR", "MINHGT", "RATE", "ROT", "SCALE"))
"""Those of PX4's VehicleOpticalFlow, which starts with the first flow (Sensors::InitializeVehicleOpticalFlow)."""


class OpticalFlow:
    """Writer of vehicle_optical_flow."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD})
    HAS_TIMER = False

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        """Writes into `topics`."""
        self._topics, self._parameters = topics, parameters

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Rates in rad/s, free of the vehicle's own rotation; a time that is none is not kept."""
        self._parameters.use(PARAMETERS)
        dt_s = message.integration_time_us * 1e-6
        flow_x, flow_y = message.integrated_x, message.integrated_y
        if not (0.0 < dt_s <= LONGEST_S and math.isfinite(flow_x + flow_y)):
            return
        turn_x, turn_y = message.integrated_xgyro, message.integrated_ygyro
        if not math.isfinite(turn_x + turn_y):
            rates = self._topics.vehicle_angular_velocity.xyz
            turn_x, turn_y = rates[0] * dt_s, rates[1] * dt_s
        rate_x, rate_y = (flow_x - turn_x) / dt_s, (flow_y - turn_y) / dt_s
        turn_z = message.integrated_zgyro
        if not math.isfinite(turn_z):
            turn_z = self._topics.vehicle_angular_velocity.xyz[2] * dt_s
        self._topics.vehicle_optical_flow = VehicleOpticalFlow(
            now_us,
            rate_x,
            rate_y,
            message.quality,
            message.integration_time_us,
            (flow_x, flow_y),
            (turn_x, turn_y, turn_z),
            message.distance,
        )

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
