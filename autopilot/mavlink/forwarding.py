"""Which messages pass from one link to the others (PX4: Mavlink::forward_message, all four links have it on).

A message without a target, or to everybody, goes to every other link; one with a target only to links on which that
target was heard; one for this autopilot to none. STATUSTEXT stays, as measured.
"""

from collections.abc import Iterable
from typing import Any

from autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

NOT_FORWARDED = frozenset({mavlink.MAVLINK_MSG_ID_STATUSTEXT})


def forward(message: Any, source: Link, links: Iterable[Link], own_system: int) -> None:
    """Queue a received message on the links that it concerns."""
    if message.get_msgId() in NOT_FORWARDED or (message.get_srcSystem() == own_system and _is_own(message)):
        return
    system = getattr(message, "target_system", 0)
    component = getattr(message, "target_component", 0)
    frame: bytes | None = None
    for link in links:
        if link is source or not _concerns(link, system, component):
            continue
        if frame is None:
            frame = bytes(message.get_msgbuf())
        link.send_frame(frame)


def _is_own(message: Any) -> bool:
    return bool(message.get_srcComponent() == 1)


def _concerns(link: Link, system: int, component: int) -> bool:
    if system == 0:
        return bool(link.seen) or component == 0
    if component == 0:
        return any(seen_system == system for seen_system, _ in link.seen)
    return (system, component) in link.seen
