"""The autopilot's parameters: PX4's whole set for a kind of vehicle, served as PX4 serves it.

`parameters.json` beside this file holds, per name, PX4's type, default, bounds and which kinds of vehicle announce it
(`Traits.announces`); an airframe (a vehicle's data) overrides defaults. Modules read
`parameters["MPC_XY_P"]` when they need it, or copy what they need in an `update(parameters)` that the autopilot calls
whenever `parameters.version` has changed: a hot loop looks nothing up by name.

PX4 takes NaN and infinity for a value, tells it, and flies with it. Here they are kept and told, but no module gets
them: it goes on with the value before.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any, Final

from sitl_emu.autopilot.parameters.table import table
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.c_types import float32, integer

SMALLEST_CHANGE: Final = 2.0**-23
"""PX4 takes two floats that differ by no more (FLT_EPSILON) for the same value."""
Value = float | int
SET_AT_EACH_START: Final = ("MAV_SYS_ID", "SIH_VEHICLE_TYPE", "COM_DL_LOSS_T", "COM_RC_LOSS_T", "COM_OF_LOSS_T")
SET_AT_FIRST_START: Final = ("SYS_AUTOSTART", "CAL_*", "SENS_BOARD_X_OFF", "SENS_DPRES_OFF")
"""Of an airframe's values: what the start-up script sets (`param set`; the second when the airframe is another than
the one that was saved, init.d-posix/rcS), and of the barometer what its module does. To PX4 these are what somebody
changed: they are saved, and a reset takes them away until a start. The others (`param set-default`) are defaults."""


class Parameters:
    """Values by name. INT32 parameters hold int, REAL32 ones the float that a float32 would hold."""

    def __init__(self, kind: VehicleKind, overrides: Mapping[str, Value] | None = None) -> None:
        """The set of a kind of vehicle; `overrides` are finite. Raises KeyError for one that PX4 does not know."""
        self._table = table()
        self._defaults = {name: self.typed(name, row["default"]) for name, row in self._table.items()}
        given = {name: self.typed(name, value) for name, value in (overrides or {}).items()}
        self.set_at_start = {
            name: value for name, value in given.items() if matches(name, SET_AT_EACH_START + SET_AT_FIRST_START)
        }
        """Of the airframe: what a start sets, on top of defaults."""
        self._defaults |= {name: value for name, value in given.items() if name not in self.set_at_start}
        self._values = self._defaults | self.set_at_start
        self._used = dict(self._values)
        announces, started = kind.traits.announces, self._started_modules()
        self.announced = [
            name for name, row in self._table.items() if announces in row["announced"] or row["group"] in started
        ]
        """Names that a module has looked for so far, in alphabetical order; one that starts late adds its own."""
        self.index = {name: index for index, name in enumerate(self.announced)}
        self.everything = list(self._table)
        """All names of PX4's build, in its order, announced or not."""
        self.version = 0
        """Counts all changes: whoever keeps copies looks here."""
        self.notifications = 0
        """Counts the changes that PX4 publishes (parameter_update), which MAVLink then tells to every link."""
        self.edits = 0
        """Counts the changes that want to be saved."""
        self.unsaved: set[str] = set()
        """Names that were set since the last save."""

    def __getitem__(self, name: str) -> Value:
        """Value of a parameter as modules use it, a finite number; KeyError for a name that PX4 does not know."""
        return self._used[name]

    def told(self, name: str) -> Value:
        """Value of a parameter as it was set, NaN and infinity too: what the ground is told and what is saved."""
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

    def set(self, name: str, value: Value, *, notify: bool = True) -> None:
        """Set a value as PX4's param_set does; KeyError for an unknown name.

        A value that is no change in PX4's eyes (none, too small a one, or NaN) is stored, but neither published nor
        saved. `notify=False` is for counters that the autopilot keeps for itself.
        """
        typed, before = self.typed(name, value), self._values[name]
        self._store(name, typed)
        if not _differs(typed, before):
            self.unsaved.discard(name)
            return
        self.unsaved.add(name)
        self.edits += 1
        if notify:
            self.notifications += 1

    def set_default(self, name: str, value: Value) -> None:
        """Give this airframe another default (param_set_default_value), which is the value where nobody set one.

        KeyError for an unknown name.
        """
        typed, before = self.typed(name, value), self._defaults[name]
        if not _differs(typed, before):
            return
        self._defaults[name] = typed
        if self._values[name] == before:
            self._store(name, typed)
        if name in self.index:
            self.notifications += 1

    def set_quietly(self, values: Mapping[str, Value]) -> None:
        """Set several values as a module does for itself (param_set_no_notification), and tell of all at once.

        Nothing is told where none is a change.
        """
        edits = self.edits
        for name, value in values.items():
            if _differs(self.typed(name, value), self._values[name]):
                self.set(name, value, notify=False)
        if self.edits != edits:
            self.notifications += 1

    def use(self, names: tuple[str, ...]) -> None:
        """Announce parameters from now on, as PX4 does when a module looks for them for the first time (param_find).

        KeyError for an unknown name. All indices behind a new one move, and the hash changes.
        """
        new = [name for name in names if name not in self.index]
        if new:
            self.announced = sorted((*self.announced, *(name for name in new if self._table[name])))
            self.index = {name: index for index, name in enumerate(self.announced)}

    def load(self, values: Mapping[str, Value]) -> None:
        """Take over values that were saved before; unknown names and wrong types are left out (PX4's param_import)."""
        for name, value in values.items():
            if name in self._table and self.is_float(name) is isinstance(value, float):
                self._store(name, self.typed(name, value))
                self.notifications += 1

    def reset(self, which: Callable[[str], bool] = lambda name: True) -> None:
        """Give the parameters that `which` chooses by name this airframe's defaults again."""
        for name, value in self._defaults.items():
            if which(name):
                self._store(name, value)
        self.edits += 1
        self.notifications += 1

    def changed(self) -> dict[str, Value]:
        """Values that differ from this airframe's defaults: what is saved."""
        defaults = self._defaults
        return {
            name: value
            for name, value in self._values.items()
            if _differs(value, defaults[name]) or (value != value and defaults[name] == defaults[name])
        }

    def _store(self, name: str, typed: Value) -> None:
        if typed != self._values[name]:
            self._values[name] = typed
            if math.isfinite(typed):
                self._used[name] = typed
            self.version += 1

    def typed(self, name: str, value: Value) -> Value:
        """A value as the parameter would hold it: whole, or rounded to float32."""
        if self._table[name]["type"] != "REAL32":
            return integer("i", value)
        return float32(value)

    def _started_modules(self) -> tuple[str, ...]:
        """Groups of parameters whose module runs in this airframe alone: PX4 announces what is in use (rcS)."""
        started: tuple[str, ...] = ()
        if self._values["MNT_MODE_IN"] >= 0:
            started += ("Mount",)
        if self._values["TRIG_MODE"] > 0:
            started += ("Camera trigger",)
        return started


def matches(name: str, patterns: tuple[str, ...]) -> bool:
    """Whether a name is one of `patterns`, in which a `*` at the end stands for any rest."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _differs(one: Value, other: Value) -> bool:
    """Whether PX4 takes two values of a type for different; nothing differs from NaN."""
    return abs(one - other) > SMALLEST_CHANGE
