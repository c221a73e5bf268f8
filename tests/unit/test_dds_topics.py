"""What ROS 2 hears: names as PX4's client makes them, fields as the logger has them, bytes as CDR demands."""

import importlib
import struct

import pytest

from sitl_emu.autopilot.logger import packing, ulog
from sitl_emu.autopilot.uxrce_dds_client import cdr, dds_topics
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES, PUBLICATIONS, SUBSCRIPTIONS
from sitl_emu.core.c_types import STRUCT_CODES

make_dds_topics = importlib.import_module("tools.make_dds_topics")
make_log_formats = importlib.import_module("tools.make_log_formats")
DEFINITION = """
# A message.
uint32 MESSAGE_VERSION = 3
uint8 ORB_QUEUE_LENGTH = 4
uint64 timestamp # us
bool valid
float32[4] q
Inner[2] within
uint8 tail
"""
INNER = "uint64 timestamp\nfloat64 lat\nchar[3] name\n"
YAML = """
publications:
  - topic: /fmu/out/outer
    type: px4_msgs::msg::Outer
    rate_limit: 50.
  - topic: /fmu/out/other
    type: px4_msgs::msg::Inner
subscriptions:
  - topic: /fmu/in/inner
    type: px4_msgs::msg::Inner
subscriptions_multi:
"""


def logged_topic(message: str) -> str:
    return str(make_log_formats.snake_case(message))


LOGGED = sorted(name for name in MESSAGES if logged_topic(name) in packing.FORMATS)


def test_a_definition_becomes_a_row() -> None:
    assert make_dds_topics.message(DEFINITION) == {
        "version": 3,
        "queue": 4,
        "fields": "uint64 timestamp; bool valid; float32[4] q; Inner[2] within; uint8 tail",
    }
    with pytest.raises(ValueError, match="not a field"):
        make_dds_topics.message("uint64")


def test_a_table_is_made_from_topics_and_definitions() -> None:
    many = {"topic": "/fmu/in/many", "type": "px4_msgs::msg::Inner", "route_field": "id", "max_instances": 4}
    rows = YAML.replace("subscriptions_multi:", f"subscriptions_multi: [{many}]")
    table = make_dds_topics.table("here", rows, {"Outer": DEFINITION, "Inner": INNER}.__getitem__)
    assert table["source"] == "here"
    assert table["publications"] == [
        {"topic": "outer", "type": "Outer", "interval_ms": 20},
        {"topic": "other", "type": "Inner", "interval_ms": 4},
    ]
    inner = {"topic": "inner", "type": "Inner"}
    assert table["subscriptions"] == [inner, {"topic": "many", "type": "Inner", "instances": 4}]
    assert list(table["messages"]) == ["Inner", "Outer"]


def test_a_hash_counts_the_fields_of_messages_within() -> None:
    """FNV-1a over "type name" lines; of an empty text it is the basis."""
    inner = {"Inner": {"fields": "uint8 a"}}
    alone = make_dds_topics.format_hash("uint8 a", inner)
    value = 0x811C9DC5
    for letter in b"uint8 a\n":
        value = (value ^ letter) * 0x1000193 % 2**32
    assert alone == value
    assert make_dds_topics.format_hash("Inner b", inner) != make_dds_topics.format_hash(
        "Inner b", {"Inner": {"fields": "uint8 c"}}
    )


def test_topics_bear_the_names_that_ros_gives_them() -> None:
    topics = {topic.name: topic for topic in (*PUBLICATIONS, *SUBSCRIPTIONS)}
    name = dds_topics.dds_name
    assert name(topics["sensor_combined"], "out") == "rt/fmu/out/sensor_combined"
    assert name(topics["vehicle_status"], "out") == "rt/fmu/out/vehicle_status_v4"
    assert name(topics["vehicle_command_ack"], "out", "px4_2") == "rt/px4_2/fmu/out/vehicle_command_ack_v1"
    assert name(topics["offboard_control_mode"], "in", "px4_1") == "rt/px4_1/fmu/in/offboard_control_mode"
    assert dds_topics.dds_type("VehicleStatus") == "px4_msgs::msg::dds_::VehicleStatus_"
    assert [dds_topics.namespace(instance) for instance in (0, 1, 12)] == ["", "px4_1", "px4_12"]


