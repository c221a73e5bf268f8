"""Event metadata (COMP_METADATA_TYPE_EVENTS): every event of this PX4, as libevents' parser reads it.

A ground station needs it to show events at all, and to tell from the groups `health` and `arming_check` why a vehicle
can't arm: the summaries' enums name components and modes, `navigation_mode_groups` says which modes a bit stands for.
"""

from typing import Any

from sitl_emu.autopilot.events.events import table
from sitl_emu.autopilot.mavlink.component_metadata import event_messages

VERSION = 2
COMPONENTS = {"common": 0, "px4": 1}
"""Namespaces and the component ids that stand in the uppermost byte of their events' ids."""
SUB_ID = 0xFFFFFF


def content() -> dict[str, Any]:
    """All events, PX4's and the common ones."""
    loaded = table()
    components: dict[str, dict[str, Any]] = {
        str(number): {"namespace": name, "enums": {}, "event_groups": {}} for name, number in COMPONENTS.items()
    }
    for full_name, row in loaded["enums"].items():
        namespace, _, name = full_name.partition("::")
        components[str(COMPONENTS[namespace])]["enums"][name] = _enum(row)
    for name, row in loaded["events"].items():
        groups = components[str(row["id"] >> 24)]["event_groups"]
        group = groups.setdefault(row["group"], {"events": {}})
        group["events"][str(row["id"] & SUB_ID)] = _event(name, row["arguments"])
    px4 = components[str(COMPONENTS["px4"])]
    px4["supported_protocols"] = ["health_and_arming_check"]
    px4["navigation_mode_groups"] = {"groups": loaded["groups"]}
    return {"version": VERSION, "components": components}


def _enum(row: dict[str, Any]) -> dict[str, Any]:
    entries = sorted((value, name) for name, value in row["entries"].items())
    return {
        "type": row["type"],
        **({"is_bitfield": True} if row["bitfield"] else {}),
        "entries": {str(value): {"name": name, "description": event_messages.entry(name)} for value, name in entries},
    }


def _event(name: str, arguments: list[list[str]]) -> dict[str, Any]:
    event: dict[str, Any] = {"name": name, "message": event_messages.message(name, len(arguments))}
    if name in event_messages.SUMMARIES:
        event["type"] = "summary"
    elif name in event_messages.APPEND_CHECKS:
        event["type"] = "append_health_and_arming_messages"
    if arguments:
        event["arguments"] = [{"name": argument, "type": kind} for argument, kind in arguments]
    return event
