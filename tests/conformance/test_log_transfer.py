"""Log download: the list, data, requests that can't be met."""

from collections.abc import Iterator
from typing import Any

import pytest

ALL = 0xFFFF
BEYOND_ANY = 1 << 30
"""The log may be growing."""
PAGE = "https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST"
ULOG_MAGIC = bytes.fromhex("554c6f67011235")

pytestmark = pytest.mark.covers("LOG_REQUEST_LIST", "LOG_ENTRY", source=PAGE)


def entries(station: Any, start: int = 0, end: int = ALL) -> list[Any]:
    station.mav.log_request_list_send(station.system, 1, start, end)
    first = station.receive("LOG_ENTRY", 2.0)
    return [] if first is None else [first, *station.collect("LOG_ENTRY", 0.5)]


def data(station: Any, log: int, offset: int, count: int) -> list[Any]:
    station.mav.log_request_data_send(station.system, 1, log, offset, count)
    first = station.receive("LOG_DATA", 1.0)
    return [] if first is None else [first, *station.collect("LOG_DATA", 0.3)]


@pytest.fixture
def logs(station: Any) -> Iterator[list[Any]]:
    """The list; nothing is sent any more afterwards."""
    found = entries(station)
    if not found:
        pytest.skip("it has no logs: fly it once, or set SDLOG_MODE 1 and restart it")
    yield found
    station.mav.log_request_end_send(station.system, 1)


@pytest.mark.covers(source="measured misc/log/list/*: ids are consecutive from 0, last_log_num is num_logs")
def test_logs_are_listed_from_zero(logs: list[Any]) -> None:
    assert [entry.id for entry in logs] == list(range(len(logs)))
    assert {entry.num_logs for entry in logs} == {len(logs)}
    assert {entry.last_log_num for entry in logs} == {len(logs)}
    assert all(entry.size > 0 and entry.time_utc > 1_500_000_000 for entry in logs)


@pytest.mark.covers(source="measured misc/log/list/out_of_range: a list beyond the last log has no entry")
def test_a_list_beyond_the_last_log_is_empty(station: Any, logs: list[Any]) -> None:
    assert entries(station, 5000, 5001) == []


@pytest.mark.covers("LOG_REQUEST_DATA", "LOG_DATA", source="measured misc/log/data/*: 90 bytes a packet")
@pytest.mark.parametrize("count", [90, 270])
def test_data_comes_in_packets_of_90_bytes(station: Any, logs: list[Any], count: int) -> None:
    packets = data(station, 0, 0, count)
    assert [(packet.ofs, packet.count) for packet in packets] == [(offset, 90) for offset in range(0, count, 90)]
    assert {packet.id for packet in packets} == {0}
    assert bytes(packets[0].data[:7]) == ULOG_MAGIC


@pytest.mark.covers("LOG_REQUEST_DATA", source=PAGE)
def test_data_begins_at_any_offset(station: Any, logs: list[Any]) -> None:
    whole, part = data(station, 0, 0, 90), data(station, 0, 10, 80)
    assert [packet.ofs for packet in part] == [10]
    assert bytes(part[0].data[:80]) == bytes(whole[0].data[10:90])


@pytest.mark.covers(
    "LOG_REQUEST_DATA", source="measured misc/log/data/bad_id: data of a log that is not there is not sent"
)
def test_data_that_is_not_there_is_not_sent(station: Any, logs: list[Any]) -> None:
    assert data(station, 4999, 0, 90) == []
    assert data(station, 0, BEYOND_ANY, 90) == []


@pytest.mark.covers("LOG_REQUEST_END", source="https://mavlink.io/en/messages/common.html#LOG_REQUEST_END")
def test_nothing_comes_after_the_end(station: Any, logs: list[Any]) -> None:
    assert data(station, 0, 0, 90)
    station.mav.log_request_end_send(station.system, 1)
    assert station.receive("LOG_DATA", 0.5) is None
