"""Rates of the ground station's streams, and changing them; in the vehicle's own time."""

from typing import Any

import pytest

ATTITUDE = 30
SET_MESSAGE_INTERVAL = 511

pytestmark = pytest.mark.covers(
    "MAV_CMD_SET_MESSAGE_INTERVAL", source="https://mavlink.io/en/messages/common.html#MAV_CMD_SET_MESSAGE_INTERVAL"
)


def attitude_hz(station: Any) -> float:
    times_ms = [message.time_boot_ms for message in station.collect("ATTITUDE", 2.0)]
    return 0.0 if len(times_ms) < 2 else (len(times_ms) - 1) / (times_ms[-1] - times_ms[0]) * 1000.0


@pytest.mark.covers("ATTITUDE", source="measured: 50 Hz to the ground station until another rate is asked for")
@pytest.mark.parametrize(("interval_us", "hz"), [(20_000, 50.0), (100_000, 10.0), (-1, 0.0), (20_000, 50.0)])
def test_intervals(station: Any, interval_us: int, hz: float) -> None:
    assert station.command(SET_MESSAGE_INTERVAL, ATTITUDE, interval_us) == 0
    station.collect("ATTITUDE", 0.2)
    assert attitude_hz(station) == pytest.approx(hz, rel=0.15, abs=0.35)


@pytest.mark.covers(source="measured: MAV_RESULT_FAILED")
def test_heartbeat_stays(station: Any) -> None:
    assert station.command(SET_MESSAGE_INTERVAL, 0, 200_000) == 4
