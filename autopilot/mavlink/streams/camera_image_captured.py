"""CAMERA_IMAGE_CAPTURED: where the vehicle was when it asked for an image (PX4: streams/CAMERA_IMAGE_CAPTURED.hpp).

The camera tells its own, as component 100.
"""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED
CAPTURED: Final = 1


def stamp(now_us: int, context: Context) -> int:
    """Once per image."""
    return context.topics.camera_capture.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the first image; a place that is not known is 0."""
    capture = context.topics.camera_capture
    if not capture.timestamp:
        return None
    place = (capture.lat * 1e7, capture.lon * 1e7, capture.alt * 1e3, capture.ground_distance * 1e3)
    lat, lon, alt, ground = (round(value) if math.isfinite(value) else 0 for value in place)
    utc_us = context.boot_unix_us + capture.timestamp
    return (utc_us, capture.timestamp // 1000, lat, lon, alt, ground, *capture.q, capture.seq, 0, CAPTURED, b"")
