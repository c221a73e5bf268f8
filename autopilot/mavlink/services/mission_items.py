"""Which plan items PX4 v1.18 takes, and what it keeps of them (mavlink_mission.cpp).

A command is taken in global frames or in MAV_FRAME_MISSION, ROI ones in both. Parameters that PX4 does not use must be
0 or NaN, unused x and y of a MISSION_ITEM_INT INT32_MAX or INT32_MIN (in MAV_FRAME_MISSION also 0); this is looked at
first. Whether a mission can be flown is the navigator's question.

PX4 keeps x and y of MAV_FRAME_MISSION as float32, so that INT32_MAX comes back as INT32_MIN, and headings, jumps and
counts of vertices in its own types; so do we.
"""

import math
import struct
from typing import Any

from sitl_emu.autopilot.commands.table import COMMANDS, P1, P5, P6, P1234, UNKNOWN, items_where
from sitl_emu.autopilot.mavlink.command_params import used_params
from sitl_emu.autopilot.storage.dataman import FENCE, MISSION, MissionItem
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, integer, product, rounded

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

LOITER_TIME: int = mavlink.MAV_CMD_NAV_LOITER_TIME
LOITER_TO_ALT: int = mavlink.MAV_CMD_NAV_LOITER_TO_ALT
NAV_ROI: int = mavlink.MAV_CMD_NAV_ROI
SET_ROI: int = mavlink.MAV_CMD_DO_SET_ROI
LAND: int = mavlink.MAV_CMD_NAV_LAND
DO_JUMP: int = mavlink.MAV_CMD_DO_JUMP
STORED_AS = {NAV_ROI: SET_ROI, mavlink.MAV_CMD_CONDITION_DELAY: mavlink.MAV_CMD_NAV_DELAY}
"""Commands that become another one, which also comes back."""
ROI_NONE, ROI_LOCATION = 0, 3
ROI_IN_MISSION_FRAME = (ROI_NONE, 1, 2)
POLYGONS = frozenset(
    (mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION)
)
SMALLEST_POLYGON = 3
TURN_RAD = float32(2.0 * math.pi)
RAD_PER_DEG, DEG_PER_RAD = float32(float32(math.pi) / 180.0), float32(180.0 / float32(math.pi))
KEPT_IN_FENCE = items_where(lambda item: item.plan == FENCE) | {mavlink.MAV_CMD_NAV_WAYPOINT, LOITER_TIME, LAND}
"""A fence keeps one parameter, where a circle has its radius; these commands come back with it."""
NOT_GIVEN = (0x7FFFFFFF, -0x80000000)
CRC_LAYOUT = {False: struct.Struct("<BHB4fiif"), True: struct.Struct("<BHB7f")}


def parse(message: Any, kind: int, traits: Traits) -> tuple[MissionItem | None, int]:
    """The item of a MISSION_ITEM or MISSION_ITEM_INT, or None and the MAV_MISSION_RESULT that refuses it."""
    frame, command = message.frame, message.command
    is_float = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM
    if frame not in KEPT_FRAME or (is_float and frame in FLOAT_FRAME):
        return None, UNSUPPORTED_FRAME
    in_global = frame != FRAME_MISSION
    error = _unused_is_set(message, in_global and not is_float, traits) or _refusal(message, in_global)
    if error == ACCEPTED and (_is_of_other_plan(command, kind) or (kind == FENCE and _is_too_small(message))):
        error = ERROR
    if error != ACCEPTED:
        return None, error
    x, y = message.x, message.y
    is_fence = kind == FENCE
    if not in_global:
        x, y = (0, 0) if is_fence else (rounded(float32(x)), rounded(float32(y)))
    elif is_float:
        x, y = rounded(x * 1e7), rounded(y * 1e7)
    params = _kept_params(message, in_global, is_fence)
    return MissionItem(
        message.seq,
        FRAME_GLOBAL_INT if is_fence and in_global else KEPT_FRAME[frame],
        STORED_AS.get(command, command),
        0 if is_fence else message.autocontinue & 1,
        *params,
        x,
        y,
        message.z,
    ), ACCEPTED


