"""Reads tables (of TOML) into frozen dataclasses and says exactly what is wrong with them.

The dataclass is the schema: its field types are float, int, str, bool, fixed tuples of floats, other dataclasses,
tuples of dataclasses (`[[table]]`), or one of these `| None`; a field without default must be given. `limited` adds
bounds, `choice` the allowed words.
"""

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from vehicles.errors import VehicleError

Record = TypeVar("Record")


def limited(minimum: float, maximum: float = math.inf, **default: Any) -> Any:
    """A number (or every number of a tuple) within bounds, both allowed."""
    return dataclasses.field(metadata={"minimum": minimum, "maximum": maximum}, **default)


def choice(*words: str, **default: Any) -> Any:
    """One of some words."""
    return dataclasses.field(metadata={"words": words}, **default)


def read(record: type[Record], table: Mapping[str, Any], where: str) -> Record:
    """A `record` from a table; `where` says which table, for errors. Raises VehicleError."""
    fields = {field.name: field for field in dataclasses.fields(record) if field.init}  # type: ignore[arg-type]
    for name, value in table.items():
        if name not in fields:
            raise VehicleError(f"{where}: unknown field {name!r} = {value!r}; allowed are: {', '.join(fields)}")
    hints = typing.get_type_hints(record)
    values = {}
    for name, field in fields.items():
        if name in table:
            values[name] = _value(hints[name], table[name], f"{where}: {name}", field.metadata)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise VehicleError(f"{where}: the field {name!r} is missing")
    return record(**values)


def _value(hint: Any, value: Any, where: str, metadata: Mapping[str, Any]) -> Any:
    if isinstance(hint, types.UnionType):
        hint = next(option for option in typing.get_args(hint) if option is not type(None))
    if dataclasses.is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise VehicleError(f"{where} = {value!r} must be a table")
        return read(typing.cast(type[Any], hint), value, where)
    if typing.get_origin(hint) is tuple:
        return _tuple(typing.get_args(hint), value, where, metadata)
    if hint is float:
        return _number(value, where, metadata)
    if hint is int and (isinstance(value, bool) or not isinstance(value, int)):
        raise VehicleError(f"{where} = {value!r} must be a whole number")
    if hint is int:
        return int(_number(value, where, metadata))
    if not isinstance(value, hint):
        raise VehicleError(f"{where} = {value!r} must be a {hint.__name__}")
    words = metadata.get("words")
    if words and value not in words:
        raise VehicleError(f"{where} = {value!r}; allowed are: {', '.join(words)}")
    return value


def _tuple(hints: tuple[Any, ...], value: Any, where: str, metadata: Mapping[str, Any]) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise VehicleError(f"{where} = {value!r} must be a list")
    if len(hints) == 2 and hints[1] is Ellipsis:
        hints = (hints[0],) * len(value)
    if len(hints) != len(value):
        raise VehicleError(f"{where} = {value!r} must have {len(hints)} elements")
    pairs = enumerate(zip(hints, value, strict=True))
    return tuple(_value(hint, element, f"{where}[{index}]", metadata) for index, (hint, element) in pairs)


def _number(value: Any, where: str, metadata: Mapping[str, Any]) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise VehicleError(f"{where} = {value!r} must be a number")
    minimum, maximum = metadata.get("minimum", -math.inf), metadata.get("maximum", math.inf)
    if not minimum <= value <= maximum:
        raise VehicleError(f"{where} = {value!r} is out of range; allowed is {minimum:g} to {maximum:g}")
    return float(value)
