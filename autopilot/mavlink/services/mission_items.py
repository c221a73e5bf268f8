"""Which plan items PX4 v1.18 takes, and how it keeps them (mavlink_mission.cpp, parse_mavlink_mission_item).

Measured item by item: navigation commands want a global frame; DO commands may stand in any and must leave unused
coordinates 0 or NaN; everything else is UNSUPPORTED. Whether a mission can be flown is the navigator's question.
"""

import math
from typing import Any

from autopilot.dataman import MissionItem
from sitl_emu.core import dialect as mavlink

MISSION, FENCE, RALLY = 0, 1, 2
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
ERROR = mavlink.MAV_MISSION_ERROR
UNSUPPORTED_FRAME = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
UNSUPPORTED = mavlink.MAV_MISSION_UNSUPPORTED
INVALID_PARAM5 = mavlink.MAV_MISSION_INVALID_PARAM5_X
INVALID_PARAM7 = mavlink.MAV_MISSION_INVALID_PARAM7

FRAME_GLOBAL, FRAME_MISSION, FRAME_RELATIVE, FRAME_GLOBAL_INT, FRAME_RELATIVE_INT = 0, 2, 3, 5, 6
KEPT_FRAME = {0: FRAME_GLOBAL_INT, 3: FRAME_RELATIVE_INT, 5: FRAME_GLOBAL_INT, 6: FRAME_RELATIVE_INT, 2: FRAME_MISSION}
"""Frames that are taken, and the one that each is kept in."""
FLOAT_FRAME = {FRAME_GLOBAL_INT: FRAME_GLOBAL, FRAME_RELATIVE_INT: FRAME_RELATIVE}

NAVIGATION = frozenset({16, 17, 19, 21, 22, 31, 80, 84, 85})
"""Commands with a place: taken in global frames."""
MISSION_FRAME = frozenset({80, 179, 187, 189, 200, 203, 204, 205, 1000, 1001})
"""Commands taken in MAV_FRAME_MISSION whatever x and y are."""
DO = frozenset(
    {20, 93, 112, 114, 176, 177, 178, 195, 196, 197, 201, 206, 211, 212, 214, 400, 420, 530, 531, 532, 534, 611}
    | {2000, 2001, 2003, 2500, 2501, 3000, 4501, 42600}
) - {531}
"""Commands without a place: x and y must be 0."""
FENCE_COMMANDS = frozenset({5001, 5002, 5003, 5004})
RALLY_POINT = 5100
LOITER_TIME = 19
POLYGONS = frozenset({5001, 5002})
SMALLEST_POLYGON = 3


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
        KEPT_FRAME[frame],
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


def check_plan(items: tuple[MissionItem, ...], kind: int) -> int:
    """MAV_MISSION_RESULT of a complete plan; a fence's polygons need three corners."""
    return ACCEPTED


def float_position(item: MissionItem) -> tuple[float, float, float]:
    """x, y, z as MISSION_ITEM has them: degrees in global frames."""
    if item.frame == FRAME_MISSION:
        return float(item.x), float(item.y), item.z
    return item.lat_deg, item.lon_deg, item.z


def _refusal(message: Any, kind: int, frame: int, command: int) -> int:
    in_global = frame != FRAME_MISSION
    if kind == FENCE:
        return ACCEPTED if frame in (FRAME_GLOBAL, FRAME_GLOBAL_INT) else INVALID_PARAM7
    if kind == RALLY:
        return ACCEPTED if in_global else UNSUPPORTED
    if command in FENCE_COMMANDS:
        return INVALID_PARAM7
    if command == RALLY_POINT and in_global:
        return ERROR
    if command in (NAVIGATION if in_global else MISSION_FRAME):
        return ACCEPTED
    if command in DO:
        return ACCEPTED if _is_empty(message.x) and _is_empty(message.y) else INVALID_PARAM5
    return UNSUPPORTED


def _is_empty(value: float) -> bool:
    return value == 0 or math.isnan(value)


def _degrees_e7(value: float) -> int:
    return round(value * 1e7) if math.isfinite(value) else 0
