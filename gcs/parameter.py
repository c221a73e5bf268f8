"""The parameter protocol's client half: read one, set one, load all.

Source: https://mavlink.io/en/services/parameter.html and PX4 v1.18: integers travel as their 32 bits in the float field
(`MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE`); PX4 first sends `_HASH_CHECK` with index 65535, then
0..param_count-1. Holes of a list are asked for one by one, as QGroundControl does. What can't be read or set is refused
by PARAM_ERROR.
"""

import struct
from typing import NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.question import TIMEOUT_US, Question

HOLES_AT_ONCE = 10
NO_INDEX = 65535
MAV_PARAM_TYPE_INT32 = 6
MAV_PARAM_TYPE_REAL32 = 9
ERRORS = {
    1: "does not exist",
    2: "value out of range",
    3: "permission denied",
    4: "component not found",
    5: "read only",
    6: "type unsupported",
    7: "type mismatch",
    8: "read failed",
}
"""MAV_PARAM_ERROR for people."""


class Parameter(NamedTuple):
    """A parameter's value with its MAV_PARAM_TYPE (6 an int32, 9 a float)."""

    name: str
    value: float | int
    type: int


def value_of(param_value: float, param_type: int) -> float | int:
    """The value that a PARAM_VALUE carries."""
    if param_type == MAV_PARAM_TYPE_REAL32:
        return param_value
    return int(struct.unpack("<i", struct.pack("<f", param_value))[0])


def wire_of(value: float | int, param_type: int) -> float:
    """What goes into the float field for a value."""
    if param_type == MAV_PARAM_TYPE_REAL32:
        return float(value)
    return float(struct.unpack("<f", struct.pack("<i", int(value)))[0])


def parameter_of(msg: mavlink.MAVLink_message) -> Parameter:
    """The parameter in a PARAM_VALUE message."""
    return Parameter(_name_in(msg), value_of(msg.param_value, msg.param_type), msg.param_type)


def _name_in(msg: mavlink.MAVLink_message) -> str:
    raw = msg.param_id if isinstance(msg.param_id, str) else bytes(msg.param_id).decode("ascii", "replace")
    return raw.rstrip("\0")


class _ParameterQuestion(Question):
    """What is answered by a PARAM_VALUE; `target_component` 0 is any."""

    def _answer(self, msg: mavlink.MAVLink_message) -> Parameter | None:
        """The parameter in a message, if it is a PARAM_VALUE of the component that was asked."""
        return parameter_of(msg) if self._is_from_target(msg, "PARAM_VALUE") else None

    def _hear_refusal(self, msg: mavlink.MAVLink_message, name: str) -> None:
        """Ends with a PARAM_ERROR about the parameter that was asked for by its name."""
        if self._is_from_target(msg, "PARAM_ERROR") and _name_in(msg) == name:
            self.refusal, self.done = ERRORS.get(msg.error, f"error {msg.error}"), True

    def _is_from_target(self, msg: mavlink.MAVLink_message, kind: str) -> bool:
        system, component = self.target
        source = msg.get_srcSystem() == system and component in (0, msg.get_srcComponent())
        return not self.done and self._sent > 0 and source and msg.get_type() == kind


class ParameterRead(_ParameterQuestion):
    """Reads one parameter by name; `parameter` is None, and `refusal` says why, if it ended without one."""

    def __init__(self, target_system: int, name: str, target_component: int = 1) -> None:
        super().__init__(target_system, target_component)
        self.name = name
        self.parameter: Parameter | None = None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the PARAM_VALUE of that name, or that there is none."""
        self._hear_refusal(msg, self.name)
        parameter = self._answer(msg)
        if parameter is not None and parameter.name == self.name:
            self.parameter, self.done = parameter, True
        return []

    def _messages(self) -> list[mavlink.MAVLink_message]:
        return [mavlink.MAVLink_param_request_read_message(*self.target, self.name.encode(), -1)]


class ParameterSet(_ParameterQuestion):
    """Sets one parameter; `accepted` is True when the autopilot answered with the value that was set.

    `refusal` says why not, where it did not answer with a value at all.
    """

    def __init__(self, target_system: int, name: str, value: float | int, target_component: int = 1) -> None:
        """A Python int is sent as int32, a float as float."""
        super().__init__(target_system, target_component)
        self.name, self.value = name, value
        self.type = MAV_PARAM_TYPE_INT32 if isinstance(value, int) else MAV_PARAM_TYPE_REAL32
        self.accepted = False

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the PARAM_VALUE that PX4 answers with, or the PARAM_ERROR."""
        self._hear_refusal(msg, self.name)
        parameter = self._answer(msg)
        if parameter is not None and parameter.name == self.name:
            values = (wire_of(parameter.value, parameter.type), wire_of(self.value, self.type))
            bits = [struct.pack("<f", value) for value in values]
            self.accepted = parameter.type == self.type and bits[0] == bits[1]
            self.done = True
        return []

    def _messages(self) -> list[mavlink.MAVLink_message]:
        value = wire_of(self.value, self.type)
        return [mavlink.MAVLink_param_set_message(*self.target, self.name.encode(), value, self.type)]


class ParameterList(_ParameterQuestion):
    """Loads all parameters into `parameters`; `complete` tells whether none is missing."""

    def __init__(self, target_system: int, target_component: int = 1) -> None:
        super().__init__(target_system, target_component)
        self.parameters: dict[str, Parameter] = {}
        self.count: int | None = None
        self._missing: set[int] = set()

    @property
    def complete(self) -> bool:
        """True when every index has arrived."""
        return self.count is not None and not self._missing

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes a PARAM_VALUE."""
        parameter = self._answer(msg)
        if parameter is None or msg.param_index == NO_INDEX:
            return []
        if self.count is None:
            self.count = msg.param_count
            self._missing = set(range(msg.param_count))
        self.parameters[parameter.name] = parameter
        self._missing.discard(msg.param_index)
        self._due_us = now_us + TIMEOUT_US
        self._sent = 1
        self.done = not self._missing
        return []

    def _messages(self) -> list[mavlink.MAVLink_message]:
        """The list, and its holes once nothing has come for a while."""
        if self.count is None:
            return [mavlink.MAVLink_param_request_list_message(*self.target)]
        holes = sorted(self._missing)[:HOLES_AT_ONCE]
        return [mavlink.MAVLink_param_request_read_message(*self.target, b"", index) for index in holes]
