"""HEARTBEAT of others: when ground stations and components of this vehicle were last heard (PX4: telemetry_status).

Ground stations may have any system id; everybody else counts only with the vehicle's own
(MavlinkReceiver::handle_message_heartbeat).
"""

from typing import Any, ClassVar

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.telemetry_status import hear
from sitl_emu.autopilot.topics import CameraStatus, Topics
from sitl_emu.core import dialect as mavlink

HEALTHY = (mavlink.MAV_STATE_STANDBY, mavlink.MAV_STATE_ACTIVE)
TRAFFIC_RECEIVERS = (mavlink.MAV_TYPE_ADSB, mavlink.MAV_TYPE_FLARM)
"""One is as good as the other for COM_ARM_TRAFF (Commander::dataLinkCheck)."""


class Heartbeat:
    """Writer of topics.gcs_heartbeats and camera_status; tells a link of its ground station."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT})
    HAS_TIMER = False

    def __init__(self, topics: Topics, system_id: int) -> None:
        """Writes into `topics`."""
        self._topics = topics
        self._system_id = system_id

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Note the time by the sender's type."""
        heartbeats, kind = self._topics.gcs_heartbeats, message.type
        healthy = message.system_status in HEALTHY
        if kind == mavlink.MAV_TYPE_GCS or message.get_srcSystem() == self._system_id:
            hear(now_us, kind, message.get_srcComponent(), link)
        if kind == mavlink.MAV_TYPE_GCS:
            heartbeats = heartbeats._replace(gcs_us=now_us)
            link.hear_gcs(now_us, was_lost=self._topics.vehicle_status.gcs_connection_lost)
        elif message.get_srcSystem() != self._system_id:
            return
        elif kind == mavlink.MAV_TYPE_ONBOARD_CONTROLLER:
            heartbeats = heartbeats._replace(onboard_us=now_us)
        elif kind == mavlink.MAV_TYPE_PARACHUTE:
            heartbeats = heartbeats._replace(parachute_us=now_us, parachute_healthy=healthy)
        elif kind == mavlink.MAV_TYPE_ODID:
            heartbeats = heartbeats._replace(open_drone_id_us=now_us, open_drone_id_healthy=healthy)
        elif kind in TRAFFIC_RECEIVERS:
            heartbeats = heartbeats._replace(adsb_us=now_us)
        elif kind == mavlink.MAV_TYPE_CAMERA:
            self._topics.camera_status = CameraStatus(now_us, message.get_srcSystem(), message.get_srcComponent())
        self._topics.gcs_heartbeats = heartbeats

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
