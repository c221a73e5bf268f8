"""Parameter metadata (COMP_METADATA_TYPE_PARAMETER): type, default, bounds, unit and group from PX4's table.

What a parameter is and its codes mean, where it is said: parameter_texts.py, parameter_codes.py.
"""

from typing import Any

from autopilot import parameters
from autopilot.mavlink.component_metadata import parameter_codes, parameter_texts

VERSION = 1
"""QGroundControl takes no other (CompInfoParam.cc), though the newest schema wants 3; nothing else differs."""
NUMBERS = ("min", "max", "increment", "decimalPlaces", "units", "category", "rebootRequired", "volatile")
TYPES = {"INT32": "Int32", "REAL32": "Float"}


def content() -> dict[str, Any]:
    """Every parameter of this PX4, announced or not, in alphabetical order."""
    return {"version": VERSION, "parameters": [_entry(name, row) for name, row in parameters.table().items()]}


def _entry(name: str, row: dict[str, Any]) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": name, "type": TYPES[row["type"]], "default": row["default"], "group": row["group"]}
    entry |= {key: row[key] for key in NUMBERS if key in row}
    if text := parameter_texts.short(name):
        entry["shortDesc"] = text
    if codes := row.get("values"):
        meanings = parameter_codes.values(name)
        if all(code in meanings for code in codes):
            entry["values"] = [{"value": code, "description": meanings[code]} for code in codes]
    if bits := row.get("bits"):
        meanings = parameter_codes.bits(name)
        if all(bit in meanings for bit in bits):
            entry["bitmask"] = [{"index": bit, "description": meanings[bit]} for bit in bits]
    return entry
