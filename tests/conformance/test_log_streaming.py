"""Log streaming: a ULog over MAVLink while it is written."""

from collections.abc import Iterator
from typing import Any

import pytest

LOGGING_START, LOGGING_STOP = 2510, 2511
ACCEPTED, UNSUPPORTED, IN_PROGRESS = 0, 3, 5
ULOG_MAGIC = bytes.fromhex("554c6f67011235")
FILE_HEADER_BYTES, MESSAGE_HEADER_BYTES = 16, 3
DATA_BYTES = 249
SUBSCRIPTION = ord("A")
LIMIT_S = 30.0
PAGE = "https://docs.px4.io/main/en/dev_log/logging"
MESSAGE_PAGE = "https://mavlink.io/en/messages/common.html"

pytestmark = pytest.mark.covers("MAV_CMD_LOGGING_START", "MAV_CMD_LOGGING_STOP", source=PAGE)


def command(station: Any, number: int, param1: float = 0.0, limit_s: float = 5.0) -> list[int]:
    """Results up to the one that is final."""
    station.mav.command_long_send(station.system, 1, number, 0, param1, *(0.0,) * 6)
    found: list[int] = []
    while (ack := station.receive("COMMAND_ACK", limit_s)) is not None:
        if ack.command == number:
            found.append(ack.result)
            if ack.result != IN_PROGRESS:
                break
    return found


@pytest.fixture
def idle(station: Any) -> Iterator[None]:
    """No stream runs, before and after."""
    assert command(station, LOGGING_STOP, limit_s=8.0)[-1:] == [ACCEPTED]
    yield
    command(station, LOGGING_STOP, limit_s=8.0)
    station.collect("LOGGING_DATA", 0.2)


def definitions(station: Any) -> tuple[list[Any], Any]:
    """The acknowledged chunks of a stream that was started, and the first one that needs none."""
    chunks: list[Any] = []
    while (chunk := station.receive(["LOGGING_DATA_ACKED", "LOGGING_DATA"], LIMIT_S)) is not None:
        if chunk.get_type() == "LOGGING_DATA":
            return chunks, chunk
        station.mav.logging_ack_send(station.system, 1, chunk.sequence)
        if not chunks or chunk.sequence != chunks[-1].sequence:
            chunks.append(chunk)
    raise AssertionError("no LOGGING_DATA came")


def message_kinds(log: bytes) -> list[int]:
    kinds, at = [], FILE_HEADER_BYTES
    while at + MESSAGE_HEADER_BYTES <= len(log):
        kinds.append(log[at + 2])
        at += MESSAGE_HEADER_BYTES + int.from_bytes(log[at : at + 2], "little")
    return kinds


@pytest.mark.covers("LOGGING_DATA_ACKED", "LOGGING_ACK", "LOGGING_DATA", source=f"{MESSAGE_PAGE}#LOGGING_DATA_ACKED")
def test_a_stream_begins_with_acknowledged_definitions(station: Any, idle: None) -> None:
    assert command(station, LOGGING_START) == [ACCEPTED]
    chunks, data = definitions(station)
    assert [chunk.sequence for chunk in chunks] == list(range(len(chunks)))
    assert data.sequence >= len(chunks)  # what the logger wrote meanwhile and nobody took is lost
    assert {(chunk.target_system, chunk.target_component) for chunk in chunks} == {(255, 190)}
    assert {chunk.length for chunk in chunks[:-1]} == {DATA_BYTES}
    assert chunks[0].first_message_offset == 0
    log = b"".join(bytes(chunk.data[: chunk.length]) for chunk in chunks)
    assert log[:7] == ULOG_MAGIC
    kinds = message_kinds(log)
    assert kinds[0] == ord("B")
    assert {ord("F"), ord("I"), ord("P"), SUBSCRIPTION} <= set(kinds)
    assert command(station, LOGGING_STOP) == [IN_PROGRESS, ACCEPTED]


@pytest.mark.covers("LOGGING_DATA_ACKED", source=f"{MESSAGE_PAGE}#LOGGING_DATA_ACKED")
def test_a_chunk_that_is_not_acknowledged_comes_again(station: Any, idle: None) -> None:
    assert command(station, LOGGING_START) == [ACCEPTED]
    chunks = station.collect("LOGGING_DATA_ACKED", 1.0, at_least=6)
    assert len(chunks) > 5
    assert {chunk.sequence for chunk in chunks} == {0}


@pytest.mark.covers(
    source="PX4 src/modules/logger/logger.cpp: while the logger waits for an acknowledgement it answers no command"
)
def test_commands_wait_while_nothing_is_acknowledged(station: Any, idle: None) -> None:
    assert command(station, LOGGING_START) == [ACCEPTED]
    assert command(station, LOGGING_STOP, limit_s=1.0) == []


def test_a_format_other_than_ulog_is_not_supported(station: Any, idle: None) -> None:
    assert command(station, LOGGING_START, 1.0) == [UNSUPPORTED]
