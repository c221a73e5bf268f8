"""What PX4's uXRCE-DDS client publishes and takes, under which names, and the fields of its messages.

`dds_topics.json` is made from PX4's source by tools/make_dds_topics.py and says from which commit.
"""

import json
import pathlib
from collections.abc import Mapping
from typing import NamedTuple

Field = tuple[str, int, str]
"""Type, length (1: no array) and name of a field: ("float32", 4, "q")."""


class Message(NamedTuple):
    """A message of px4_msgs."""

    fields: tuple[Field, ...]
    """In the order of its definition."""
    version: int
    """MESSAGE_VERSION; 0: it has none."""
    queue: int
    """ORB_QUEUE_LENGTH."""
    hash: int
    """Of its fields, as MessageFormatResponse tells it."""


class Sample(NamedTuple):
    """A message of a topic, by its number in PUBLICATIONS or SUBSCRIPTIONS, without CDR's header.

    REPLY and REQUEST are the numbers of the service; before its messages stands `Asked`.
    """

    topic: int
    data: bytes


class Topic(NamedTuple):
    """A topic that is published or taken."""

    name: str
    type: str
    interval_us: int = 0
    """It is published at most so often."""
    instances: int = 1
    """Of uORB: so many sources of it are told apart."""


class Service(NamedTuple):
    """A service that is offered: its name, its type, and the messages that pass (srv/TYPE.srv)."""

    name: str
    type: str
    request: str
    reply: str


def _field(text: str) -> Field:
    kind, name = text.split()
    kind, _, length = kind.partition("[")
    return kind, int(length.rstrip("]")) if length else 1, name


_TABLE = json.loads(pathlib.Path(__file__).with_name("dds_topics.json").read_text())
SOURCE: str = _TABLE["source"]
"""PX4's commit."""
MESSAGES: Mapping[str, Message] = {
    name: Message(tuple(_field(text) for text in row["fields"].split("; ")), row["version"], row["queue"], row["hash"])
    for name, row in _TABLE["messages"].items()
}
PUBLICATIONS: tuple[Topic, ...] = tuple(
    Topic(row["topic"], row["type"], row["interval_ms"] * 1000) for row in _TABLE["publications"]
)
SUBSCRIPTIONS: tuple[Topic, ...] = tuple(
    Topic(row["topic"], row["type"], instances=row.get("instances", 1)) for row in _TABLE["subscriptions"]
)
VEHICLE_COMMAND = Service("vehicle_command", "VehicleCommand", "VehicleCommand", "VehicleCommandAck")
"""The service of PX4's client, its only one (vehicle_command_srv.cpp)."""
REQUEST, REPLY = len(SUBSCRIPTIONS), len(PUBLICATIONS)


def namespace(instance: int) -> str:
    """The namespace of an instance, as PX4's start script (rcS) gives it: none for the first, then px4_1 and so on."""
    return f"px4_{instance}" if instance else ""


def dds_name(topic: Topic, folder: str, within: str = "") -> str:
    """The DDS topic behind ROS's `/fmu/FOLDER/TOPIC`, in a namespace (utilities.hpp, generate_topic_name)."""
    version = MESSAGES[topic.type].version
    prefix = f"rt/{within}/fmu" if within else "rt/fmu"
    return f"{prefix}/{folder}/{topic.name}" + (f"_v{version}" if version else "")


def service_names(service: Service, within: str = "") -> tuple[str, str]:
    """The DDS topics of a service's requests and replies, in a namespace (srv_base.cpp, generate_request_name)."""
    path = f"{within}/fmu/{service.name}" if within else f"fmu/{service.name}"
    return f"rq/{path}Request", f"rr/{path}Reply"


def dds_type(message: str) -> str:
    """The name of a message's DDS type."""
    return f"px4_msgs::msg::dds_::{message}_"
