"""PX4's events (MAVLink EVENT) in words, by the table of PX4 v1.18 (`autopilot/events/events.json`).

The table has names and arguments, not the sentences of PX4's metadata: `commander_armed_by` with the reason
`command_internal` becomes "commander armed by: command internal".
"""

import functools
from typing import Any

from sitl_emu.autopilot.events.events import layout, table
from sitl_emu.core.c_types import Layout

SHOWN = "default"
"""The group of events that ground stations show one by one; those of others make up reports of checks."""
BACKGROUND = {"logger_open_file_time"}


def words(event_id: int, arguments: bytes) -> str | None:
    """An event in words; None for one that is not shown, or that PX4 v1.18 does not know."""
    named = _by_id().get(event_id)
    if named is None:
        return None
    name, row = named
    if row["group"] != SHOWN or name in BACKGROUND:
        return None
    formats = Layout(layout(name)[1])
    values = formats.unpack(arguments[: formats.size].ljust(formats.size, b"\0"))
    told = [_value(kind, value) for (_, kind), value in zip(row["arguments"], values, strict=True)]
    text = name.replace("_", " ")
    return f"{text}: {', '.join(told)}" if told else text


@functools.cache
def _by_id() -> dict[int, tuple[str, dict[str, Any]]]:
    return {row["id"]: (name, row) for name, row in table()["events"].items()}


@functools.cache
def _entries() -> dict[str, dict[int, str]]:
    """Words of enums' numbers, by the enum's last name."""
    enums = table()["enums"].items()
    return {name.rsplit("::", 1)[-1]: {n: word for word, n in row["entries"].items()} for name, row in enums}


def _value(kind: str, value: float) -> str:
    entries = _entries().get(kind.rsplit("::", 1)[-1])
    if entries is not None:
        return entries.get(int(value), str(value)).replace("_", " ")
    return f"{value:g}"