def test_rates_are_those_of_the_list() -> None:
    intervals = {topic.name: topic.interval_us for topic in PUBLICATIONS}
    assert intervals["sensor_combined"] == 4_000
    assert intervals["vehicle_odometry"] == 10_000
    assert intervals["vehicle_attitude"] == 20_000
    assert intervals["battery_status"] == 1_000_000


def test_the_log_knows_most_of_them() -> None:
    assert len(LOGGED) > 25
    assert {"VehicleStatus", "VehicleLocalPosition", "SensorGps", "PositionSetpointTriplet"} <= set(LOGGED)


@pytest.mark.parametrize("name", LOGGED)
def test_fields_are_those_that_the_log_has(name: str) -> None:
    """The logger's table was made from PX4's definitions by itself: names, types, and order by size, largest first."""
    topic = logged_topic(name)

    def size(kind: str) -> int:
        return struct.calcsize(f"<{cdr.CODES[kind]}") if kind in cdr.CODES else 0

    by_size = sorted(MESSAGES[name].fields, key=lambda field: -size(field[0]))
    logged = [(*ulog.array_length(kind), field) for kind, field in packing.FORMATS[topic]]
    for (kind, length, field), (logged_kind, logged_length, logged_field) in zip(by_size, logged, strict=True):
        assert (field, length) == (logged_field, logged_length)
        if kind in cdr.CODES:
            assert cdr.CODES[kind] == STRUCT_CODES[logged_kind]
        else:
            assert logged_topic(kind) == logged_kind
    values = sum(place.size for place in cdr.places(name))
    assert values == packing.size_of(topic) <= cdr.size(name)


def test_every_value_stands_at_a_multiple_of_its_size() -> None:
    for name in MESSAGES:
        end = 0
        for place in cdr.places(name):
            assert place.offset % struct.calcsize(f"<{place.code}") == 0
            assert end <= place.offset < end + 8
            end = place.offset + place.size


def test_a_message_on_the_wire_byte_for_byte() -> None:
    """VehicleCommand, told by hand: its two doubles after four floats, a uint16 between bytes."""
    data = struct.pack(
        "<Q4f2dfI3BxHB?",
        *(7, 1.0, 2.0, 3.0, 4.0, 47.4, 8.5, 30.0, 22, 1, 1, 255, 190, 0, True),
    )
    fields = cdr.Reader("VehicleCommand").read(data)
    assert len(data) == cdr.size("VehicleCommand")
    assert (fields["param5"], fields["param6"]) == (47.4, 8.5)
    assert (fields["command"], fields["source_component"], fields["from_external"]) == (22, 190, True)
    assert cdr.Writer("VehicleCommand").write(**fields) == data


def test_logged_data_is_rearranged_for_the_wire() -> None:
    places = cdr.log_places("vehicle_status")
    logged = bytearray(packing.size_of("vehicle_status"))
    struct.pack_into("<Q", logged, places["armed_time"].offset, 123)
    struct.pack_into("<I", logged, places["valid_nav_states_mask"].offset, 456)
    logged[places["nav_state"].offset] = 14
    fields = cdr.Reader("VehicleStatus").read(cdr.from_log("VehicleStatus", "vehicle_status")(bytes(logged)))
    told = {name: value for name, value in fields.items() if value}
    assert told == {"armed_time": 123, "valid_nav_states_mask": 456, "nav_state": 14}


def test_messages_within_messages_keep_their_places() -> None:
    writer, reader = cdr.Writer("PositionSetpointTriplet"), cdr.Reader("PositionSetpointTriplet")
    fields = reader.read(writer.write(timestamp=5, **{"current.lat": 47.4, "next.type": 3}))
    assert (fields["timestamp"], fields["current.lat"], fields["next.type"], fields["previous.lat"]) == (
        5,
        47.4,
        3,
        0.0,
    )
