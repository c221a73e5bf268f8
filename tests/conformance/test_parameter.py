"""Parameter protocol: the list, reading, setting."""

from typing import Any

REAL32 = 9


def test_list(station: Any) -> None:
    station.mav.param_request_list_send(station.system, 1)
    first = station.receive("PARAM_VALUE")
    assert (first.param_id, first.param_index, first.param_count) == ("_HASH_CHECK", 65535, 947)
    indices = {station.receive("PARAM_VALUE").param_index for _ in range(947)}
    assert indices == set(range(947))


def test_read_and_set(station: Any) -> None:
    station.mav.param_request_read_send(station.system, 1, b"MPC_XY_CRUISE", -1)
    before = station.receive("PARAM_VALUE")
    assert (before.param_index, before.param_type) == (621, REAL32)
    for value in (6.5, before.param_value):
        station.mav.param_set_send(station.system, 1, b"MPC_XY_CRUISE", value, REAL32)
        assert [echo.param_value for echo in station.collect("PARAM_VALUE", 0.5)] == [value, value]
