"""telemetry_status: how each link fares, and who was heard on it (PX4: Mavlink::publish_telemetry_status,
MavlinkReceiver::CheckHeartbeats).

Once a second, by which PX4's log takes it; PX4 publishes it at each HEARTBEAT, too. Not in it: parachutes' and Open
Drone ID's health of each link (topics.gcs_heartbeats has the vehicle's), overruns of buffers, of which there are none.
"""

from collections.abc import Sequence
from typing import Final

from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.topics import TelemetryStatus, Topics
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import quotient

EVERY_US: Final = 1_000_000
HEARTBEAT_TIMEOUT_US: Final = 2_500_000
"""telemetry_status HEARTBEAT_TIMEOUT_US."""
SLOTS: Final = ("telemetry_status", "telemetry_status_1", "telemetry_status_2", "telemetry_status_3")
"""Topics of the links; PX4 logs four."""
MODES: Final = {"normal": 0, "custom": 1, "onboard": 2, "onboard_low_bandwidth": 2, "gimbal": 10}
"""MAVLINK_MODE by link; SITL's payload link is an onboard one with a lower data rate (px4-rc.mavlink)."""
DATA_RATES: Final = {"onboard_low_bandwidth": 4e3, "gimbal": 4e5}
FASTEST: Final = 4e6
"""B/s, of the other modes: -r of px4-rc.mavlink."""
TYPES: Final = {
    mavlink.MAV_TYPE_ANTENNA_TRACKER: "antenna_tracker",
    mavlink.MAV_TYPE_GCS: "gcs",
    mavlink.MAV_TYPE_ONBOARD_CONTROLLER: "onboard_controller",
    mavlink.MAV_TYPE_GIMBAL: "gimbal",
    mavlink.MAV_TYPE_ADSB: "adsb",
    mavlink.MAV_TYPE_FLARM: "flarm",
    mavlink.MAV_TYPE_CAMERA: "camera",
    mavlink.MAV_TYPE_PARACHUTE: "parachute",
    mavlink.MAV_TYPE_ODID: "open_drone_id",
}
COMPONENTS: Final = {
    mavlink.MAV_COMP_ID_TELEMETRY_RADIO: "telemetry_radio",
    mavlink.MAV_COMP_ID_LOG: "log",
    mavlink.MAV_COMP_ID_OSD: "osd",
    mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY: "vio",
    mavlink.MAV_COMP_ID_PAIRING_MANAGER: "pairing_manager",
    mavlink.MAV_COMP_ID_UDP_BRIDGE: "udp_bridge",
    mavlink.MAV_COMP_ID_UART_BRIDGE: "uart_bridge",
}


def hear(now_us: int, kind: int, component: int, link: Link) -> None:
    """A HEARTBEAT of a ground station or of this vehicle's own system came in on a link."""
    if kind in TYPES:
        link.heartbeats[f"heartbeat_type_{TYPES[kind]}"] = now_us
    if component in COMPONENTS:
        link.heartbeats[f"heartbeat_component_{COMPONENTS[component]}"] = now_us


class TelemetryReports:
    """Writer of telemetry_status."""

    def __init__(self, topics: Topics, links: Sequence[Link]) -> None:
        self._topics, self._links = topics, links
        self.due_us = EVERY_US

    def publish(self, now_us: int) -> None:
        """Tell of each link."""
        self.due_us = now_us + EVERY_US
        for slot, link in zip(SLOTS, self._links, strict=False):
            setattr(self._topics, slot, _status(now_us, link))


def _status(now_us: int, link: Link) -> TelemetryStatus:
    sent, heard = link.bytes_per_s
    recent = {name: True for name, time_us in link.heartbeats.items() if now_us <= time_us + HEARTBEAT_TIMEOUT_US}
    return TelemetryStatus(
        now_us,
        MODES[link.mode],
        DATA_RATES.get(link.mode, FASTEST),
        link.rate_multiplier,
        sent,
        link.messages_sent,
        heard,
        link.messages_received,
        link.messages_lost,
        link.parse_errors,
        quotient(link.messages_lost, link.messages_received) if link.bytes_received else 0.0,
        link.forwarding,
        sum(1 for _ in link.streams()) + len(link.silent_intervals_us),
        **recent,
    )
