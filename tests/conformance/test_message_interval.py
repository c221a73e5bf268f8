"""How often streams come: asking, changing, going back; in the vehicle's own time."""

from collections.abc import Iterator
from typing import Any

import pytest

GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL = 510, 511
HEARTBEAT, SYS_STATUS, PARAM_VALUE, RAW_IMU, ATTITUDE, GLOBAL_POSITION_INT, COMMAND_ACK = 0, 1, 22, 27, 30, 33, 77
SCALED_IMU, BATTERY_STATUS, HOME_POSITION, STATUSTEXT = 26, 147, 242, 253
NO_SUCH_MESSAGE = 9999
ACCEPTED, FAILED = 0, 4
STOPPED, DEFAULT = -1, 0
PAGE = "https://mavlink.io/en/messages/common.html#MAV_CMD_SET_MESSAGE_INTERVAL"

pytestmark = pytest.mark.covers("MAV_CMD_SET_MESSAGE_INTERVAL", source=PAGE)


@pytest.fixture(scope="module")
def found_us(station: Any) -> dict[int, int]:
    """Intervals of the streams that tests change, before they do."""
    return {message: interval(station, message) for message in (ATTITUDE, SYS_STATUS, SCALED_IMU)}


@pytest.fixture(autouse=True)
def restored(station: Any, found_us: dict[int, int]) -> Iterator[None]:
    """The streams that tests change are as they were."""
    yield
    for message, interval_us in found_us.items():
        if interval(station, message) != interval_us:
            station.command(SET_MESSAGE_INTERVAL, message, interval_us)


def interval(station: Any, message: int) -> int:
    """What MESSAGE_INTERVAL says of a message."""
    station.mav.command_long_send(station.system, 1, GET_MESSAGE_INTERVAL, 0, message, *(0.0,) * 6)
    while (reply := station.receive("MESSAGE_INTERVAL")).message_id != message:
        pass
    assert station.receive("COMMAND_ACK").command == GET_MESSAGE_INTERVAL
    return int(reply.interval_us)


def attitude_hz(station: Any, seconds: float = 1.2, at_least: int = 8) -> float:
    times_ms = [message.time_boot_ms for message in station.collect("ATTITUDE", seconds, at_least)]
    return 0.0 if len(times_ms) < 2 else (len(times_ms) - 1) / (times_ms[-1] - times_ms[0]) * 1000.0


@pytest.mark.covers(
    "MAV_CMD_GET_MESSAGE_INTERVAL",
    "MESSAGE_INTERVAL",
    source="measured interval/get/gcs/*: intervals to a ground station",
)
@pytest.mark.parametrize(
    ("message", "interval_us"),
    [
        (HEARTBEAT, 1_000_000),
        (SYS_STATUS, 1_000_000),
        (ATTITUDE, 20_000),
        (GLOBAL_POSITION_INT, 20_000),
        (BATTERY_STATUS, 2_000_000),
        (HOME_POSITION, 2_000_000),
        (STATUSTEXT, 50_000),
        (RAW_IMU, STOPPED),
        (PARAM_VALUE, STOPPED),
        (NO_SUCH_MESSAGE, STOPPED),
    ],
)
def test_intervals_are_told(station: Any, message: int, interval_us: int) -> None:
    assert interval(station, message) == pytest.approx(interval_us, rel=0.02)


@pytest.mark.covers(
    "ATTITUDE", source="measured interval/set/*_ATTITUDE_*: each is accepted, told, and kept; 1 µs stops the stream"
)
@pytest.mark.parametrize(
    ("asked_us", "told_us", "hz"),
    [(100_000, 100_000, 10.0), (STOPPED, STOPPED, 0.0), (DEFAULT, 66_666, 15.1), (1, 1, 0.0), (20_000, 20_000, 50.0)],
)
def test_an_interval_is_set(station: Any, asked_us: int, told_us: int, hz: float) -> None:
    assert station.command(SET_MESSAGE_INTERVAL, ATTITUDE, asked_us) == ACCEPTED
    assert interval(station, ATTITUDE) == pytest.approx(told_us, rel=0.02)
    station.collect("ATTITUDE", 0.1)
    assert attitude_hz(station, at_least=8 if hz else 0) == pytest.approx(hz, rel=0.15, abs=0.35)


@pytest.mark.covers(
    "SCALED_IMU", source="measured interval/set/*_SCALED_IMU_*: a stream that is off can be had, and stopped again"
)
def test_another_stream_is_had(station: Any) -> None:
    assert station.command(SET_MESSAGE_INTERVAL, SCALED_IMU, 100_000) == ACCEPTED
    assert station.receive("SCALED_IMU") is not None
    assert station.command(SET_MESSAGE_INTERVAL, SCALED_IMU, STOPPED) == ACCEPTED
    station.collect("SCALED_IMU", 0.1)
    assert station.receive("SCALED_IMU", 0.5) is None


@pytest.mark.covers(
    source="measured interval/set/*_HEARTBEAT_*/ack, interval/set/*_RAW_IMU_*/ack: FAILED where there is no stream"
)
@pytest.mark.parametrize("message", [HEARTBEAT, PARAM_VALUE, RAW_IMU, COMMAND_ACK, NO_SUCH_MESSAGE])
def test_these_have_no_interval_to_set(station: Any, message: int) -> None:
    before = interval(station, message)
    assert station.command(SET_MESSAGE_INTERVAL, message, 200_000) == FAILED
    assert interval(station, message) == before


@pytest.mark.covers("REQUEST_DATA_STREAM", source="measured interval/request_data_stream/*: no effect and no answer")
def test_the_old_request_has_no_effect(station: Any) -> None:
    station.mav.request_data_stream_send(station.system, 1, 0, 5, 1)
    assert station.receive(["DATA_STREAM", "COMMAND_ACK"], 0.3) is None
    assert attitude_hz(station, 0.6) == pytest.approx(50.0, rel=0.15)
