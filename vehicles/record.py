"""Reads tables (of TOML or JSON) into frozen dataclasses and says exactly what is wrong with them.

The dataclass is the schema: its field types are float, int, str, bool, tuples of floats, other dataclasses, tuples of
dataclasses (`[[table]]`), mappings of dataclasses by name, mappings that are taken as they are, or unions of these with
`None` or with one dataclass; a field without default must be given. `Annotated[…, Limits(…)]` bounds a number or every
number of a tuple, `Annotated[str, Words(…)]` lists the words that are allowed.
"""

import dataclasses
import re
import sys
import types
import typing
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from sitl_emu.vehicles.errors import VehicleError

Record = TypeVar("Record")


LARGEST = sys.float_info.max
EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")
"""A number to anybody but YAML 1.1, which wants a point and the exponent's sign."""


class Limits(NamedTuple):
    """Bounds of a number, both allowed; it is finite unless they are not."""

    minimum: float
    maximum: float = LARGEST

    def __str__(self) -> str:
        if self.maximum < LARGEST:
            return f"{self.minimum:g} to {self.maximum:g}"
        return f"{self.minimum:g} or more" if self.minimum > -LARGEST else "any finite number"


class Words(NamedTuple):
    """The words that a field may hold."""

    allowed: tuple[str, ...]


UNBOUNDED = Limits(-LARGEST)


def read(record: type[Record], table: Mapping[str, Any], where: str) -> Record:
    """A `record` from a table; `where` says which table, for errors. Raises VehicleError."""
    hints = typing.get_type_hints(record, include_extras=True)
    for name, value in table.items():
        if name not in hints:
            raise VehicleError(f"{where}: unknown field {name!r} = {value!r}; allowed are: {', '.join(hints)}")
    values = {}
    for field in dataclasses.fields(record):  # type: ignore[arg-type]
        if field.name in table:
            values[field.name] = _value(hints[field.name], table[field.name], f"{where}: {field.name}", UNBOUNDED)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise VehicleError(f"{where}: the field {field.name!r} is missing")
    return record(**values)


def changed(record: Record, table: Mapping[str, Any], where: str) -> Record:
    """A copy of a record with other figures: `table` has the record's own names, nested as it is, in part.

    `where` says which table, for errors. Raises VehicleError.
    """
    hints = typing.get_type_hints(type(record), include_extras=True)
    values = {}
    for name, value in table.items():
        if name not in hints:
            raise VehicleError(f"{where}: unknown field {name!r} = {value!r}; allowed are: {', '.join(hints)}")
        before, place = getattr(record, name), f"{where}: {name}"
        if dataclasses.is_dataclass(before) and isinstance(value, Mapping):
            values[name] = changed(before, value, place)
        else:
            values[name] = _value(hints[name], value, place, UNBOUNDED)
    return dataclasses.replace(record, **values)  # type: ignore[type-var]


def _value(hint: Any, value: Any, where: str, rule: Limits | Words) -> Any:
    if typing.get_origin(hint) is typing.Annotated:
        hint, rule = typing.get_args(hint)
    if isinstance(hint, types.UnionType):
        if value is None and types.NoneType in typing.get_args(hint):
            return None
        hint = _member(hint, value)
    if dataclasses.is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise VehicleError(f"{where} = {value!r} must be a table")
        return read(typing.cast(type[Any], hint), value, where)
    if typing.get_origin(hint) is tuple:
        return _tuple(typing.get_args(hint), value, where, rule)
    if typing.get_origin(hint) is Mapping and dataclasses.is_dataclass(typing.get_args(hint)[1]):
        return _records(typing.get_args(hint)[1], value, where)
    hint = typing.get_origin(hint) or hint
    if hint in (float, int):
        return _number(hint, value, where, rule)
    if not isinstance(value, hint):
        raise VehicleError(f"{where} = {value!r} must be a {hint.__name__}")
    if isinstance(rule, Words) and value not in rule.allowed:
        raise VehicleError(f"{where} = {value!r}; allowed are: {', '.join(filter(None, rule.allowed))}")
    return value


def _records(record: Any, value: Any, where: str) -> dict[str, Any]:
    """Records by name."""
    if not isinstance(value, Mapping):
        raise VehicleError(f"{where} = {value!r} must be a table")
    return {str(name): _value(record, each, f"{where}.{name}", UNBOUNDED) for name, each in value.items()}


def _member(union: types.UnionType, value: Any) -> Any:
    """The type of a union that a value is meant for: a table for its dataclass, anything else for the other."""
    options = [option for option in typing.get_args(union) if option is not types.NoneType]
    for option in options:
        if dataclasses.is_dataclass(option) == isinstance(value, Mapping):
            return option
    return options[0]


def _tuple(hints: tuple[Any, ...], value: Any, where: str, rule: Limits | Words) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise VehicleError(f"{where} = {value!r} must be a list")
    if len(hints) == 2 and hints[1] is Ellipsis:
        hints = (hints[0],) * len(value)
    if len(hints) != len(value):
        raise VehicleError(f"{where} = {value!r} must have {len(hints)} elements")
    pairs = enumerate(zip(hints, value, strict=True))
    return tuple(_value(hint, element, f"{where}[{index}]", rule) for index, (hint, element) in pairs)


def _number(hint: type[float] | type[int], value: Any, where: str, rule: Limits | Words) -> float:
    allowed = (int,) if hint is int else (int, float)
    if isinstance(value, bool) or not isinstance(value, allowed):
        is_text = isinstance(value, str) and hint is float and EXPONENT.fullmatch(value)
        remedy = "; to YAML this is a text: write it as 1.0e+6, with point and sign" if is_text else ""
        raise VehicleError(f"{where} = {value!r} must be a {'whole ' if hint is int else ''}number{remedy}")
    if isinstance(rule, Limits) and not rule.minimum <= value <= rule.maximum:
        raise VehicleError(f"{where} = {value!r} is out of range; allowed is {rule}")
    return hint(value)
