"""A topic that is published to ROS 2, as rmw_cyclonedds does: names of topics and types, hashes, QoS, plain CDR."""

import functools
from collections.abc import Mapping
from typing import Any, Final

from cyclonedds.core import DDSException, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from sitl_emu.run import dds_types
from sitl_emu.run.dds_types import PLAIN_CDR
from sitl_emu.run.ros import messages
from sitl_emu.run.ros.messages import MESSAGES, ONE, SEQUENCE

RELIABLE = Policy.Reliability.Reliable(duration(milliseconds=100))
"""It waits for readers that asked for it at most so long, then it goes on without them (DDS's default)."""
SENSOR: Final = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(5), PLAIN_CDR)
"""Drivers publish reliably, so that best effort readers (SensorDataQoS) hear them as well as others (REP 2003)."""
CLOCK: Final = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1), PLAIN_CDR)
"""rclcpp::ClockQoS."""
TF: Final = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(100), PLAIN_CDR)
"""tf2_ros::DynamicBroadcasterQoS."""
TF_STATIC: Final = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1), PLAIN_CDR)
"""tf2_ros::StaticBroadcasterQoS."""


@functools.cache
def described(message: str) -> type[IdlStruct]:
    """A message's type, with the names of its fields."""
    fields = {}
    for kind, length, name in MESSAGES[message]:
        element = str if kind == "string" else dds_types.KINDS[kind] if kind in dds_types.KINDS else described(kind)
        many = {ONE: element, SEQUENCE: types.sequence[element]}
        fields[name] = many[length] if length in many else types.array[element, length]
    name = message.partition("/")[2]
    made: type[IdlStruct] = make_idl_struct(name, messages.dds_type(message), fields)
    return made


@functools.cache
def carried(message: str) -> type[IdlStruct]:
    """The same type to DDS, whose samples are bytes."""
    return dds_types.carrying(message.partition("/")[2], messages.dds_type(message), described(message).__annotations__)


class Publisher:
    """Of one topic."""

    def __init__(self, participant: DomainParticipant, topic: str, message: str, qos: Qos = SENSOR) -> None:
        """`topic` without ROS's slash before it: "px4_1/camera/image_raw"."""
        self._message, self._kind = message, carried(message)
        mark = Policy.Userdata(f"typehash={messages.type_hash(message)};".encode())
        lasting = Policy.WriterDataLifecycle(autodispose=False)  # as rmw_cyclonedds has it
        quality = qos + Qos(mark, lasting)
        self._writer = DataWriter(participant, Topic(participant, f"rt/{topic}", self._kind), qos=quality)

    @property
    def is_heard(self) -> bool:
        """Whether anybody reads it."""
        return bool(self._writer.get_matched_subscriptions())

    def publish(self, values: Mapping[str, Any]) -> None:
        """A message; what a reliable reader does not take in time is lost to it."""
        try:
            self._writer.write(dds_types.sample(self._kind, messages.written(self._message, values)))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
