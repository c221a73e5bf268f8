"""TIMESYNC: the other clock's time comes back with ours."""

from typing import Any

import pytest


@pytest.mark.covers("TIMESYNC", source="https://mavlink.io/en/services/timesync.html")
def test_timesync(station: Any) -> None:
    station.mav.timesync_send(0, 123456789)
    while (reply := station.receive("TIMESYNC")) is not None and reply.tc1 == 0:
        pass
    assert reply is not None
    assert reply.ts1 == 123456789
