"""The events that go with texts: PX4 says each of these both ways, and QGroundControl shows the event.

Ids are PX4 v1.18's (component 1, hash of the event's name). Texts without an entry have no event here.
"""

import re
import struct
from collections.abc import Callable
from typing import NamedTuple


class TextEvent(NamedTuple):
    """An event and its packed arguments."""

    id: int
    arguments: bytes = b""


ARM_DISARM_REASON = {
    "external command": 4,
    "internal command": 3,
    "mission start": 5,
    "landing": 6,
    "auto preflight disarming": 7,
}
"""px4::arm_disarm_reason_t."""


def _reason(match: re.Match[str]) -> bytes:
    return struct.pack("<B", ARM_DISARM_REASON.get(match[1], 0))


def _float(match: re.Match[str]) -> bytes:
    return struct.pack("<f", float(match[1]))


def _two_integers(match: re.Match[str]) -> bytes:
    return struct.pack("<ii", int(match[1]), int(match[2]))


def _log_file(match: re.Match[str]) -> bytes:
    return struct.pack("<H5B", *map(int, match.groups()))


def _unsigned(match: re.Match[str]) -> bytes:
    return struct.pack("<I", int(match[1]))


def _none(match: re.Match[str]) -> bytes:
    return b""


PATTERNS: tuple[tuple[re.Pattern[str], int, Callable[[re.Match[str]], bytes]], ...] = tuple(
    (re.compile(pattern), event_id, arguments)
    for pattern, event_id, arguments in (
        (r"Armed by (.*)\t", 26266355, _reason),
        (r"\[logger\] \./log/(\d+)-(\d+)-(\d+)/(\d+)_(\d+)_(\d+)\.ulg\t", 17980399, _log_file),
        (r"\[logger\] Not logging; SD almost full: (\d+) MiB\t", 32826017, _unsigned),
        (r"Disarmed by (.*)\t", 32794487, _reason),
        (r"Takeoff detected\t", 21054825, _none),
        (r"Landing detected\t", 26622124, _none),
        (r"Mission finished, landed\t", 24580612, _none),
        (r"Reposition is outside geofence\t", 30272452, _none),
        (r"Using default takeoff altitude: ([\d.]+) m\t", 20656071, _float),
        (r"RTL: land at destination\t", 16962474, _none),
        (r"RTL: start return at (-?\d+) m \((-?\d+) m above destination\)\t", 22161044, _two_integers),
        (r"Executing Mission\t", 32375217, _none),
        (r"Climb to ([\d.]+) meters above home\t", 24986204, _float),
        (r"Mission finished, loitering\t", 21455606, _none),
        (r"Arming denied: Resolve system health failures first\t", 16910493, _none),
        (r"Disarming denied: not landed\t", 25868725, _none),
        (r"Mission start denied! No valid mission\t", 23844490, _none),
        (r"IGN MISSION_ITEM: Invalid item\t", 33469040, _none),
        (r"IGN MISSION_ITEM: No transfer\t", 17216882, _none),
    )
)


def event_of(text: str) -> TextEvent | None:
    """The event of a text, or None."""
    for pattern, event_id, arguments in PATTERNS:
        match = pattern.fullmatch(text)
        if match is not None:
            return TextEvent(event_id, arguments(match))
    return None
