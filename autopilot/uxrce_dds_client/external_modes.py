"""What PX4 answers to ROS 2's libraries: modes that want to be registered, setpoint types, formats of messages.

Modes of others are not flown here: a registration is refused as PX4 refuses one for which it has no slot
(commander/ModeManagement.cpp), and a setpoint type for a mode that is not registered as PX4 does. Formats are told
(uxrce_dds_client.cpp, fillMessageFormatResponse), of the messages in the table.
"""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, PUBLICATIONS, SUBSCRIPTIONS

API_VERSION: Final = 2
"""LATEST_PX4_ROS2_API_VERSION."""
FORMAT_PROTOCOL: Final = 1
"""MessageFormatRequest.LATEST_PROTOCOL_VERSION."""
NONE: Final = -1
FAILURE_OTHER: Final = 1
"""SetpointConfigReply.RESULT_FAILURE_OTHER."""
TYPES = {topic.name: topic.type for topic in (*PUBLICATIONS, *SUBSCRIPTIONS)}


class Reply(NamedTuple):
    """A message to be published, but for its time."""

    topic: str
    fields: Mapping[str, Any]


def register_ext_component(request: Mapping[str, Any]) -> Reply:
    """No slot is free."""
    return Reply(
        "register_ext_component_reply",
        {
            "request_id": request["request_id"],
            "name": request["name"],
            "px4_ros2_api_version": API_VERSION,
            "success": False,
            "arming_check_id": NONE,
            "mode_id": NONE,
            "mode_executor_id": NONE,
            "not_user_selectable": request["not_user_selectable"],
        },
    )


def setpoint_config(request: Mapping[str, Any]) -> Reply:
    """There is no such mode."""
    fields = {"type": request["type"], "source_id": request["source_id"], "result": FAILURE_OTHER}
    return Reply("setpoint_config_reply", fields)


def message_format(request: Mapping[str, Any]) -> Reply:
    """The hash of the message of a topic, "/fmu/in/vehicle_command", if we know it."""
    fields: dict[str, Any] = {"protocol_version": FORMAT_PROTOCOL, "success": False}
    if request["protocol_version"] == FORMAT_PROTOCOL:
        told: bytes = request["topic_name"]
        fields["topic_name"] = told
        path, end, _ = told.partition(b"\0")
        _, slash, name = path.rpartition(b"/")
        kind = TYPES.get(name.decode(errors="replace"))
        if end and slash and kind is not None:
            fields |= {"message_hash": MESSAGES[kind].hash, "success": True}
    return Reply("message_format_response", fields)
