"""listener: prints topics (PX4: systemcmds/topic_listener).

Topics that are logged are printed with all of PX4's fields, the others with those of this autopilot
(autopilot/topics/).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import Any

from sitl_emu.autopilot.logger import logged_topics, packing
from sitl_emu.autopilot.shell import message_text
from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, WAIT, Output, Vehicle, integer, usage
from sitl_emu.autopilot.topics import Topics, topic_names

PATIENCE_US = 2_000_000
COMMANDS = (("TOPIC", "print it; -n how many, -r at most so many a second, -i instance"),)
OPTIONS = ("-n", "-r", "-i")
SECONDS_OF_RATE = 30
"""With a rate and no number so many seconds are printed (listener_main)."""
CLEAR_SCREEN = "\033[2J\n\033[H"
"""Ahead of each of several messages."""
NOT_FOUND = -1
Source = Callable[[Topics], Any]


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
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
    sources = _sources(vehicle)
    count = options["-n"] or (SECONDS_OF_RATE * hz if hz > 0 else 1)
    if (name, 0) not in sources:
        yield f"Topic {name} did not match any known topics\n"
        return NOT_FOUND
    if count == 1 and instance < 0:
        yield from _of_all_instances(vehicle, name, sources)
        return SUCCESS
    source = sources.get((name, max(instance, 0)))
    if source is None or _timestamp(source(vehicle.topics)) == 0:
        yield "never published\n"
        return SUCCESS
    interval_us = 1_000_000 // hz if hz > 0 else 0
    return (yield from _follow(vehicle, name, max(instance, 0), source, count, interval_us))


def _of_all_instances(vehicle: Vehicle, name: str, sources: Mapping[tuple[str, int], Source]) -> Iterator[str]:
    found = {number: source(vehicle.topics) for (topic, number), source in sorted(sources.items()) if topic == name}
    records = {number: record for number, record in found.items() if _timestamp(record)}
    if not records:
        yield "never published\n"
        return
    several = len(records) > 1
    yield f"\nTOPIC: {name} {len(records)} instances\n" if several else f"\nTOPIC: {name}\n"
    for number, record in records.items():
        if several:
            yield f"\nInstance {number}:\n"
        yield from _message(vehicle, name, record)


def _follow(vehicle: Vehicle, name: str, instance: int, source: Source, count: int, interval_us: int) -> Output:
    last, printed_us = None, vehicle.now_us - interval_us
    number = 0
    while number < count:
        record = source(vehicle.topics)
        now_us = vehicle.now_us
        if record is not last and now_us - printed_us >= interval_us:
            last, printed_us = record, now_us
            number += 1
            if count > 1:
                yield CLEAR_SCREEN
            yield f"\nTOPIC: {name} instance {instance} #{number}\n"
            yield from _message(vehicle, name, record)
        elif now_us - printed_us > PATIENCE_US + interval_us:
            yield "Waited for 2.0 seconds without a message. Giving up.\n"
            return SUCCESS
        else:
            yield WAIT
    return SUCCESS


def _message(vehicle: Vehicle, name: str, record: Any) -> Iterator[str]:
    """With PX4's fields where we know them, that is for what is logged, else with our own."""
    yield f" {name}\n"
    logged = {topic.name: topic for topic in vehicle.logger.topics(logged_topics.EVERY_PROFILE)}.get(name)
    if logged is not None:
        fields = packing.unpacked(name, logged.row(record))
        if not hasattr(record, "timestamp"):
            fields[0] = ("uint64_t", "timestamp", vehicle.now_us)
        yield from message_text.lines(fields, vehicle.now_us)
        return
    records = record if isinstance(record, tuple) and not hasattr(record, "_fields") else (record,)
    for each in records:
        if each is not None:
            yield from message_text.lines(message_text.fields_of(each), vehicle.now_us)


def _sources(vehicle: Vehicle) -> dict[tuple[str, int], Source]:
    """Where the record is, by PX4's name and instance."""
    own: dict[tuple[str, int], Source] = {(name, 0): attrgetter(name) for name in topic_names(vehicle.topics)}
    logged = vehicle.logger.topics(logged_topics.EVERY_PROFILE)
    return own | {(topic.name, topic.instance): topic.record for topic in logged}


def _timestamp(record: Any) -> int:
    """When it was published; a record without a time counts as published."""
    return int(getattr(record, "timestamp", 1))
