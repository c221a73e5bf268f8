"""The autopilot's parameters: PX4's whole set for an airframe class, served as PX4 serves it.

`parameters.json` beside this file holds, per name, PX4's type, default, bounds and whether each airframe class
("multicopter", "rover") announces it; an airframe (a vehicle's data) overrides defaults. Modules read
`parameters["MPC_XY_P"]` when they need it, or copy what they need in an `update(parameters)` that the autopilot calls
whenever `parameters.version` has changed: a hot loop looks nothing up by name.
"""

import functools
import json
import math
import pathlib
import struct
from collections.abc import Iterator, Mapping
from typing import Any

TABLE = pathlib.Path(__file__).with_name("parameters.json")
Value = float | int


class Parameters:
    """Values by name. INT32 parameters hold int, REAL32 ones the float that a float32 would hold."""

    def __init__(self, airframe_class: str, overrides: Mapping[str, Value] | None = None) -> None:
        """`airframe_class` is "multicopter" or "rover"; raises KeyError for an override that PX4 does not know."""
        self._table = table()
        self._defaults = {name: self.typed(name, row["default"]) for name, row in self._table.items()}
        for name, value in (overrides or {}).items():
            self._defaults[name] = self.typed(name, value)
        self._values = dict(self._defaults)
        self.announced = [name for name, row in self._table.items() if airframe_class in row["announced"]]
        self.index = {name: index for index, name in enumerate(self.announced)}
        self.everything = list(self._table)
        """All names of PX4's build, in its order, announced or not."""
        self.version = 0

    def __getitem__(self, name: str) -> Value:
        """Value of a parameter; KeyError for a name that PX4 does not know."""
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        """Announced names, in PX4's order (alphabetical)."""
        return iter(self.announced)

    def is_float(self, name: str) -> bool:
        """Whether a parameter is REAL32 (else INT32); KeyError for an unknown name."""
        return bool(self._table[name]["type"] == "REAL32")

    def row(self, name: str) -> Mapping[str, Any]:
        """PX4's page on a parameter: type, default, min, max, unit, …; KeyError for an unknown name."""
        return self._table[name]

    def default(self, name: str) -> Value:
        """Value of a parameter in this airframe before anybody changed it."""
        return self._defaults[name]

    def set(self, name: str, value: Value) -> None:
        """Change a value; KeyError for an unknown name. `version` counts the changes."""
        typed = self.typed(name, value)
        if typed != self._values[name]:
            self._values[name] = typed
            self.version += 1

    def changed(self) -> dict[str, Value]:
        """Values that differ from this airframe's defaults: what is saved."""
        return {name: value for name, value in self._values.items() if value != self._defaults[name]}

    def typed(self, name: str, value: Value) -> Value:
        """A value as the parameter would hold it: whole, or rounded to float32."""
        if self._table[name]["type"] != "REAL32":
            return int(value)
        return _float32(float(value))


@functools.cache
def table() -> dict[str, dict[str, Any]]:
    """Every parameter of PX4 v1.18 with its type, default, bounds and who announces it."""
    loaded: dict[str, dict[str, Any]] = json.loads(TABLE.read_text())
    return loaded


def _float32(value: float) -> float:
    if not math.isfinite(value):
        return value
    try:
        rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded
