"""Parameter protocol: the list, reading, setting."""

from typing import Any

import pytest

REAL32 = 9
PAGE = "https://mavlink.io/en/services/parameter.html"

pytestmark = pytest.mark.covers("PARAM_VALUE", source=PAGE)


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR")
@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: the hash comes first; 947 parameters")
def test_list(station: Any) -> None:
    station.mav.param_request_list_send(station.system, 1)
    first = station.receive("PARAM_VALUE")
    assert (first.param_id, first.param_index, first.param_count) == ("_HASH_CHECK", 65535, 947)
    indices = {station.receive("PARAM_VALUE").param_index for _ in range(947)}
    assert indices == set(range(947))


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR")
@pytest.mark.covers("PARAM_REQUEST_READ", "PARAM_SET", source="measured: two echoes to who sets it")
def test_read_and_set(station: Any) -> None:
    station.mav.param_request_read_send(station.system, 1, b"MPC_XY_CRUISE", -1)
    before = station.receive("PARAM_VALUE")
    assert (before.param_index, before.param_type) == (621, REAL32)
    for value in (6.5, before.param_value):
        station.mav.param_set_send(station.system, 1, b"MPC_XY_CRUISE", value, REAL32)
        assert [echo.param_value for echo in station.collect("PARAM_VALUE", 0.5)] == [value, value]
