"""The metadata as files, compressed, and the general one that lists the others."""

import functools
import json
import lzma
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from sitl_emu.autopilot.mavlink.component_metadata import actuators, events, parameter

FOLDER = "etc/extras"
GENERAL = "component_general.json.xz"
EVENTS = 4
TYPES = {
    1: ("parameters.json.xz", parameter.content),
    EVENTS: ("all_events.json.xz", events.content),
    5: ("actuators.json.xz", actuators.content),
}
"""COMP_METADATA_TYPE: parameter, events, actuators."""
COMPRESSION = 0
"""Of xz, its fastest: the files are made while the vehicle flies."""
WHO = {"vendorName": "sitl-emu", "modelName": "PX4 v1.18, emulated", "firmwareVersion": "1.18.0"}


class File(NamedTuple):
    """A compressed file and its CRCs, by MAVLink's CRC-32: zero at first, no inversion at the end."""

    compressed: bytes
    crc32: int
    """What the general file tells of this one: of the compressed bytes (PX4's generate_component_general.py)."""
    json_crc32: int
    """What COMPONENT_METADATA tells of the general file: of its JSON before it was compressed (generate_crc.py)."""


@functools.cache
def general() -> File:
    """The list of the other files."""
    entries = [
        {"type": number, "uri": uri(name), "fileCrc": _file(number).crc32} for number, (name, _) in TYPES.items()
    ]
    return _compressed({"version": 1, **WHO, "metadataTypes": entries})


def tree() -> Mapping[str, bytes]:
    """All files by the path under which FTP serves them."""
    files = {GENERAL: general()} | {name: _file(number) for number, (name, _) in TYPES.items()}
    return {f"{FOLDER}/{name}": file.compressed for name, file in files.items()}


def event_definitions() -> bytes:
    """The compressed file of all events."""
    return _file(EVENTS).compressed


def uri(name: str) -> str:
    """Where a ground station finds a file."""
    return f"mftp://{FOLDER}/{name}"


@functools.cache
def _file(number: int) -> File:
    return _compressed(TYPES[number][1]())


def _compressed(content: dict[str, Any]) -> File:
    data = json.dumps(content, separators=(",", ":")).encode()
    compressed = lzma.compress(data, preset=COMPRESSION)
    return File(compressed, _crc32(compressed), _crc32(data))


def _crc32(data: bytes) -> int:
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
