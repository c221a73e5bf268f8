"""A topic's record as text, field by field (PX4: orb_print_message_internal in uORB.cpp)."""

import math
import struct
from collections.abc import Iterator, Sequence
from typing import Any

from sitl_emu.core.attitude import euler
from sitl_emu.core.c_types import STRUCT_CODES

BUSES = ("UNKNOWN", "I2C", "SPI", "UAVCAN", "SIMULATION", "SERIAL", "MAVLINK")
"""Lowest three bits of a device id."""
INDENT, TOPIC_INDENT = "    ", "  "
ALIGNED_BYTES = 8
SIZES = {kind: struct.calcsize(code) for kind, code in STRUCT_CODES.items()}
QUATERNION = ("float", 4)


Field = tuple[str, str, Any]
"""C type of one element, name, and value: a number, a tuple of numbers, or a list of fields, if the type is a topic."""


def lines(fields: Sequence[Field], now_us: int) -> Iterator[str]:
    """A line a field; times are followed by their age, flags by their bits, quaternions by their angles.

    PX4 ends a line for what it leaves out, too: an empty one follows texts, and what fills a struct up to 8 bytes.
    """
    size = 0
    timestamp = next((value for _, name, value in fields if name == "timestamp"), 0)
    for kind, name, value in fields:
        if isinstance(value, list):
            if size % ALIGNED_BYTES:
                yield "\n"
            size = 0  # a topic is aligned itself
            yield f"{TOPIC_INDENT}{name} ({kind}):\n"
            yield from lines(value, now_us)
            continue
        size += SIZES.get(kind, ALIGNED_BYTES) * (len(value) if isinstance(value, tuple) else 1)
        if kind == "char" and isinstance(value, tuple):
            text = b"".join(value).partition(b"\0")[0].decode(errors="replace")
            yield f'{INDENT}{name}: "{text}"\n\n'
        elif isinstance(value, tuple):
            numbers = ", ".join(_text(kind, part) for part in value)
            angles = f" ({_angles(value)})" if _is_quaternion(kind, name, value) else ""
            yield f"{INDENT}{name}: [{numbers}]{angles}\n"
        else:
            yield f"{INDENT}{name}: {_text(kind, value)}{_remark(kind, name, value, timestamp, now_us)}\n"
    if size % ALIGNED_BYTES:
        yield "\n"


def fields_of(record: Any) -> list[Field]:
    """The fields of one of our records, for a topic of which PX4's are not known."""
    return [_own_field(name, value) for name, value in zip(record._fields, record, strict=True)]


def _own_field(name: str, value: Any) -> Field:
    if hasattr(value, "_fields"):
        return type(value).__name__, name, fields_of(value)
    first = value[0] if isinstance(value, tuple) and value else value
    kind = "bool" if isinstance(first, bool) else "uint64_t" if isinstance(first, int) else "float"
    return kind if isinstance(first, int | float) else "", name, value


def _text(kind: str, value: Any) -> str:
    if kind == "float":
        return f"{value:.5f}"
    if kind == "double":
        return f"{value:.6f}"
    return str(bool(value)) if kind == "bool" else str(int(value)) if kind else str(value)


def _remark(kind: str, name: str, value: Any, timestamp: int, now_us: int) -> str:
    if name == "timestamp":
        return f" ({(now_us - value) * 1e-6:.6f} seconds ago)" if value else ""
    if name == "timestamp_sample":
        return f" ({timestamp - value} us before timestamp)" if timestamp and value else ""
    if "flags" in name and kind.startswith("uint") and value:
        return f" (0b{value:_b})".replace("_", "'")
    if name.endswith("device_id") and kind == "uint32_t":
        bus_type, bus, address, device_type = value & 7, value >> 3 & 31, value >> 8 & 255, value >> 16 & 255
        name_of_bus = BUSES[bus_type] if bus_type < len(BUSES) else BUSES[0]
        return f" (Type: 0x{device_type:02X}, {name_of_bus}:{bus} (0x{address:02X}))"
    return ""


def _is_quaternion(kind: str, name: str, value: Sequence[float]) -> bool:
    return (kind, len(value)) == QUATERNION and (name == "q" or name.startswith("q_"))


def _angles(q: Sequence[float]) -> str:
    w, x, y, z = q
    angles = zip(("Roll", "Pitch", "Yaw"), euler((w, x, y, z)), strict=True)
    return ", ".join(f"{name}: {math.degrees(angle):.1f} deg" for name, angle in angles)
