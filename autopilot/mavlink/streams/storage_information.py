"""STORAGE_INFORMATION: the disk that logs are written to (PX4: streams/STORAGE_INFORMATION.hpp)."""

import math
import shutil
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION
NOT_AVAILABLE: Final = 0
READY: Final = 2
BYTES_PER_MIB: Final = 1 << 20


def fields(now_us: int, context: Context) -> Fields:
    """The only storage: capacities in MiB, and READY if there is one."""
    if context.root is None:
        return (now_us // 1000, 0.0, 0.0, 0.0, 0.0, 0.0, 1, 0, NOT_AVAILABLE, 0, b"", 0)
    disk = shutil.disk_usage(context.root)
    total, free = disk.total / BYTES_PER_MIB, disk.free / BYTES_PER_MIB
    return (now_us // 1000, total, total - free, free, 0.0, 0.0, 1, 1, READY, 0, b"", 0)


def requested(now_us: int, context: Context, param2: float) -> list[Fields] | None:
    """Storage `param2`: there is number 1, which 0 (all) means too."""
    known = math.isfinite(param2) and math.floor(param2 + 0.5) in (0, 1)
    return [fields(now_us, context)] if known else None
