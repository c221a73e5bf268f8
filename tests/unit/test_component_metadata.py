"""The metadata files: valid by their schemas, complete, and saying of each thing what our code does with it."""

import json
import lzma
import re
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from sitl_emu import autopilot, vehicles
from sitl_emu.autopilot import parameters
from sitl_emu.autopilot.events.events import table
from sitl_emu.autopilot.mavlink.component_metadata import (
    actuators,
    event_messages,
    events,
    files,
    parameter,
    parameter_codes,
    parameter_texts,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from tests.unit import metadata_schemas
from tests.unit.mavlink_peer import Peer, command_long, only

NO_PARAMETERS = ("MAV_CMD_", "PARAM_MAP_RC", "RADIO_STATUS", "HIL_GPS", "FLIGHT_INFORMATION", "_HASH_CHECK")
"""Names in texts that are MAVLink's."""
REQUEST_MESSAGE, COMPONENT_METADATA, COMPONENT_INFORMATION = 512, 397, 395


def unpacked(name: str) -> Any:
    return json.loads(lzma.decompress(files.tree()[f"etc/extras/{name}"]))


def all_events() -> dict[int, tuple[str, dict[str, Any]]]:
    """Group and entry of every event by its id."""
    return {
        int(component) << 24 | int(sub_id): (group, event)
        for component, row in events.content()["components"].items()
        for group, rows in row["event_groups"].items()
        for sub_id, event in rows["events"].items()
    }


@pytest.mark.parametrize(
    ("name", "schema"),
    [
        ("component_general.json.xz", metadata_schemas.GENERAL),
        ("parameters.json.xz", metadata_schemas.PARAMETER),
        ("all_events.json.xz", metadata_schemas.EVENTS),
        ("actuators.json.xz", metadata_schemas.ACTUATORS),
    ],
)
def test_every_file_is_valid(name: str, schema: dict[str, Any]) -> None:
    jsonschema.Draft7Validator(schema).validate(unpacked(name))


def test_the_general_file_lists_the_others_with_the_crc_of_what_is_sent() -> None:
    listed = unpacked("component_general.json.xz")["metadataTypes"]
    assert [(entry["type"], entry["uri"]) for entry in listed] == [
        (1, "mftp://etc/extras/parameters.json.xz"),
        (4, "mftp://etc/extras/all_events.json.xz"),
        (5, "mftp://etc/extras/actuators.json.xz"),
    ]
    for entry in listed:
        content = files.tree()[entry["uri"].removeprefix("mftp://")]
        assert entry["fileCrc"] == zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def test_the_messages_announce_the_general_file_and_its_crc() -> None:
    content = lzma.decompress(files.tree()["etc/extras/component_general.json.xz"])
    crc = zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF
    replies = Peer().send(command_long(REQUEST_MESSAGE, COMPONENT_METADATA))
    (metadata,) = only(replies, "COMPONENT_METADATA")
    assert (metadata.file_crc, metadata.uri) == (crc, "mftp://etc/extras/component_general.json.xz")
    replies = Peer().send(command_long(REQUEST_MESSAGE, COMPONENT_INFORMATION))
    (information,) = only(replies, "COMPONENT_INFORMATION")
    assert (information.general_metadata_file_crc, information.general_metadata_uri) == (crc, metadata.uri)


def test_parameters_are_described_with_bounds_units_and_codes() -> None:
    described = {entry["name"]: entry for entry in parameter.content()["parameters"]}
    assert set(described) == set(parameters.table())
    assert described["MPC_XY_CRUISE"] == {
        "name": "MPC_XY_CRUISE",
        "type": "Float",
        "default": 5.0,
        "group": "Multicopter Position Control",
        "min": 3.0,
        "max": 20.0,
        "increment": 1.0,
        "decimalPlaces": 0,
        "units": "m/s",
        "category": "Standard",
        "shortDesc": "Horizontal speed in automatic modes",
        "longDesc": "Speed of missions, returns and repositions that name none. It can't exceed MPC_XY_VEL_MAX.",
    }
    assert described["SYS_AUTOSTART"]["rebootRequired"] is True
    assert described["GF_ACTION"]["values"][2] == {"value": 2, "description": "Hold"}
    assert described["CA_ROTOR5_PX"]["shortDesc"] == "Place of rotor 5, forward"
    assert described["PWM_MAIN_FUNC16"]["values"][3] == {"value": 101, "description": "Motor 1"}
    assert described["SENS_BOARD_ROT"]["values"][2] == {"value": 2, "description": "Yaw 90"}
    assert described["COM_RCL_EXCEPT"]["bitmask"][1] == {"index": 1, "description": "Hold"}


@pytest.mark.parametrize("table", [parameter_texts.read(), parameter_codes.VALUES, parameter_codes.BITS])
def test_every_text_belongs_to_a_parameter(table: dict[str, Any]) -> None:
    for name in table:
        pattern = re.compile(re.escape(name).replace(r"\{n\}", r"\d+"))
        assert any(pattern.fullmatch(known) for known in parameters.table()), name


def announced() -> set[str]:
    """Parameters that any of our vehicles announces, those of modules that only some setups start too."""
    names = set()
    for model in vehicles.models():
        airframe = vehicles.load(model).airframe
        kind = VehicleKind.of_mav_type(airframe["MAV_TYPE"])
        for started in ({}, {"MNT_MODE_IN": 4, "TRIG_MODE": 1}):
            names |= set(parameters.Parameters(kind, {**airframe, **started}).announced)
    return names


def test_every_parameter_that_a_vehicle_announces_has_a_short_and_a_long_text() -> None:
    described = {entry["name"]: entry for entry in parameter.content()["parameters"]}
    for name in announced():
        short, long = described[name]["shortDesc"], described[name]["longDesc"]
        assert 0 < len(short) < 60, name
        assert not short.endswith("."), name
        assert short[0].isupper(), name
        assert long.endswith("."), name
        assert len(long) > len(short) or len(long) > 30, name
        assert 1 <= len(re.findall(r"[.!?](?: |$)", long)) <= 4, name
        assert "{" not in short + long, name


def test_no_two_parameters_have_the_same_text_unless_they_are_a_numbered_family() -> None:
    texts = parameter_texts.read().values()
    for part in (Counter(text.short for text in texts), Counter(text.long for text in texts)):
        assert [text for text, count in part.items() if count > 1] == []


def test_texts_name_only_parameters_that_px4_has() -> None:
    known = parameters.table()
    for name, text in parameter_texts.read().items():
        for mentioned in re.findall(r"\b[A-Z][A-Z0-9]*\d?_[A-Z0-9_{}n*]+", text.short + " " + text.long):
            pattern = re.compile(re.sub(r"\\\{n\\\}|\\\*|n(?=_)|n$", ".*", re.escape(mentioned)))
            ours = mentioned.startswith(NO_PARAMETERS) or any(map(pattern.fullmatch, known))
            assert ours, f"{name}: {mentioned}"


def test_every_code_and_bit_of_an_announced_parameter_has_a_meaning() -> None:
    for name in announced():
        row = parameters.table()[name]
        assert set(row.get("values", ())) <= set(parameter_codes.values(name)), name
        assert set(row.get("bits", ())) <= set(parameter_codes.bits(name)), name


def test_every_event_of_px4_is_there() -> None:
    known = table()["events"]
    described = all_events()
    assert {row["id"] for row in known.values()} == set(described)
    assert described[26266355] == (
        "default",
        {
            "name": "commander_armed_by",
            "message": "Armed by {1}",
            "arguments": [{"name": "arg0", "type": "px4::arm_disarm_reason_t"}],
        },
    )


def test_the_arming_checks_can_be_taken_apart_as_libevents_does() -> None:
    px4 = events.content()["components"]["1"]
    summary = next(e for _, e in all_events().values() if e["name"] == "commander_arming_check_summary")
    assert summary["type"] == "summary"
    kinds = [argument["type"] for argument in summary["arguments"]]
    assert kinds == ["uint8_t", *["px4::health_component_t"] * 2, *["px4::navigation_mode_group_t"] * 2]
    components = px4["enums"]["health_component_t"]
    assert components["is_bitfield"] and components["entries"]["1"]["name"] == "none"
    modes = px4["enums"]["navigation_mode_group_t"]["entries"]
    assert {1 << int(group) for group in px4["navigation_mode_groups"]["groups"]} == {int(bit) for bit in modes}
    assert px4["navigation_mode_groups"]["groups"]["2"] == [196608]
    for group, event in all_events().values():
        if group in ("health", "arming_check") and "type" not in event:
            assert [a["type"] for a in event["arguments"][:2]] == ["navigation_mode_group_t", "uint8_t"], event


def test_arguments_have_types_that_are_known() -> None:
    content = events.content()["components"]
    base = {*metadata_schemas.BASE_TYPES, "float"}
    for number, component in content.items():
        own = set(component["enums"])
        px4 = {f"px4::{name}" for name in content["1"]["enums"]}
        for identity, (_, event) in all_events().items():
            if identity >> 24 == int(number):
                assert {a["type"] for a in event.get("arguments", ())} <= base | own | px4, event


def test_messages_name_events_that_exist_and_arguments_that_they_have() -> None:
    known = {event["name"]: event for _, event in all_events().values()}
    for name in (*event_messages.MESSAGES, *event_messages.SUMMARIES, *event_messages.APPEND_CHECKS):
        assert name in known, name
    for event in known.values():
        for place in re.findall(r"\{(.*?)\}", event["message"]):
            form = re.fullmatch(r"(\d+)(:\.\d(m|m_v|m\^2|m/s|C)?)?", place)
            assert form is not None, event
            assert 1 <= int(form[1]) <= len(event.get("arguments", ())), event


def test_every_event_that_is_sent_has_a_message() -> None:
    sources = set(Path(autopilot.__file__).parent.rglob("*.py")) - {Path(event_messages.__file__)}
    named = {name for path in sources for name in re.findall(r'"(\w+)"', path.read_text())}
    sent = named & {entry["name"] for _, entry in all_events().values()}
    assert len(sent) > 50 and not sent - event_messages.MESSAGES.keys()


def test_the_actuators_page_finds_its_parameters() -> None:
    content = actuators.content()
    known = set(parameters.table())
    (output,) = content["outputs_v1"][0]["subgroups"]
    for channel in output["channels"]:
        for row in output["per-channel-parameters"]:
            assert row["name"].replace("${i}", str(channel["param-index"])) in known
    for kind in ("motor", "servo"):
        for row in content["mixer_v1"]["actuator-types"][kind]["per-item-parameters"]:
            assert row["name"].replace("${i}", "11") in known
    for config in content["mixer_v1"]["config"]:
        for group in config["actuators"]:
            assert group["count"] == 1 or group["count"] in known
            for row in group["per-item-parameters"]:
                assert row["name"].replace("${i}", "0") in known
    assert set(parameters.table()["PWM_MAIN_FUNC1"]["values"]) == {int(code) for code in content["functions_v1"]}
