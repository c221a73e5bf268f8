"""listener: prints topics (PX4: systemcmds/topic_listener).

Topics and their fields are this autopilot's (autopilot/topics.py), which has PX4's names, not all of PX4's fields.
"""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from autopilot.shell.command import FAILURE, SUCCESS, WAIT, Output, integer, usage

if TYPE_CHECKING:
    from autopilot.autopilot import Autopilot

PATIENCE_US = 2_000_000
QUATERNION = 4
COMMANDS = (("TOPIC", "print it; -n how many, -r at most so many a second, -i instance"),)
OPTIONS = ("-n", "-r", "-i")
MESSAGES_PER_RATE = 10


def main(autopilot: "Autopilot", arguments: Sequence[str]) -> Output:
    """`listener TOPIC [-n MESSAGES] [-r HZ] [-i INSTANCE]`."""
    options = {"-n": 0, "-r": 0, "-i": -1}
    names = []
    words = iter(arguments)
    for word in words:
        if word in OPTIONS:
            options[word] = integer(next(words, ""))
        else:
            names.append(word)
    if not names:
        yield usage("listener", COMMANDS)
        return FAILURE
    name, hz, instance = names[0], options["-r"], options["-i"]
    count = options["-n"] or (MESSAGES_PER_RATE * hz if hz > 0 else 1)
    if name.startswith("_") or not hasattr(autopilot.topics, name):
        yield " Topic did not match any known topics\n"
        return SUCCESS
    if instance > 0 or _timestamp(getattr(autopilot.topics, name)) == 0:
        yield "never published\n"
        return SUCCESS
    if count == 1 and instance < 0:
        yield f"\nTOPIC: {name}\n"
        yield from _record(autopilot.now_us, name, getattr(autopilot.topics, name))
        return SUCCESS
    return (yield from _follow(autopilot, name, count, 1_000_000 // hz if hz > 0 else 0))


def _follow(autopilot: "Autopilot", name: str, count: int, interval_us: int) -> Output:
    last, printed_us = None, autopilot.now_us - interval_us
    number = 0
    while number < count:
        record = getattr(autopilot.topics, name)
        now_us = autopilot.now_us
        if record is not last and now_us - printed_us >= interval_us:
            last, printed_us = record, now_us
            number += 1
            yield f"\nTOPIC: {name} instance 0 #{number}\n"
            yield from _record(now_us, name, record)
        elif now_us - printed_us > PATIENCE_US + interval_us:
            yield "Waited for 2 seconds without a message. Giving up.\n"
            return SUCCESS
        else:
            yield WAIT
    return SUCCESS


def _record(now_us: int, name: str, record: Any) -> Iterator[str]:
    yield f" {name}\n"
    records = record if isinstance(record, tuple) and not hasattr(record, "_fields") else (record,)
    for each in records:
        yield from _fields(now_us, each, "    ")


def _fields(now_us: int, record: Any, indent: str) -> Iterator[str]:
    for field, value in zip(record._fields, record, strict=True):
        if hasattr(value, "_fields"):
            yield f"{indent}{field}:\n"
            yield from _fields(now_us, value, indent + "    ")
        elif field == "timestamp":
            yield f"{indent}timestamp: {value} ({(now_us - value) * 1e-6:.6f} seconds ago)\n"
        else:
            yield f"{indent}{field}: {_text(value)}\n"
            if field in ("q", "q_d"):
                yield f"{indent}{' ' * len(field)}  ({_euler(value)})\n"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return f"{value:.5f}"
    if isinstance(value, tuple):
        return f"[{', '.join(_text(part) for part in value)}]"
    return str(value)


def _euler(q: Sequence[float]) -> str:
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return ", ".join(
        f"{name}: {math.degrees(angle):.1f} deg" for name, angle in (("Roll", roll), ("Pitch", pitch), ("Yaw", yaw))
    )


def _timestamp(record: Any) -> int:
    """When it was published; a record without a time counts as published."""
    return int(getattr(record, "timestamp", 1))
