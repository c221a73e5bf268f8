"""Our bytes are CDR's: Cyclone DDS writes and reads the same, by types of its own."""

import random
from typing import Any

import pytest

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import MESSAGES

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

from cyclonedds.idl import make_idl_struct, types

from sitl_emu.run import dds_types

WHOLE = {"b": 7, "h": 15, "i": 31, "q": 63, "B": 8, "H": 16, "I": 32, "Q": 64}
"""Bits of a number's size, without the sign."""


def value(code: str, chance: random.Random) -> Any:
    if code in WHOLE:
        return chance.getrandbits(WHOLE[code])
    return {"f": float(chance.randrange(999)), "d": chance.random(), "?": chance.random() < 0.5}[code]


def filled(message: str, prefix: str, fields: dict[str, Any], chance: random.Random) -> Any:
    """A message of Cyclone's with something in every field, which is noted in `fields`."""
    told = {}
    for kind, length, name in MESSAGES[message].fields:
        if kind not in cdr.CODES:
            parts = [
                filled(kind, f"{prefix}{name}{f'[{n}]' if length > 1 else ''}.", fields, chance) for n in range(length)
            ]
            told[name] = parts if length > 1 else parts[0]
            continue
        code = "B" if kind == "char" else cdr.CODES[kind]
        values = [value(code, chance) for _ in range(length)]
        told[name] = values if length > 1 else values[0]
        fields[prefix + name] = bytes(values) if kind == "char" else told[name]
    return dds_types.described(message)(**told)


@pytest.mark.parametrize("message", sorted(MESSAGES))
def test_every_message_is_written_as_cyclone_writes_it(message: str) -> None:
    fields: dict[str, Any] = {}
    theirs = filled(message, "", fields, random.Random(message))
    data = theirs.serialize(use_version_2=False)
    ours = cdr.Writer(message).write(**fields)
    assert data[:4] == cdr.HEADER
    assert data[4:] == ours
    assert cdr.Reader(message).read(ours) == {
        path: tuple(told) if isinstance(told, list) else told for path, told in fields.items()
    }
    assert dds_types.carried(message).__idl_typename__ == f"px4_msgs.msg.dds_.{message}_"


VECTOR = types.array[types.float32, 3]
OFFBOARD_CONTROL_MODE = make_idl_struct(
    "OffboardControlMode",
    "px4_msgs.msg.dds_.OffboardControlMode_",
    {
        "timestamp": types.uint64,
        "position": bool,
        "velocity": bool,
        "acceleration": bool,
        "attitude": bool,
        "body_rate": bool,
        "thrust_and_torque": bool,
        "direct_actuator": bool,
    },
)
TRAJECTORY_SETPOINT = make_idl_struct(
    "TrajectorySetpoint",
    "px4_msgs.msg.dds_.TrajectorySetpoint_",
    {
        "timestamp": types.uint64,
        "position": VECTOR,
        "velocity": VECTOR,
        "acceleration": VECTOR,
        "jerk": VECTOR,
        "yaw": types.float32,
        "yawspeed": types.float32,
    },
)
"""By hand, as px4_msgs has them."""


def test_messages_that_were_told_by_hand_are_read() -> None:
    mode = OFFBOARD_CONTROL_MODE(5, False, True, False, False, False, False, True)
    read = cdr.Reader("OffboardControlMode").read(mode.serialize()[4:])
    assert {name for name, told in read.items() if told is True} == {"velocity", "direct_actuator"}
    setpoint = TRAJECTORY_SETPOINT(6, [1, 2, 3], [4, 5, 6], [7, 8, 9], [0, 0, 0], 0.5, 0.25)
    read = cdr.Reader("TrajectorySetpoint").read(setpoint.serialize()[4:])
    assert (read["position"], read["acceleration"], read["yawspeed"]) == ((1, 2, 3), (7, 8, 9), 0.25)
