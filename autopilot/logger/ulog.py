"""ULog, PX4's log format (https://docs.px4.io/main/en/dev_log/ulog_file_format): its messages as bytes.

Pure functions: each returns one whole message. A log is `file_header`, `FLAG_BITS`, definitions (formats, information,
parameters), then subscriptions, data, texts and sync marks in the order of time.
"""

import struct
from collections.abc import Mapping

from sitl_emu.core.c_types import STRUCT_CODES, Layout

Field = tuple[str, str]
"""ULog type and name of a field, as ("float[4]", "q")."""

MAGIC = b"ULog\x01\x12\x35"
FILE_VERSION = 1
HEADER = struct.Struct("<HB")
"""Of every message: bytes after this header, type."""
DATA_HEADER = struct.Struct("<HBH")
"""Of a data message: the header and the subscription's id."""
DEFAULT_PARAMETERS = 1
"""compat_flags[0]: the log holds defaults of parameters."""
DEFAULT_OF_SYSTEM, DEFAULT_OF_SETUP = 1, 2
"""parameter_default: default of the firmware, of the airframe."""
LONGEST_INFORMATION = 220
"""Bytes of one information message's text; PX4 splits longer ones likewise."""


def message(kind: str, payload: bytes) -> bytes:
    """One ULog message; `kind` is its type's letter."""
    return HEADER.pack(len(payload), ord(kind)) + payload


FLAG_BITS = message("B", struct.pack("<8B8B3Q", DEFAULT_PARAMETERS, *(0,) * 18))
SYNC = message("S", bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12)))
"""A mark by which a reader finds the next message in a damaged log."""


def file_header(now_us: int) -> bytes:
    """The first 16 bytes of a log that begins at `now_us`."""
    return MAGIC + struct.pack("<BQ", FILE_VERSION, now_us)


def format_definition(name: str, fields: tuple[Field, ...]) -> bytes:
    """Names and types of a topic's fields."""
    text = "".join(f"{kind} {field};" for kind, field in fields)
    return message("F", f"{name}:{text}".encode())


def information(name: str, value: str | int, kind: str = "int32_t") -> bytes:
    """A fact about the whole log; `kind` is a number's type."""
    key, packed = _information_value(name, value, kind)
    return message("I", bytes((len(key),)) + key + packed)


def information_multiple(name: str, value: str | bytes) -> bytes:
    """A text or bytes of any length as one entry of a list of such, split over several messages where it is long."""
    kind, encoded = ("char", value.encode()) if isinstance(value, str) else ("uint8_t", value)
    pieces = [encoded[n : n + LONGEST_INFORMATION] for n in range(0, len(encoded), LONGEST_INFORMATION)]
    parts = []
    for number, piece in enumerate(pieces):
        key = f"{kind}[{len(piece)}] {name}".encode()
        parts.append(message("M", bytes((number > 0, len(key))) + key + piece))
    return b"".join(parts)


def parameter(name: str, value: float | int, is_float: bool) -> bytes:
    """The value that a parameter has from here on."""
    key, packed = _parameter_value(name, value, is_float)
    return message("P", bytes((len(key),)) + key + packed)


def parameter_default(name: str, value: float | int, is_float: bool, of: int) -> bytes:
    """A parameter's default; `of` is DEFAULT_OF_SYSTEM, DEFAULT_OF_SETUP or both."""
    key, packed = _parameter_value(name, value, is_float)
    return message("Q", bytes((of, len(key))) + key + packed)


def subscription(message_id: int, name: str, multi_id: int = 0) -> bytes:
    """From here on, data with `message_id` is of this topic."""
    return message("A", struct.pack("<BH", multi_id, message_id) + name.encode())


def logged_message(severity: int, now_us: int, text: str) -> bytes:
    """A text; `severity` is 0 (emergency) to 7 (debug)."""
    return message("L", struct.pack("<BQ", ord("0") + severity, now_us) + text.encode())


def parse_fields(text: str) -> tuple[Field, ...]:
    """Fields of "uint64_t timestamp; float[4] q"."""
    pairs = (field.split() for field in text.split(";") if field.strip())
    return tuple((kind, name) for kind, name in pairs)


def data_header(size: int, message_id: int) -> bytes:
    """What every data message of a subscription begins with; `size` is that of the topic's data."""
    return DATA_HEADER.pack(DATA_HEADER.size - HEADER.size + size, ord("D"), message_id)


def array_length(kind: str) -> tuple[str, int]:
    """Type and length of "float[4]"; the length of a type without brackets is 1."""
    name, _, length = kind.partition("[")
    return name, int(length.rstrip("]")) if length else 1


def codes(fields: tuple[Field, ...], formats: Mapping[str, tuple[Field, ...]]) -> list[str]:
    """Codes of struct, one a value, of a topic's data; `formats` holds the types that fields may be of."""
    found = []
    for kind, _ in fields:
        name, length = array_length(kind)
        code = STRUCT_CODES.get(name)
        found += ([code] if code else codes(formats[name], formats)) * length
    return found


def _information_value(name: str, value: str | int, kind: str) -> tuple[bytes, bytes]:
    if isinstance(value, str):
        encoded = value.encode()
        return f"char[{len(encoded)}] {name}".encode(), encoded
    return f"{kind} {name}".encode(), Layout(STRUCT_CODES[kind]).pack(value)


def _parameter_value(name: str, value: float | int, is_float: bool) -> tuple[bytes, bytes]:
    if is_float:
        return f"float {name}".encode(), struct.pack("<f", value)
    return f"int32_t {name}".encode(), struct.pack("<i", int(value))