def crc_bytes(message: Any) -> bytes:
    """What PX4's opaque id counts of an item: its fields as they came."""
    params = (message.param1, message.param2, message.param3, message.param4, message.x, message.y, message.z)
    layout = CRC_LAYOUT[message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM]
    return layout.pack(message.frame, message.command, message.autocontinue, *params)


def sent_params(item: MissionItem) -> tuple[float, float, float, float]:
    """The first four parameters as PX4 sends them back."""
    known = COMMANDS.get(item.command, UNKNOWN).item
    if known is not None and not known.comes_back and item.frame != FRAME_MISSION:
        return 0.0, 0.0, 0.0, 0.0
    return item.param1, item.param2, item.param3, item.param4


def float_position(item: MissionItem) -> tuple[float, float, float]:
    """x, y, z as MISSION_ITEM has them: degrees in global frames."""
    if item.frame == FRAME_MISSION:
        return float(item.x), float(item.y), item.z
    return item.lat_deg, item.lon_deg, item.z


def _unused_is_set(message: Any, is_global_int: bool, traits: Traits) -> int:
    """INVALID_PARAM of the first parameter that is set and not used; ACCEPTED (0) if there is none."""
    used = used_params(message.command, traits, in_plan=True)
    values = (message.param1, message.param2, message.param3, message.param4, message.x, message.y, message.z)
    for place, value in enumerate(values):
        if used >> place & 1 or math.isnan(value):
            continue
        is_int_place = 1 << place in (P5, P6) and isinstance(value, int)
        if is_int_place and value in NOT_GIVEN:
            continue
        if value != 0 or (is_int_place and is_global_int):
            return INVALID_PARAM1 + place
    return ACCEPTED


def _refusal(message: Any, in_global: bool) -> int:
    """Whether the command is taken in this kind of frame, and an ROI in this mode; ACCEPTED (0) if so."""
    command = message.command
    item = COMMANDS.get(command, UNKNOWN).item
    if item is None or not (item.keeps is not None if in_global else item.in_mission_frame):
        return UNSUPPORTED
    if command in (NAV_ROI, SET_ROI):
        modes = (ROI_LOCATION, ROI_NONE) if in_global else ROI_IN_MISSION_FRAME
        if not math.isfinite(message.param1) or int(message.param1) not in modes:
            return INVALID_PARAM1
    return ACCEPTED


def _is_of_other_plan(command: int, kind: int) -> bool:
    item = COMMANDS[command].item
    return kind == MISSION and item is not None and item.plan != MISSION


def _is_too_small(message: Any) -> bool:
    return message.command in POLYGONS and integer("H", message.param1 + 0.5) < SMALLEST_POLYGON


def _kept_params(message: Any, in_global: bool, is_fence: bool) -> tuple[float, float, float, float]:
    params = (message.param1, message.param2, message.param3, message.param4)
    command = message.command
    item = COMMANDS[command].item
    assert item is not None, "a command without an item is not taken"
    if is_fence:
        kept = P1 if command in KEPT_IN_FENCE or not in_global else 0
    else:
        kept = item.keeps if in_global and item.keeps is not None else P1234
    first, second, third, fourth = (value if kept >> place & 1 else 0.0 for place, value in enumerate(params))
    if command in POLYGONS:
        first = float(integer("H", first + 0.5))
    elif command == DO_JUMP:
        first, second = (0.0, 0.0) if is_fence else (float(integer("h", first)), float(integer("H", second)))
    elif command == LOITER_TIME:
        second, fourth = float(second > 0.0), float(fourth > 0.0)
    elif command == LOITER_TO_ALT:
        first, fourth = float(first > 0.0), float(fourth > 0.0)
    elif item.heading:
        second = float(integer("H", second)) if command == LAND else second
        fourth = _heading(fourth)
    return first, second, third, fourth


def _heading(degrees: float) -> float:
    """A heading within 0 and 360, as it comes back from the float32 in radians that PX4 keeps; NaN of what is none.

    So 1 degree is 0.9999999 (matrix::wrap_2pi, math::radians and math::degrees).
    """
    radians = product(degrees, RAD_PER_DEG)
    if not math.isfinite(radians):
        return math.nan
    if not 0.0 <= radians < TURN_RAD:
        turns = math.floor(product(radians, 1.0 / TURN_RAD))
        radians = float32(radians - product(TURN_RAD, turns))
    return product(radians, DEG_PER_RAD)
