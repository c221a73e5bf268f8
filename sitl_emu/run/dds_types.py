"""PX4's messages as Cyclone DDS knows types: described field by field, carried as the bytes that they are."""

import functools
from collections.abc import Mapping
from typing import Any

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.qos import Policy

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, Service

PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
"""How all samples are laid out, as ROS 2 and PX4's agent have it."""
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
    return carrying(message, f"px4_msgs.msg.dds_.{message}_", described(message).__annotations__)


@functools.cache
def carried_service(service: Service) -> tuple[type[IdlStruct], type[IdlStruct]]:
    """The types of a service's requests and replies, likewise, as rmw_cyclonedds has them.

    Before the message stand two words (serdata.hpp, cdds_request_header): who asks, and the request's number.
    """

    asked = {"guid": types.uint64, "seq": types.int64}

    def part(suffix: str, field: str, message: str) -> type[IdlStruct]:
        name = f"{service.type}_{suffix}_"
        return carrying(name, f"px4_msgs.srv.dds_.{name}", {**asked, field: described(message)})

    return part("Request", "request", service.request), part("Response", "reply", service.reply)


def carrying(name: str, type_name: str, fields: Mapping[str, Any]) -> type[IdlStruct]:
    """A type whose samples are written by `sample` and come as Carried."""
    kind: type[IdlStruct] = make_idl_struct(name, type_name, dict(fields))

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
