"""Events interface: numbered events, their announcement, asking for them again, and the rounds of arming checks.

pymavlink's packaged dialects do not know these messages: their bytes are read and written here.
"""

import struct
from typing import Any, NamedTuple

import pytest
from pymavlink.dialects.v20 import common

ARM_DISARM, RUN_PREARM_CHECKS = 400, 401
EVENT, CURRENT, ERROR, REQUEST_EVENT = "UNKNOWN_410", "UNKNOWN_411", "UNKNOWN_413", 412
REQUEST_EVENT_CRC_EXTRA = 33
HEADER_BYTES = 10
EVENT_BYTES, CURRENT_BYTES, ERROR_BYTES = 53, 3, 7
ARMED, DISARMED = 26266355, 32794487
ARMING_CHECK_SUMMARY, HEALTH_SUMMARY = 27825120, 18691879
EXTERNAL_COMMAND = 4
INFO_INFO, PROTOCOL_PROTOCOL = 0x66, 0x88
UNAVAILABLE = 0
ANNOUNCE_S = 3.0
KEPT = 20
PAGE = "https://mavlink.io/en/services/events.html"


class Event(NamedTuple):
    """EVENT in the order of its bytes, arguments as the 40 bytes they are."""

    id: int
    time_boot_ms: int
    sequence: int
    component: int
    system: int
    log_levels: int
    arguments: bytes


class RequestEvent(common.MAVLink_message):  # type: ignore[misc]
    """REQUEST_EVENT of a range of sequence numbers."""

    def __init__(self, system: int, first: int, last: int) -> None:
        super().__init__(REQUEST_EVENT, "REQUEST_EVENT")
        self._payload = struct.pack("<HHBB", first % 65536, last % 65536, system, 1)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        return bytes(self._pack(mav, REQUEST_EVENT_CRC_EXTRA, self._payload, force_mavlink1))


def payload(message: Any, size: int) -> bytes:
    """Bytes of a message that pymavlink does not know, filled up to their full length."""
    frame = bytes(message.get_msgbuf())
    return frame[HEADER_BYTES : HEADER_BYTES + frame[1]].ljust(size, b"\0")


def event(message: Any) -> Event:
    """An EVENT."""
    return Event(*struct.unpack("<IIHBBB40s", payload(message, EVENT_BYTES)))


def newest(station: Any) -> int:
    """The newest sequence number, as it is announced."""
    message = station.receive(CURRENT, ANNOUNCE_S + 1.5)
    assert message is not None
    sequence, flags = struct.unpack("<HB", payload(message, CURRENT_BYTES))
    assert flags == 0
    return int(sequence)


def asked(station: Any, first: int, last: int) -> tuple[list[int], list[tuple[int, ...]]]:
    """Sequence numbers of the events that come for a request (others are news), and the errors."""
    station.mav.send(RequestEvent(station.system, first, last))
    found: list[int] = []
    errors: list[tuple[int, ...]] = []
    for message in station.collect([EVENT, ERROR], 1.0, at_least=(last - first) % 65536 + 1):
        if message.get_type() == EVENT:
            sequence = event(message).sequence
            if (sequence - first) % 65536 <= (last - first) % 65536:
                found.append(sequence)
        else:
            errors.append(struct.unpack("<HHBBB", payload(message, ERROR_BYTES)))
    return found, errors


@pytest.mark.covers("EVENT", "REQUEST_EVENT", source=PAGE)
@pytest.mark.covers(
    "EVENT", source="measured misc/event/arm_disarm/*: ids, log levels, reason and destination of the two events"
)
def test_arming_and_disarming_are_events_and_can_be_asked_for_again(station: Any) -> None:
    found = {}
    try:
        for param, number in ((1, ARMED), (0, DISARMED)):
            station.mav.command_long_send(station.system, 1, ARM_DISARM, 0, param, *(0.0,) * 6)
            while (message := station.receive(EVENT)) is not None:
                heard = event(message)
                if heard.id == number:
                    found[number] = heard
                    assert (heard.log_levels, heard.system, heard.component) == (INFO_INFO, 0, 0)
                    assert heard.arguments[0] == EXTERNAL_COMMAND
                    break
    finally:
        if DISARMED not in found:
            station.disarm()
    assert set(found) == {ARMED, DISARMED}
    assert asked(station, found[ARMED].sequence, found[ARMED].sequence) == ([found[ARMED].sequence], [])


@pytest.mark.covers("CURRENT_EVENT_SEQUENCE", "REQUEST_EVENT", source=PAGE)
@pytest.mark.covers(
    "CURRENT_EVENT_SEQUENCE",
    source="measured misc/event/current_sequence/flags, stream/gcs/disarmed/CURRENT_EVENT_SEQUENCE: every 3 s, flags 0",
)
def test_the_newest_number_is_announced_and_the_newest_events_are_still_there(station: Any) -> None:
    station.command(RUN_PREARM_CHECKS)
    station.collect(EVENT, 0.5)
    last = newest(station)
    first = (last - 2) % 65536
    assert asked(station, first, last) == ([first, (last - 1) % 65536, last], [])


@pytest.mark.covers("REQUEST_EVENT", "RESPONSE_EVENT_ERROR", source=PAGE)
@pytest.mark.covers(
    "RESPONSE_EVENT_ERROR", source="measured misc/event/request/future: reason 0 for what does not exist yet"
)
def test_an_event_that_is_not_there_is_an_error(station: Any) -> None:
    future = (newest(station) + 100) % 65536
    found, ((sequence, _, system, component, reason),) = asked(station, future, future)
    assert (found, sequence, reason) == ([], future, UNAVAILABLE)
    assert (system, component) == (255, 190)


@pytest.mark.covers(
    "EVENT", "MAV_CMD_RUN_PREARM_CHECKS", source="https://docs.px4.io/main/en/concept/events_interface.html"
)
@pytest.mark.covers(
    "EVENT",
    source="PX4 src/modules/commander/HealthAndArmingChecks/Common.cpp: a summary first, and one last",
)
def test_arming_checks_come_as_a_round_between_two_summaries(station: Any) -> None:
    station.collect(EVENT, 2.5)
    station.mav.command_long_send(station.system, 1, RUN_PREARM_CHECKS, 0, *(0.0,) * 7)
    events = [event(message) for message in station.collect(EVENT, 1.0, at_least=3)]
    assert (events[0].id, events[0].log_levels) == (ARMING_CHECK_SUMMARY, PROTOCOL_PROTOCOL)
    assert (events[-1].id, events[-1].log_levels) == (HEALTH_SUMMARY, PROTOCOL_PROTOCOL)
    assert len(events) > 2
    numbers = [each.sequence for each in events]
    assert numbers == [(numbers[0] + index) % 65536 for index in range(len(numbers))]
    _, error, warning, can_arm, can_run = struct.unpack("<BIIII", events[0].arguments[:17])
    told = {1 << each.arguments[4] for each in events[1:-1]}
    assert all(bit in told for bit in (1 << number for number in range(32)) if (error | warning) & bit)
    assert can_arm >> 4 & 1 and can_run >> 4 & 1  # HOLD, for a vehicle that is ready
