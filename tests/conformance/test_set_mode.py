"""SET_MODE, which QGroundControl still sends, is acknowledged as MAV_CMD_DO_SET_MODE."""

from typing import Any

import pytest

DO_SET_MODE = 176


@pytest.mark.covers("SET_MODE", "COMMAND_ACK", source="https://mavlink.io/en/messages/common.html#SET_MODE")
@pytest.mark.covers("SET_MODE", source="measured: answered as MAV_CMD_DO_SET_MODE")
@pytest.mark.parametrize(("main", "sub", "result"), [(1, 0, 0), (4, 5, 0), (99, 0, 1), (4, 3, 0)])
def test_set_mode(station: Any, main: int, sub: int, result: int) -> None:
    station.mav.set_mode_send(station.system, 1, main << 16 | sub << 24)
    ack = station.receive("COMMAND_ACK")
    assert (ack.command, ack.result) == (DO_SET_MODE, result)
    if result == 0:
        assert station.heartbeat().custom_mode == main << 16 | sub << 24
