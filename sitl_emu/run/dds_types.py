"""PX4's messages as Cyclone DDS knows types: described field by field, carried as the bytes that they are."""

import functools
from typing import Any

from cyclonedds.idl import IdlStruct, make_idl_struct, types

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES

KINDS: dict[str, Any] = {
    **{f"int{bits}": getattr(types, f"int{bits}") for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": getattr(types, f"uint{bits}") for bits in (8, 16, 32, 64)},
    "float32": types.float32,
    "float64": types.float64,
    "bool": bool,
    "char": types.uint8,
}
"""By the names of .msg files; a char is an octet to ROS 2."""


@functools.cache
def described(message: str) -> type[IdlStruct]:
    """A message's type, with fields that bear PX4's names."""
    fields = {}
    for kind, length, name in MESSAGES[message].fields:
        element = KINDS[kind] if kind in KINDS else described(kind)
        fields[name] = element if length == 1 else types.array[element, length]
    made: type[IdlStruct] = make_idl_struct(message, f"px4_msgs.msg.dds_.{message}_", fields)
    return made


class Carried:
    """A sample that is carried unread."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        """With CDR's header."""
        self.sample_info: Any = None


@functools.cache
def carried(message: str) -> type[IdlStruct]:
    """The same type to DDS, whose samples are written by `sample` and come as Carried."""
    kind: type[IdlStruct] = make_idl_struct(
        message, f"px4_msgs.msg.dds_.{message}_", dict(described(message).__annotations__)
    )

    def serialize(sample: Any, **_options: object) -> bytes:
        return cdr.HEADER + bytes(sample.data)

    def deserialize(_kind: object, /, data: bytes, **_options: object) -> Carried:
        return Carried(data)

    kind.serialize = serialize
    kind.deserialize = classmethod(deserialize)
    return kind


def sample(kind: type[IdlStruct], data: bytes) -> Any:
    """A sample of a `carried` type; `data` without CDR's header."""
    made: Any = object.__new__(kind)
    made.data = data
    return made
