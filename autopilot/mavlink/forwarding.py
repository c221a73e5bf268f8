"""Which messages pass from one link to the others (PX4: Mavlink::forward_message).

All links but a display's have it on. A message passes, byte for byte, to every other link on which its target was
heard: without a target, or to everybody, to all on which anybody was. One for this very autopilot stays, as do a
HEARTBEAT when MAV_HB_FORW_EN is 0 and SETUP_SIGNING, which MAVLink forbids to pass on.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from sitl_emu.autopilot.mavlink.encoder import AUTOPILOT_COMPONENT
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

SETUP_SIGNING: int = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
TARGETS_AT: Mapping[int, tuple[int, ...]] = {
    mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL: (10,),
    mavlink.MAVLINK_MSG_ID_TIMESYNC: (16, 17),
    mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL: (79, 80),
}
"""Where in their payloads messages name their system, and component, whose fields the dialect knows by other names or
not at all (PX4: MAVLINK_MESSAGE_CRCS of its development.h).
"""


def forward(message: Any, source: Link, links: Iterable[Link], own_system: int, heartbeats: bool) -> None:
    """Queue a received message on the links that it concerns; `heartbeats` says whether those pass."""
    if not source.forwarding:
        return
    number = message.get_msgId()
    if number == SETUP_SIGNING or (number == mavlink.MAVLINK_MSG_ID_HEARTBEAT and not heartbeats):
        return
    target = target_of(message)
    if target == (own_system, AUTOPILOT_COMPONENT):
        return
    frame: bytes | None = None
    for link in links:
        if link is not source and link.forwarding and link.heard(*target):
            if frame is None:
                frame = bytes(message.get_msgbuf())
            link.send_frame(frame)


def target_of(message: Any) -> tuple[int, int]:
    """System and component that a message is for; 0: all of them."""
    places = TARGETS_AT.get(message.get_msgId())
    if places is None:
        return getattr(message, "target_system", 0), getattr(message, "target_component", 0)
    payload = message.get_payload()
    system, component = (*(payload[place] if place < len(payload) else 0 for place in places), 0)[:2]
    return system, component
