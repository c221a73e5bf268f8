"""Parameter protocol: the list, reading and setting in all forms, the hash."""

import math
import struct
from collections.abc import Iterator
from typing import Any

import pytest

UINT8, INT16, UINT32, INT32, REAL32 = 1, 4, 5, 6, 9
HEADER_BYTES = 10
NO_INDEX = 65535
COUNT = 947
HASH = "_HASH_CHECK"
CRUISE, RC_IN_MODE, XY_P = "MPC_XY_CRUISE", "COM_RC_IN_MODE", "MPC_XY_P"
CRUISE_INDEX, RC_IN_MODE_INDEX = 621, 300
GREATEST_SPEED = 12.0
SETTLE_S = 3.0
PAGE = "https://mavlink.io/en/services/parameter.html"

pytestmark = [pytest.mark.covers("PARAM_VALUE", source=PAGE), pytest.mark.vehicle("MAV_TYPE_HEXAROTOR")]


def value_of(message: Any) -> float | int:
    """PX4 sends an integer as its four bytes in the float field."""
    raw = bytes(message.get_msgbuf())[HEADER_BYTES : HEADER_BYTES + 4]
    layout = {REAL32: "<f", UINT32: "<I"}.get(message.param_type, "<i")
    return struct.unpack(layout, raw)[0]


def wire(value: float | int, kind: int) -> float:
    return float(value) if kind == REAL32 else struct.unpack("<f", struct.pack("<i", value))[0]


def values(station: Any, name: str, seconds: float) -> list[float | int]:
    """What PARAM_VALUEs of that name say within a time; others may come, of what is not saved yet."""
    return [value_of(message) for message in station.collect("PARAM_VALUE", seconds) if message.param_id == name]


def read(station: Any, name: str = "", index: int = -1, target: tuple[int, int] | None = None) -> Any:
    """The answer to PARAM_REQUEST_READ, or None within half a second."""
    system, component = target or (station.system, 1)
    values(station, name, 0.02)
    station.mav.param_request_read_send(system, component, name.encode(), index)
    return station.receive("PARAM_VALUE", 0.5)


def set_value(station: Any, name: str, value: float | int, kind: int) -> None:
    station.mav.param_set_send(station.system, 1, name.encode(), wire(value, kind), kind)


@pytest.fixture(autouse=True)
def restored(station: Any) -> Iterator[None]:
    """The two parameters that tests change have their values again, and have been told for the last time."""
    before = {name: read(station, name) for name in (CRUISE, RC_IN_MODE)}
    yield
    for name, message in before.items():
        now = read(station, name)
        if now is None or value_of(now) != value_of(message):
            set_value(station, name, value_of(message), message.param_type)
            values(station, name, 0.3)


@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: the hash comes first, then 947 by name, indices in order")
def test_the_list_is_whole_and_in_order(station: Any) -> None:
    station.mav.param_request_list_send(station.system, 1)
    listed = [station.receive("PARAM_VALUE") for _ in range(1 + COUNT)]
    first = listed[0]
    assert (first.param_id, first.param_index, first.param_type, first.param_count) == (HASH, NO_INDEX, UINT32, COUNT)
    assert [each.param_index for each in listed[1:]] == list(range(COUNT))
    names = [each.param_id for each in listed[1:]]
    assert names == sorted(names)
    assert (names[0], names[1], names[-1]) == ("ASPD_SCALE_1", "ATT_EN", "WV_YRATE_MAX")
    assert {each.param_type for each in listed[1:]} == {INT32, REAL32}


@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: asked for again, the list begins again")
def test_a_list_that_is_asked_for_again_begins_again(station: Any) -> None:
    station.mav.param_request_list_send(station.system, 1)
    begun = [station.receive("PARAM_VALUE").param_index for _ in range(100)]
    station.mav.param_request_list_send(station.system, 1)
    indices = begun + [message.param_index for message in station.collect("PARAM_VALUE", 1.5)]
    assert indices.count(0) == 2
    assert set(range(COUNT)) <= set(indices)


@pytest.mark.covers("PARAM_SET", source="measured: _HASH_CHECK, whatever its value, ends the list")
def test_setting_the_hash_ends_the_list(station: Any) -> None:
    station.mav.param_request_list_send(station.system, 1)
    assert station.receive("PARAM_VALUE").param_id == HASH
    station.mav.param_set_send(station.system, 1, HASH.encode(), 0.0, UINT32)
    assert len(station.collect("PARAM_VALUE", 1.0)) < COUNT // 2


