"""How messages lie on the wire: CDR of the first version, little endian, as PX4's client writes and reads it.

Every value stands at a multiple of its size, in the order of the definition, messages within messages as if their
fields were the message's own (Tools/msg/templates/ucdr/msg.h.em). All of PX4's messages are of fixed length.
"""

import functools
import itertools
import struct
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

from sitl_emu.autopilot.logger import packing
from sitl_emu.autopilot.logger.ulog import array_length
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES
from sitl_emu.core.c_types import STRUCT_CODES

HEADER: Final = b"\0\1\0\0"
"""Before every sample: plain CDR, little endian, no options (RTPS 2.5, 10.2)."""
CODES = {
    "float32": "f",
    "float64": "d",
    "bool": "?",
    "char": "c",
    **{f"int{bits}": code for bits, code in zip((8, 16, 32, 64), "bhiq", strict=True)},
    **{f"uint{bits}": code for bits, code in zip((8, 16, 32, 64), "BHIQ", strict=True)},
}


class Place(NamedTuple):
    """Where a built-in field lies; `path` names it through the messages that it is in ("current.lat")."""

    path: str
    code: str
    """Of struct."""
    length: int
    offset: int
    size: int
    """Of the whole array."""


@functools.cache
def places(message: str) -> tuple[Place, ...]:
    """Of all fields of a message, on the wire."""
    found, offset = list[Place](), 0
    for path, kind, length in _flat(message, ""):
        code = CODES[kind]
        size = struct.calcsize(f"<{code}")
        offset += -offset % size
        found.append(Place(path, code, length, offset, size * length))
        offset += size * length
    return tuple(found)


@functools.cache
def size(message: str) -> int:
    """Bytes of a message on the wire, without the header."""
    last = places(message)[-1]
    return last.offset + last.size


def _flat(message: str, prefix: str) -> Iterator[tuple[str, str, int]]:
    for kind, length, name in MESSAGES[message].fields:
        if kind in CODES:
            yield prefix + name, kind, length
            continue
        for number in range(length):
            index = f"[{number}]" if length > 1 else ""
            yield from _flat(kind, f"{prefix}{name}{index}.")


def log_places(topic: str) -> dict[str, Place]:
    """Of all fields of a topic in the logger's data, by path."""
    found, offset = dict[str, Place](), 0
    for path, kind, length in _log_flat(topic, ""):
        code = STRUCT_CODES[kind]
        field_bytes = struct.calcsize(f"<{code}") * length
        found[path] = Place(path, code, length, offset, field_bytes)
        offset += field_bytes
    return found


def _log_flat(topic: str, prefix: str) -> Iterator[tuple[str, str, int]]:
    for kind, name in packing.FORMATS[topic]:
        base, length = array_length(kind)
        if base not in packing.FORMATS:
            yield prefix + name, base, length
            continue
        for number in range(length):
            index = f"[{number}]" if length > 1 else ""
            yield from _log_flat(base, f"{prefix}{name}{index}.")


def from_log(message: str, topic: str) -> Callable[[bytes], bytes]:
    """What turns the logger's data of a topic into a message on the wire, without the header.

    The values are the same, little endian on both sides; their order and the gaps between them are not. Raises KeyError
    where the logger does not know a field.
    """
    theirs = log_places(topic)
    order = [theirs[place.path] for place in places(message)]
    ranks = sorted(range(len(order)), key=lambda rank: order[rank].offset)
    read = struct.Struct("<" + "".join(f"{order[rank].size}s" for rank in ranks))
    place_in_read = {rank: position for position, rank in enumerate(ranks)}
    write = struct.Struct("<" + "".join(_with_gaps(message)))
    picked = [place_in_read[rank] for rank in range(len(order))]

    def rearranged(data: bytes) -> bytes:
        values = read.unpack(data)
        return write.pack(*[values[position] for position in picked])

    return rearranged


def stamps(message: str) -> tuple[int, ...]:
    """Offsets of the times that PX4's client moves to the clock of DDS's side: those of the message itself."""
    return tuple(each.offset for each in places(message) if each.path in ("timestamp", "timestamp_sample"))


def _with_gaps(message: str) -> Iterator[str]:
    end = 0
    for place in places(message):
        yield f"{place.offset - end}x{place.size}s"
        end = place.offset + place.size


class Reader:
    """Reads a message from the wire into a dictionary of its fields by path; arrays are tuples, char arrays bytes."""

    def __init__(self, message: str) -> None:
        self.size = size(message)
        self._fields: tuple[tuple[str, int, bool], ...] = tuple(
            (each.path, each.length, each.code == "c") for each in places(message)
        )
        self._struct = _struct(message)

    def read(self, data: bytes) -> dict[str, Any]:
        """The fields of `data`, which has at least `size` bytes."""
        values = iter(self._struct.unpack_from(data))
        return {
            path: next(values) if text or length == 1 else tuple(itertools.islice(values, length))
            for path, length, text in self._fields
        }


def _struct(message: str) -> struct.Struct:
    codes, end = [], 0
    for each in places(message):
        codes.append(f"{each.offset - end}x" + (f"{each.size}s" if each.code == "c" else each.code * each.length))
        end = each.offset + each.size
    return struct.Struct("<" + "".join(codes))


class Packer:
    """Writes a message from all its values, in the order of its definition; arrays flattened, char arrays as bytes."""

    def __init__(self, message: str) -> None:
        self.pack = _struct(message).pack


class Writer:
    """Writes a message from some of its fields by path: the other half of Reader."""

    def __init__(self, message: str) -> None:
        self._places = places(message)
        self._size = size(message)

    def write(self, **fields: Any) -> bytes:
        """The message on the wire, without the header; fields that are not given are 0. Raises KeyError on others."""
        data, known = bytearray(self._size), {place.path: place for place in self._places}
        for name, value in fields.items():
            place = known[name]
            if place.code == "c":
                struct.pack_into(f"<{place.size}s", data, place.offset, value)
            else:
                values = value if place.length > 1 else (value,)
                struct.pack_into(f"<{place.length}{place.code}", data, place.offset, *values)
        return bytes(data)
