"""The autopilot's parameters: PX4's whole set for an airframe class, served as PX4 serves it.

`parameters.json` beside this file holds, per name, PX4's type, default, bounds and whether each airframe class
("multicopter", "rover") announces it; an airframe (a vehicle's data) overrides defaults. Modules read
`parameters["MPC_XY_P"]` when they need it, or copy what they need in an `update(parameters)` that the autopilot calls
whenever `parameters.version` has changed: a hot loop looks nothing up by name.
"""

import json
import pathlib
from collections.abc import Iterator, Mapping

TABLE = pathlib.Path(__file__).with_name("parameters.json")
Value = float | int


class Parameters:
    """Values by name. Int32 parameters hold int, floats float (as float32 would hold them)."""

    def __init__(self, airframe_class: str, overrides: Mapping[str, Value] | None = None) -> None:
        raise NotImplementedError

    def __getitem__(self, name: str) -> Value:
        """Value of a parameter; KeyError for a name that PX4 does not know."""
        raise NotImplementedError

    def __iter__(self) -> Iterator[str]:
        """Announced names, in PX4's order (alphabetical)."""
        raise NotImplementedError

    def set(self, name: str, value: Value) -> None:
        """Change a value; raises KeyError for an unknown name. Counts `version` up when the value differs."""
        raise NotImplementedError


def _load() -> dict[str, dict[str, Value | str]]:
    table: dict[str, dict[str, Value | str]] = json.loads(TABLE.read_text())
    return table