@pytest.mark.covers("PARAM_REQUEST_READ", source=PAGE)
@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: a parameter outside the list has index 65535")
@pytest.mark.parametrize(
    ("name", "index", "answer"),
    [
        ("MC_ROLLRATE_P", -1, ("MC_ROLLRATE_P", 550, REAL32)),
        ("SYS_AUTOSTART", -1, ("SYS_AUTOSTART", 894, INT32)),
        ("CA_ROTOR11_KM", -1, ("CA_ROTOR11_KM", 147, REAL32)),
        ("FW_T_CLMB_MAX", -1, ("FW_T_CLMB_MAX", NO_INDEX, REAL32)),
        (HASH, -1, (HASH, NO_INDEX, UINT32)),
        ("", 0, ("ASPD_SCALE_1", 0, REAL32)),
        ("", 1, ("ATT_EN", 1, INT32)),
        ("", 500, ("LNDMC_Z_VEL_MAX", 500, REAL32)),
        ("", 946, ("WV_YRATE_MAX", 946, REAL32)),
        ("MPC_XY_P", 0, ("ASPD_SCALE_1", 0, REAL32)),
    ],
)
def test_read(station: Any, name: str, index: int, answer: tuple[str, int, int]) -> None:
    message = read(station, name, index)
    assert (message.param_id, message.param_index, message.param_type) == answer
    assert message.param_count == COUNT


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: no answer")
@pytest.mark.parametrize(
    ("name", "index"), [("NO_SUCH_PARAM", -1), ("mpc_xy_p", -1), ("", -1), ("", 947), ("", 32767), ("", -2)]
)
def test_what_is_not_there_has_no_answer(station: Any, name: str, index: int) -> None:
    assert read(station, name, index) is None


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: PX4 wants its own system, and component 1 or all")
@pytest.mark.parametrize(
    ("offset", "component", "answered"), [(0, 1, True), (0, 0, True), (0, 190, False), (77, 1, False)]
)
def test_targets(station: Any, offset: int, component: int, answered: bool) -> None:
    assert (read(station, XY_P, target=(station.system + offset, component)) is not None) is answered


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: a broadcast has no answer")
@pytest.mark.parametrize("component", [0, 1])
def test_a_broadcast_has_no_answer(station: Any, component: int) -> None:
    assert read(station, XY_P, target=(0, component)) is None


@pytest.mark.covers("PARAM_SET", source="measured: an echo to who sets it, then what is new to all links")
@pytest.mark.parametrize(
    ("name", "kind", "value", "index"), [(CRUISE, REAL32, 6.5, CRUISE_INDEX), (RC_IN_MODE, INT32, 2, RC_IN_MODE_INDEX)]
)
def test_a_changed_value_is_told_twice(station: Any, name: str, kind: int, value: float, index: int) -> None:
    set_value(station, name, value, kind)
    echo = station.receive("PARAM_VALUE")
    assert (echo.param_id, echo.param_index, echo.param_type, echo.param_count) == (name, index, kind, COUNT)
    assert value_of(echo) == value
    assert values(station, name, 0.25) == [value]
    assert value_of(read(station, name)) == value


@pytest.mark.covers("PARAM_SET", source="measured: one echo, as nothing has changed")
def test_the_same_value_is_told_once(station: Any) -> None:
    before = value_of(read(station, CRUISE))
    set_value(station, CRUISE, before, REAL32)
    assert values(station, CRUISE, 0.25) == [before]


@pytest.mark.covers("PARAM_SET", source="measured: ignored without an answer")
@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        (CRUISE, 7, INT32),
        (RC_IN_MODE, 3.0, REAL32),
        (RC_IN_MODE, 1, UINT8),
        (RC_IN_MODE, 1, INT16),
        (RC_IN_MODE, 1, UINT32),
        ("NO_SUCH_PARAM", 1.0, REAL32),
    ],
)
def test_another_type_or_name_is_ignored(station: Any, name: str, value: float, kind: int) -> None:
    before = read(station, name)
    set_value(station, name, value, kind)
    assert values(station, name, 0.4) == []
    after = read(station, name)
    assert (before is None and after is None) or value_of(before) == value_of(after)


@pytest.mark.covers("PARAM_SET", source="measured: the service does not look at bounds")
@pytest.mark.parametrize(("name", "value", "kind"), [(CRUISE, -3.0, REAL32), (RC_IN_MODE, 99, INT32)])
def test_a_value_out_of_bounds_is_taken(station: Any, name: str, value: float, kind: int) -> None:
    set_value(station, name, value, kind)
    assert value_of(station.receive("PARAM_VALUE")) == value
    values(station, name, 0.1)
    assert value_of(read(station, name)) == value


@pytest.mark.covers("PARAM_SET", source="measured: the position controller lowers MPC_XY_CRUISE to MPC_XY_VEL_MAX")
def test_a_cruise_speed_above_the_greatest_is_lowered(station: Any) -> None:
    set_value(station, CRUISE, 5000.0, REAL32)
    assert value_of(station.receive("PARAM_VALUE")) == 5000.0
    told = []
    while (message := station.receive("PARAM_VALUE", SETTLE_S)) is not None and GREATEST_SPEED not in told:
        told += [value_of(message)] if message.param_id == CRUISE else []
    assert GREATEST_SPEED in told
    assert value_of(read(station, CRUISE)) == GREATEST_SPEED


@pytest.mark.covers("PARAM_SET", source="measured: NaN is kept, and is no change that other links hear of")
def test_nan_is_taken(station: Any) -> None:
    set_value(station, CRUISE, math.nan, REAL32)
    told = values(station, CRUISE, 0.25)
    assert len(told) == 1
    assert math.isnan(told[0])
    assert math.isnan(value_of(read(station, CRUISE)))


@pytest.mark.covers("PARAM_SET", "PARAM_REQUEST_READ", source="measured: the hash follows the values")
def test_the_hash_changes_with_a_value_and_comes_back_with_it(station: Any) -> None:
    before = value_of(read(station, CRUISE))
    hashes = []
    for value in (before, 6.25, before):
        set_value(station, CRUISE, value, REAL32)
        values(station, CRUISE, 0.1)
        hashes.append(value_of(read(station, HASH)))
    assert hashes[0] != hashes[1]
    assert hashes[0] == hashes[2]
