"""Parameter metadata (COMP_METADATA_TYPE_PARAMETER): type, default, bounds, unit and group from PX4's table.

What a parameter is: parameter_texts.py and its folder `texts/`. What its codes mean: parameter_codes.py.
"""

from typing import Any

from sitl_emu.autopilot import parameters
from sitl_emu.autopilot.mavlink.component_metadata import parameter_codes, parameter_texts

VERSION = 1
"""QGroundControl takes no other (CompInfoParam.cc), though the newest schema wants 3; nothing else differs."""
NUMBERS = ("min", "max", "increment", "decimalPlaces", "units", "category", "rebootRequired", "volatile")
TYPES = {"INT32": "Int32", "REAL32": "Float"}


def content() -> dict[str, Any]:
    """Every parameter of this PX4, announced or not, in alphabetical order."""
    texts = parameter_texts.read()
    entries = [_entry(name, row, parameter_texts.described(texts, name)) for name, row in parameters.table().items()]
    return {"version": VERSION, "parameters": entries}


def _entry(name: str, row: dict[str, Any], text: parameter_texts.Text | None) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": name, "type": TYPES[row["type"]], "default": row["default"], "group": row["group"]}
    entry |= {key: row[key] for key in NUMBERS if key in row}
    if text is not None:
        entry |= {"shortDesc": text.short, "longDesc": text.long}
    if codes := row.get("values"):
        meanings = parameter_codes.values(name)
        if all(code in meanings for code in codes):
            entry["values"] = [{"value": code, "description": meanings[code]} for code in codes]
    if bits := row.get("bits"):
        meanings = parameter_codes.bits(name)
        if all(bit in meanings for bit in bits):
            entry["bitmask"] = [{"index": bit, "description": meanings[bit]} for bit in bits]
    return entry
