"""How a record of ours becomes the data of one of PX4's topics.

`formats.json` holds PX4 v1.18's fields of every topic, in the order in which it logs them (by size). A row turns a
record into their bytes. It runs hundreds of times a second: what is the same in every record is packed once.
"""

import itertools
import json
import pathlib
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Any

from sitl_emu.autopilot.logger import ulog
from sitl_emu.core import c_types

FORMATS: Mapping[str, tuple[ulog.Field, ...]] = {
    name: ulog.parse_fields(text)
    for name, text in json.loads(pathlib.Path(__file__).with_name("formats.json").read_text()).items()
}
Value = float | int | bool
Row = Callable[[Any], bytes]
"""The data of a topic from our record."""
Pack = Callable[..., bytes]
Fill = Callable[[Pack, Any], bytes]
"""Hands the values of a topic's fields, arrays flattened, to the function that packs them."""
Extra = Mapping[str, float | str]
"""Fields that have another name in our record, or a constant in every element."""


def zeros(*names: str) -> Extra:
    """Fields that are 0 in PX4, too: nobody sets them in simulation."""
    return dict.fromkeys(names, 0)


def row(topic: str) -> Callable[[Fill], Row]:
    """Decorator: a row from the function that knows the values of all of PX4's fields."""
    codes = ulog.codes(FORMATS[topic], FORMATS)
    return lambda fill: _packed(codes, fill)


def by_name(
    topic: str,
    record_type: type,
    extra: Extra | None = None,
    names: Sequence[str] = (),
    compute: Callable[[Any], tuple[Value, ...]] | None = None,
) -> Row:
    """A row whose fields are those of our record that bear the same names, those of `extra`, and those of `names`.

    A record's field that is an array has to be a tuple of its length. `compute` returns the values of `names`, arrays
    flattened. Raises ValueError where one of PX4's fields is in none of them: what is not known has to be said.
    """
    renamed = extra or {}
    ours: tuple[str, ...] = record_type._fields  # type: ignore[attr-defined]  # every record is a NamedTuple
    kinds = {name: ulog.array_length(kind) for kind, name in FORMATS[topic]}
    places = {name: place for place, name in enumerate(ours) if name in kinds and kinds[name][1] == 1}
    arrays = [name for name in ours if name in kinds and kinds[name][1] > 1 and name not in (*names, *renamed)]
    computed = len(ours)
    for name in (*arrays, *names):
        places[name] = computed
        computed += kinds[name][1]
    parts: list[tuple[str, int | bytes]] = []
    for name, (kind, length) in kinds.items():
        code, other = c_types.STRUCT_CODES[kind], renamed.get(name)
        if isinstance(other, str):
            parts += [(code, ours.index(other))] * length
        elif other is not None:
            parts += [(code, c_types.Layout(code).pack(other))] * length
        elif name in places:
            parts += [(code, places[name] + n) for n in range(length)]
        else:
            raise ValueError(f"{topic}.{name} is not told")
    codes: list[str] = []
    order: list[int] = []
    constants: list[bytes] = []
    for constant, group in itertools.groupby(parts, lambda part: isinstance(part[1], bytes)):
        if constant:
            constants.append(b"".join(data for _, data in group if isinstance(data, bytes)))
            codes.append(f"{len(constants[-1])}s")
            order.append(computed + len(constants) - 1)
        else:
            for code, place in group:
                assert isinstance(place, int)
                codes.append(code)
                order.append(place)
    flat = _flattened([ours.index(name) for name in arrays], compute)
    pick, rest = itemgetter(*order), tuple(constants)
    if flat is None:
        return _packed(codes, lambda pack, record: pack(*pick(record + rest)))
    return _packed(codes, lambda pack, record: pack(*pick(record + flat(record) + rest)))


def _flattened(
    arrays: Sequence[int], compute: Callable[[Any], tuple[Value, ...]] | None
) -> Callable[[Any], tuple[Value, ...]] | None:
    """What follows a record's own fields: the elements of its arrays, and what is computed."""
    if not arrays:
        return compute
    if len(arrays) == 1:
        place = arrays[0]
        joined: Callable[[Any], tuple[Value, ...]] = itemgetter(place)
    else:
        pick = itemgetter(*arrays)

        def joined(record: Any) -> tuple[Value, ...]:
            return tuple(itertools.chain.from_iterable(pick(record)))

    if compute is None:
        return joined
    return lambda record: joined(record) + compute(record)


def _packed(codes: Sequence[str], fill: Fill) -> Row:
    pack = c_types.Layout(codes).pack
    return lambda record: fill(pack, record)


def unpacked(topic: str, data: bytes) -> list[tuple[str, str, Any]]:
    """C type, name and value of a topic's fields: arrays are tuples, a field that is a topic a list like this one.

    Each of an array of topics is a field of its own, `esc[0]`.
    """
    return _fields(topic, iter(struct.unpack("<" + "".join(ulog.codes(FORMATS[topic], FORMATS)), data)))


def _fields(topic: str, values: Iterator[Value]) -> list[tuple[str, str, Any]]:
    fields: list[tuple[str, str, Any]] = []
    for kind, name in FORMATS[topic]:
        base, length = ulog.array_length(kind)
        if base in FORMATS:
            names = [name] if length == 1 else [f"{name}[{n}]" for n in range(length)]
            fields += [(base, each, _fields(base, values)) for each in names]
        else:
            taken = tuple(itertools.islice(values, length))
            fields.append((base, name, taken if length > 1 else taken[0]))
    return fields


def size_of(topic: str) -> int:
    """Bytes of a topic's data."""
    return struct.calcsize("<" + "".join(ulog.codes(FORMATS[topic], FORMATS)))


def definitions(topics: Sequence[str]) -> list[bytes]:
    """The formats of topics, and of the types in them."""
    wanted = dict.fromkeys(topics)
    for name in topics:
        kinds = (ulog.array_length(kind)[0] for kind, _ in FORMATS[name])
        wanted |= dict.fromkeys(kind for kind in kinds if kind in FORMATS)
    return [ulog.format_definition(name, FORMATS[name]) for name in wanted]
