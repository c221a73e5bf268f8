"""HEARTBEAT of others: when a ground station and an onboard controller were last heard (PX4: telemetry_status)."""

from typing import Any

from autopilot.mavlink.link import Link
from autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink


class GcsHeartbeat:
    """Writer of topics.gcs_heartbeats and of `Link.heard_gcs`."""

    MESSAGES = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT})
    HAS_TIMER = False

    def __init__(self, topics: Topics) -> None:
        """Writes into `topics`."""
        self._topics = topics

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Note the time by the sender's type."""
        heartbeats = self._topics.gcs_heartbeats
        if message.type == mavlink.MAV_TYPE_GCS:
            self._topics.gcs_heartbeats = heartbeats._replace(gcs_us=now_us)
            link.heard_gcs = True
        elif message.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER:
            self._topics.gcs_heartbeats = heartbeats._replace(onboard_us=now_us)

    def on_time(self, now_us: int) -> None:
        """Nothing to do by itself."""
