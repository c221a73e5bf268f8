"""ROS 2's own messages: the layout that a ROS 2 Jazzy has, by its own hashes, and the bytes that Cyclone DDS writes."""

import importlib
import random
import struct
from typing import Any

import pytest

from sitl_emu.run.ros import messages
from sitl_emu.run.ros.messages import MESSAGES, ONE, SEQUENCE

make_ros_messages = importlib.import_module("tools.make_ros_messages")
HASHES = {
    "builtin_interfaces/Time": "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
    "rosgraph_msgs/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "sensor_msgs/CameraInfo": "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
    "sensor_msgs/CompressedImage": "15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
    "sensor_msgs/Image": "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "sensor_msgs/PointCloud2": "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "std_msgs/Header": "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    "tf2_msgs/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
"""As ROS 2 installations tell them (`ros2 topic info -v`), in public repositories that quote them. LaserScan and
Detection2DArray were not found there, of Range the beginning alone."""
RANGE_BEGINS = "RIHS01_b42b6256"
VALUES = {"bool": True, "string": "some text", "float32": 2.5, "float64": 0.1}


@pytest.mark.parametrize("message", sorted(HASHES))
def test_a_real_ros_2_has_the_same_layout(message: str) -> None:
    assert messages.type_hash(message) == f"RIHS01_{HASHES[message]}"


def test_range_is_that_of_ros_2_from_iron_on() -> None:
    """Older ones have no `variance`, the last field, which they do not read."""
    assert messages.type_hash("sensor_msgs/Range").startswith(RANGE_BEGINS)


def test_a_definition_becomes_fields() -> None:
    text = "# of a thing\nuint8 FLAT = 1\nHeader header\nfloat64 x 0\nInner[] many # of them\nfloat32[4] q\n"
    assert make_ros_messages.fields(text, "some_msgs") == [
        "std_msgs/Header header",
        "float64 x",
        "some_msgs/Inner[] many",
        "float32[4] q",
    ]
    with pytest.raises(ValueError, match="not a field"):
        make_ros_messages.fields("string<=10 name", "some_msgs")


def filled(message: str, chance: random.Random) -> dict[str, Any]:
    """Something in every field; sequences of 0 to 3."""

    def one(kind: str) -> Any:
        if kind in MESSAGES:
            return filled(kind, chance)
        return VALUES[kind] if kind in VALUES else chance.randrange(100)

    def value(kind: str, length: int) -> Any:
        if length == ONE:
            return one(kind)
        count = chance.randrange(4) if length == SEQUENCE else length
        several = [one(kind) for _ in range(count)]
        return bytes(several) if kind == "uint8" else several

    return {name: value(kind, length) for kind, length, name in MESSAGES[message]}


@pytest.mark.parametrize("message", sorted(MESSAGES))
def test_every_message_is_written_as_cyclone_writes_it(message: str) -> None:
    pytest.importorskip("cyclonedds", reason="needs the extra ros2")
    from sitl_emu.run.ros.publisher import described

    def theirs(kind: str, values: dict[str, Any]) -> Any:
        told = {}
        for of, length, name in MESSAGES[kind]:
            value = values[name]
            if of in MESSAGES:
                value = theirs(of, value) if length == ONE else [theirs(of, each) for each in value]
            told[name] = list(value) if isinstance(value, bytes) else value
        return described(kind)(**told)

    for seed in range(5):
        values = filled(message, random.Random(f"{message} {seed}"))
        data = theirs(message, values).serialize(use_version_2=False)
        assert data[:4] == b"\0\1\0\0"
        assert messages.written(message, values) == data[4:]


def test_a_message_byte_for_byte() -> None:
    """A range, told by hand: a string that ends anywhere, a byte, and floats at multiples of four."""
    header = {"stamp": {"sec": 5, "nanosec": 6}, "frame_id": "a/b"}
    fields = {"radiation_type": 1, "field_of_view": 0.5, "min_range": 0.1, "max_range": 40.0, "range": 3.0}
    data = messages.written("sensor_msgs/Range", {"header": header, **fields, "variance": 0.25})
    assert data == struct.pack("<iII4sB3x5f", 5, 6, 4, b"a/b\0", 1, 0.5, 0.1, 40.0, 3.0, 0.25)


def test_what_is_no_such_message_is_not_written() -> None:
    for values in ({}, {"clock": {"sec": 1}}):
        with pytest.raises(KeyError):
            messages.written("rosgraph_msgs/Clock", values)
    with pytest.raises(struct.error):
        messages.written("builtin_interfaces/Time", {"sec": 1, "nanosec": -1})
    info = filled("sensor_msgs/CameraInfo", random.Random(1)) | {"k": (1.0,) * 8}
    with pytest.raises(ValueError, match="8 values, not 9"):
        messages.written("sensor_msgs/CameraInfo", info)
