"""Which plan items PX4 v1.18 takes, and how it keeps them (mavlink_mission.cpp, parse_mavlink_mission_item).

Measured item by item: navigation commands want a global frame; DO commands may stand in any; parameters that a
command does not use must be 0 or NaN; everything else is UNSUPPORTED. Whether a mission can be flown is the navigator's
question.
"""

import math
from typing import Any

from autopilot.dataman import MissionItem
from sitl_emu.core import dialect as mavlink

MISSION, FENCE, RALLY = 0, 1, 2
ACCEPTED: int = mavlink.MAV_MISSION_ACCEPTED
ERROR: int = mavlink.MAV_MISSION_ERROR
UNSUPPORTED_FRAME: int = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED
INVALID_PARAM1: int = mavlink.MAV_MISSION_INVALID_PARAM1
"""INVALID_PARAM2 to 7 follow it."""

FRAME_GLOBAL, FRAME_MISSION, FRAME_RELATIVE, FRAME_GLOBAL_INT, FRAME_RELATIVE_INT = 0, 2, 3, 5, 6
KEPT_FRAME = {0: FRAME_GLOBAL_INT, 3: FRAME_RELATIVE_INT, 5: FRAME_GLOBAL_INT, 6: FRAME_RELATIVE_INT, 2: FRAME_MISSION}
"""Frames that are taken, and the one that each is kept in."""
FLOAT_FRAME = {FRAME_GLOBAL_INT: FRAME_GLOBAL, FRAME_RELATIVE_INT: FRAME_RELATIVE}

NAVIGATION = frozenset({16, 17, 19, 21, 22, 31, 80, 84, 85, 195})
"""Commands with a place: taken in global frames."""
MISSION_FRAME = frozenset({80, 179, 187, 189, 200, 203, 204, 205, 1000, 1001})
"""Commands taken in MAV_FRAME_MISSION."""
UNUSED_PARAMS: dict[int, tuple[int, ...]] = {
    16: (3,),
    17: (1, 2),
    20: (1, 2, 3, 4, 5, 6, 7),
    21: (3,),
    22: (2, 3),
    31: (3,),
    93: (5, 6, 7),
    112: (2, 3, 4, 5, 6, 7),
    114: (2, 3, 4, 5, 6, 7),
    176: (4, 5, 6, 7),
    177: (3, 4, 5, 6, 7),
    178: (4, 5, 6, 7),
    195: (2, 3, 4),
    196: (2, 3, 4, 5, 6, 7),
    197: (2, 3, 4, 5, 6, 7),
    201: (3, 4, 5, 6),
    206: (4, 5, 6, 7),
    211: (3, 4, 5, 6, 7),
    212: (3, 4, 5, 6, 7),
    214: (3, 4, 5, 6, 7),
    400: (3, 4, 5, 6, 7),
    420: (4, 5, 6, 7),
    530: (3, 4, 5, 6, 7),
    532: (3, 4, 5, 6, 7),
    534: (4, 5, 6, 7),
    611: (1, 2, 3, 4, 5, 6, 7),
    2000: (5, 6, 7),
    2001: (2, 3, 4, 5, 6, 7),
    2003: (4, 5, 6, 7),
    2500: (4, 5, 6, 7),
    2501: (2, 3, 4, 5, 6, 7),
    3000: (3, 4, 5, 6, 7),
    4501: (3, 4, 5, 6),
    5001: (3, 4, 7),
    5002: (3, 4, 7),
    5003: (3, 4, 7),
    5004: (3, 4, 7),
    42600: (5, 6, 7),
}
"""Parameters of a command that must be 0 or NaN: PX4 v1.18 refuses an item that sets them."""
WITHOUT_PLACE = frozenset(UNUSED_PARAMS) - NAVIGATION - {5001, 5002, 5003, 5004}
"""Commands that are taken in every frame."""
FENCE_ZONES = frozenset({5001, 5002, 5003, 5004})
POLYGONS = frozenset({5001, 5002})
SMALLEST_POLYGON = 3
RALLY_POINT = 5100
LOITER_TIME = 19


def parse(message: Any, kind: int) -> tuple[MissionItem | None, int]:
    """The item of a MISSION_ITEM or MISSION_ITEM_INT, or None and the MAV_MISSION_RESULT that refuses it."""
    frame, command = message.frame, message.command
    if frame not in KEPT_FRAME:
        return None, UNSUPPORTED_FRAME
    error = _refusal(message, kind, frame, command)
    if error != ACCEPTED:
        return None, error
    is_float = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM
    if is_float and frame in (FRAME_GLOBAL_INT, FRAME_RELATIVE_INT):
        return None, UNSUPPORTED_FRAME
    x, y = (_degrees_e7(message.x), _degrees_e7(message.y)) if is_float else (message.x, message.y)
    param2, param4 = message.param2, message.param4
    if command == LOITER_TIME:
        param2, param4 = float(param2 > 0.0), float(param4 > 0.0)
    item = MissionItem(
        message.seq,
        FRAME_GLOBAL_INT if kind == FENCE else KEPT_FRAME[frame],
        command,
        0 if kind == FENCE else message.autocontinue,
        message.param1,
        param2,
        message.param3,
        param4,
        x,
        y,
        message.z,
    )
    return item, ACCEPTED


def float_position(item: MissionItem) -> tuple[float, float, float]:
    """x, y, z as MISSION_ITEM has them: degrees in global frames."""
    if item.frame == FRAME_MISSION:
        return float(item.x), float(item.y), item.z
    return item.lat_deg, item.lon_deg, item.z


def _refusal(message: Any, kind: int, frame: int, command: int) -> int:
    """MAV_MISSION_RESULT of an item's frame, command and parameters; ACCEPTED if nothing is wrong."""
    in_global = frame != FRAME_MISSION
    if kind == RALLY:
        return ACCEPTED if in_global else UNSUPPORTED
    if kind == FENCE or command in FENCE_ZONES:
        error = _unused_set(message, command)
        if error == ACCEPTED and (kind != FENCE or not in_global or _is_too_small(message, command)):
            return ERROR
        return error
    if command == RALLY_POINT and in_global:
        return ERROR
    if command in WITHOUT_PLACE or command in (NAVIGATION if in_global else MISSION_FRAME):
        return _unused_set(message, command)
    return UNSUPPORTED


def _unused_set(message: Any, command: int) -> int:
    values = (message.param1, message.param2, message.param3, message.param4, message.x, message.y, message.z)
    for number in UNUSED_PARAMS.get(command, ()):
        value = values[number - 1]
        if value != 0 and not math.isnan(value):
            return INVALID_PARAM1 + number - 1
    return ACCEPTED


def _is_too_small(message: Any, command: int) -> bool:
    return command in POLYGONS and message.param1 < SMALLEST_POLYGON


def _degrees_e7(value: float) -> int:
    return round(value * 1e7) if math.isfinite(value) else 0
