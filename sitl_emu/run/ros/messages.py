"""ROS 2's own messages: their fields, their bytes on the wire, and their hashes.

`messages.json` is made from their definitions by tools/make_ros_messages.py and says from which commits; they are those
of ROS 2 Jazzy. A message is a mapping from the names of its fields to values: numbers, strings, sequences of these,
mappings of messages within, and bytes for uint8[].
"""

import functools
import hashlib
import json
import pathlib
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

CODES = {
    "bool": "?",
    "float32": "f",
    "float64": "d",
    **{f"int{bits}": code for bits, code in zip((8, 16, 32, 64), "bhiq", strict=True)},
    **{f"uint{bits}": code for bits, code in zip((8, 16, 32, 64), "BHIQ", strict=True)},
}
TYPE_IDS = {
    **{f"{sign}int{8 << size}": 2 + 2 * size + place for size in range(4) for place, sign in enumerate(("", "u"))},
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "string": 17,
}
"""type_description_interfaces/FieldType; NESTED is 1."""
ARRAY, UNBOUNDED_SEQUENCE = 48, 144
"""What is added to these."""
ONE, SEQUENCE = 1, 0


class Field(NamedTuple):
    """A field of a message."""

    kind: str
    length: int
    """ONE, SEQUENCE (of any length), or that of an array."""
    name: str


def _field(text: str) -> Field:
    kind, name = text.split()
    kind, many, length = kind.partition("[")
    if not many:
        return Field(kind, ONE, name)
    return Field(kind, int(length.rstrip("]") or SEQUENCE), name)


_TABLE = json.loads(pathlib.Path(__file__).with_name("messages.json").read_text())
SOURCE: tuple[str, ...] = tuple(_TABLE["source"])
"""Repositories and commits."""
MESSAGES: Mapping[str, tuple[Field, ...]] = {
    name: tuple(_field(text) for text in fields.split("; ")) for name, fields in _TABLE["messages"].items()
}


def dds_type(message: str) -> str:
    """The name of a message's DDS type, of "sensor_msgs/Image" say, as cyclonedds-python writes it (:: as a dot)."""
    package, name = message.split("/")
    return f"{package}.msg.dds_.{name}_"


def written(message: str, values: Mapping[str, Any]) -> bytes:
    """A message in CDR, little endian, without CDR's header.

    Raises KeyError where a field is not given, ValueError or struct.error where its value is not of its type.
    """
    data = bytearray()
    _write(data, message, values)
    return bytes(data)


def _write(data: bytearray, message: str, values: Mapping[str, Any]) -> None:
    for kind, length, name in MESSAGES[message]:
        value = values[name]
        if length == ONE:
            _write_one(data, kind, value)
            continue
        if length == SEQUENCE:
            _write_one(data, "uint32", len(value))
        elif len(value) != length:
            raise ValueError(f"{message}.{name}: {len(value)} values, not {length}")
        if kind == "uint8" and isinstance(value, bytes):
            data += value
        elif kind in CODES:
            code = CODES[kind]
            if len(value):
                _align(data, struct.calcsize(f"<{code}"))
            data += struct.pack(f"<{len(value)}{code}", *value)
        else:
            for each in value:
                _write_one(data, kind, each)


def _write_one(data: bytearray, kind: str, value: Any) -> None:
    if kind == "string":
        text = value.encode() + b"\0"
        _write_one(data, "uint32", len(text))
        data += text
    elif kind in CODES:
        _align(data, struct.calcsize(f"<{CODES[kind]}"))
        data += struct.pack(f"<{CODES[kind]}", value)
    else:
        _write(data, kind, value)


def _align(data: bytearray, size: int) -> None:
    data += bytes(-len(data) % size)


def stamp(time_us: int) -> dict[str, int]:
    """A time since 1970 as builtin_interfaces/Time."""
    seconds, rest_us = divmod(time_us, 1_000_000)
    return {"sec": seconds, "nanosec": rest_us * 1000}


@functools.cache
def type_hash(message: str) -> str:
    """By which ROS 2 tells versions of a message's type apart (REP 2016, RIHS01)."""
    within = sorted(_within(message))
    described = {
        "type_description": _described(message),
        "referenced_type_descriptions": [_described(each) for each in within],
    }
    return f"RIHS01_{hashlib.sha256(json.dumps(described).encode()).hexdigest()}"


def _within(message: str) -> set[str]:
    direct = {field.kind for field in MESSAGES[message] if field.kind in MESSAGES}
    return direct.union(*map(_within, direct))


def _described(message: str) -> dict[str, Any]:
    return {"type_name": _type_name(message), "fields": [_described_field(field) for field in MESSAGES[message]]}


def _described_field(field: Field) -> dict[str, Any]:
    nested = field.kind in MESSAGES
    more = {ONE: 0, SEQUENCE: UNBOUNDED_SEQUENCE}.get(field.length, ARRAY)
    return {
        "name": field.name,
        "type": {
            "type_id": (1 if nested else TYPE_IDS[field.kind]) + more,
            "capacity": field.length if more == ARRAY else 0,
            "string_capacity": 0,
            "nested_type_name": _type_name(field.kind) if nested else "",
        },
    }


def _type_name(message: str) -> str:
    package, name = message.split("/")
    return f"{package}/msg/{name}"
