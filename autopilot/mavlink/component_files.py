"""The files that describe this vehicle to a ground station (https://mavlink.io/en/services/component_information.html).

`component_general.json.xz` lists them; parameters are described by what parameters.json knows: type, default, bounds,
unit, group. Prose and the events' metadata are left out.
"""

import functools
import json
import lzma
import zlib
from typing import Any, NamedTuple

from autopilot import parameters

GENERAL_URI = "mftp://etc/extras/component_general.json.xz"
PARAMETERS_URI = "mftp://etc/extras/parameters.json.xz"
METADATA_PARAMETER = 1
"""COMP_METADATA_TYPE_PARAMETER."""
SCHEME = "mftp://"


class File(NamedTuple):
    """A compressed file and the CRC-32 of its content on the wire."""

    content: bytes
    crc32: int


@functools.cache
def general() -> File:
    """The list of metadata files."""
    parameter_file = parameter_metadata()
    entry = {"type": METADATA_PARAMETER, "uri": PARAMETERS_URI, "fileCrc": parameter_file.crc32}
    return _file({"version": 1, "metadataTypes": [entry]})


@functools.cache
def parameter_metadata() -> File:
    """Metadata of all parameters, schema version 1."""
    rows = [_parameter(name, row) for name, row in parameters.table().items()]
    return _file({"version": 1, "parameters": rows})


def tree() -> dict[str, bytes]:
    """Files by the path under which FTP serves them."""
    files = {GENERAL_URI: general(), PARAMETERS_URI: parameter_metadata()}
    return {uri.removeprefix(SCHEME): file.content for uri, file in files.items()}


def _parameter(name: str, row: dict[str, Any]) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "name": name,
        "type": "Float" if row["type"] == "REAL32" else "Int32",
        "default": row["default"],
        "group": row.get("group", ""),
    }
    names = {"min": "min", "max": "max", "unit": "units", "decimalPlaces": "decimalPlaces", "increment": "increment"}
    entry |= {ours: row[theirs] for theirs, ours in names.items() if theirs in row}
    entry |= {key: row[key] for key in ("category", "rebootRequired", "volatile") if key in row}
    return entry


def _file(content: dict[str, Any]) -> File:
    data = lzma.compress(json.dumps(content, separators=(",", ":")).encode(), format=lzma.FORMAT_XZ, preset=6)
    return File(data, zlib.crc32(data))
