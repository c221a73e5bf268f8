"""OPTICAL_FLOW_RAD: how the ground moves under a camera that looks down (topics.vehicle_optical_flow; EKF2_OF_CTRL).

https://mavlink.io/en/messages/common.html#OPTICAL_FLOW_RAD: angles integrated over a time, with the rotation that the
sensor itself made, and how far away the ground was.
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.device_id import FLOW, device_id
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.vehicle_optical_flow import FlowGatherer
from sitl_emu.autopilot.topics import NAN, SensorOpticalFlow, Topics
from sitl_emu.core import dialect as mavlink

PARAMETERS = tuple(f"SENS_FLOW_{what}" for what in ("MAXHGT", "MAXR", "MINHGT", "RATE", "ROT", "SCALE"))
"""Those of PX4's VehicleOpticalFlow, which starts with the first flow (Sensors::InitializeVehicleOpticalFlow)."""


class OpticalFlow:
    """Writer of sensor_optical_flow: what a camera sends; FlowGatherer writes vehicle_optical_flow."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD})
    HAS_TIMER = False

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        """Writes into `topics`."""
        self._topics, self._parameters = topics, parameters
        self._gatherer = FlowGatherer(topics, parameters)

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """One sample; a negative distance is none."""
        self._parameters.use(PARAMETERS)
        sample = SensorOpticalFlow(
            (message.integrated_x, message.integrated_y),
            (message.integrated_xgyro, message.integrated_ygyro, message.integrated_zgyro),
            message.integration_time_us,
            message.quality,
            message.distance if message.distance >= 0.0 else NAN,
            now_us,
            device_id(FLOW, message.get_srcSystem(), link),
        )
        self._topics.sensor_optical_flow = sample
        self._gatherer.put(now_us, sample)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
