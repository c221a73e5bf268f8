"""CAMERA_IMAGE_CAPTURED: where the vehicle was when it asked for an image (PX4: streams/CAMERA_IMAGE_CAPTURED.hpp).

The camera tells its own, as component 100.
"""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED
CAMERA: Final = 1
CAPTURED: Final = 1


def stamp(now_us: int, context: Context) -> int:
    """Once per image."""
    return context.topics.camera_capture.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Nothing before the first image. 1e-7 deg, mm."""
    capture = context.topics.camera_capture
    if not capture.timestamp:
        return None
    utc_us = context.boot_unix_us + capture.timestamp
    return (
        utc_us,
        capture.timestamp // 1000,
        truncated(capture.lat * 1e7),
        truncated(capture.lon * 1e7),
        truncated(product(capture.alt, 1e3)),
        truncated(product(capture.ground_distance, 1e3)),
        *capture.q,
        capture.seq,
        CAMERA,
        CAPTURED,
        b"",
    )
