"""Component metadata: where it is announced, and the files that a ground station then fetches over FTP."""

import functools
import itertools
import json
import lzma
import struct
import zlib
from typing import Any

import pytest

REQUEST_MESSAGE = 512
COMPONENT_INFORMATION, COMPONENT_METADATA = 395, 397
PARAMETER, EVENTS, ACTUATORS = 1, 4, 5
GENERAL = "mftp://etc/extras/component_general.json.xz"
RESET, OPEN_RO, READ, ACK = 2, 4, 5, 128
LARGEST = 239
SEQUENCES = itertools.count(40_001, 2)
PAGE = "https://mavlink.io/en/services/component_information.html"

pytestmark = pytest.mark.covers("COMPONENT_METADATA", source=PAGE)


def ask(station: Any, opcode: int, data: bytes = b"", offset: int = 0, size: int | None = None) -> bytes:
    """The data of an ACK."""
    sequence = next(SEQUENCES)
    head = struct.pack("<HBBBBBBI", sequence, 0, opcode, len(data) if size is None else size, 0, 0, 0, offset)
    station.mav.file_transfer_protocol_send(0, station.system, 1, (head + data).ljust(251, b"\0"))
    message = station.receive("FILE_TRANSFER_PROTOCOL")
    assert message is not None
    raw = bytes(message.payload)
    assert raw[3] == ACK
    return raw[12 : 12 + raw[4]]


@functools.cache
def fetched(station: Any, uri: str) -> bytes:
    """A file as it is sent, packed."""
    ask(station, RESET)
    size = struct.unpack("<I", ask(station, OPEN_RO, uri.removeprefix("mftp://").encode()))[0]
    content = b""
    while len(content) < size:
        content += ask(station, READ, offset=len(content), size=LARGEST)
    ask(station, RESET)
    return content


def unpacked(station: Any, uri: str) -> bytes:
    """What a file unpacks to."""
    return lzma.decompress(fetched(station, uri))


def crc(content: bytes) -> int:
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


def announced(station: Any, number: int, head: str) -> tuple[tuple[Any, ...], str]:
    """The fields before the URI, and the URI; pymavlink's `common` leaves out both messages."""
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, number, 0, 0, 0, 0, 0, 0)
    message = station.receive(f"UNKNOWN_{number}")
    assert message is not None
    frame = bytes(message.get_msgbuf())
    payload = frame[10 : 10 + frame[1]].ljust(255, b"\0")
    return struct.unpack_from(head, payload), payload[struct.calcsize(head) :].split(b"\0")[0].decode()


def metadata(station: Any, kind: int) -> Any:
    (entry,) = (entry for entry in json.loads(unpacked(station, GENERAL))["metadataTypes"] if entry["type"] == kind)
    return json.loads(unpacked(station, entry["uri"]))


@pytest.mark.covers(
    "COMPONENT_INFORMATION",
    "MAV_CMD_REQUEST_MESSAGE",
    source="measured identity/COMPONENT_INFORMATION, identity/COMPONENT_METADATA: both messages say the same",
)
def test_the_general_file_is_announced_with_the_crc_of_what_it_unpacks_to(station: Any) -> None:
    content = crc(unpacked(station, GENERAL))
    (_, file_crc), uri = announced(station, COMPONENT_METADATA, "<II")
    assert (uri, file_crc) == (GENERAL, content)
    (_, file_crc, peripherals_crc), uri = announced(station, COMPONENT_INFORMATION, "<III")
    assert (uri, file_crc, peripherals_crc) == (GENERAL, content, 0)


@pytest.mark.covers(source="PX4 src/lib/component_information/generate_component_general.py")
def test_the_general_file_lists_the_others_with_the_crc_of_what_is_sent(station: Any) -> None:
    listed = json.loads(unpacked(station, GENERAL))["metadataTypes"]
    assert {entry["type"] for entry in listed} >= {PARAMETER, EVENTS, ACTUATORS}
    for entry in listed:
        assert entry["fileCrc"] == crc(fetched(station, entry["uri"]))


@pytest.mark.covers(
    "PARAM_VALUE",
    source="PX4 src/modules/mc_pos_control/multicopter_autonomous_params.yaml: type and default of PX4's parameters",
)
def test_parameters_are_described(station: Any) -> None:
    content = metadata(station, PARAMETER)
    assert content["version"] == 1
    described = {row["name"]: row for row in content["parameters"]}
    assert len(described) > 1500
    cruise = described["MPC_XY_CRUISE"]
    fields = ("type", "default", "min", "max", "units", "group")
    assert [cruise[field] for field in fields] == ["Float", 5.0, 3.0, 20.0, "m/s", "Multicopter Position Control"]
    assert described["SYS_AUTOSTART"]["rebootRequired"] is True
    assert [row["value"] for row in described["GF_ACTION"]["values"]] == [0, 1, 2, 3, 4, 5]


@pytest.mark.covers("EVENT", source="https://mavlink.io/en/services/events.html")
def test_events_are_described(station: Any) -> None:
    content = metadata(station, EVENTS)
    px4 = content["components"]["1"]
    assert (content["version"], px4["namespace"]) == (2, "px4")
    armed = px4["event_groups"]["default"]["events"][str(26266355 & 0xFFFFFF)]
    assert (armed["name"], armed["arguments"][0]["type"]) == ("commander_armed_by", "px4::arm_disarm_reason_t")
    checks = px4["event_groups"]["arming_check"]["events"].values()
    (summary,) = (event for event in checks if event.get("type") == "summary")
    assert len(summary["arguments"]) == 5
    assert px4["navigation_mode_groups"]["groups"]["2"] == [196608]  # Position
    assert px4["enums"]["health_component_t"]["entries"]["1"]["name"] == "none"


@pytest.mark.covers("MAV_CMD_ACTUATOR_TEST", source="https://mavlink.io/en/services/component_information.html")
def test_actuators_are_described(station: Any) -> None:
    content = metadata(station, ACTUATORS)
    assert content["functions_v1"]["101"]["label"] == "Motor 1"
    motor = content["mixer_v1"]["actuator-types"]["motor"]
    assert (motor["function-min"], motor["function-max"]) == (101, 112)
    multirotor = next(row for row in content["mixer_v1"]["config"] if row["option"] == "CA_AIRFRAME==0")
    assert multirotor["actuators"][0]["count"] == "CA_ROTOR_COUNT"
    functions = [
        row["name"] for group in content["outputs_v1"] for row in group["subgroups"][0]["per-channel-parameters"]
    ]
    assert "PWM_MAIN_FUNC${i}" in functions
