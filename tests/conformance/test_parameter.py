"""Parameter protocol: the list, reading and setting in all forms, the hash."""

import math
import struct
from collections.abc import Iterator
from typing import Any

import pytest

UINT8, INT16, UINT32, INT32, REAL32 = 1, 4, 5, 6, 9
HEADER_BYTES = 10
NO_INDEX = 65535
HASH = "_HASH_CHECK"
RC_LOSS_T, RC_IN_MODE = "COM_RC_LOSS_T", "COM_RC_IN_MODE"
"""A number and an integer that every vehicle has."""
CRUISE, GREATEST_SPEED = "MPC_XY_CRUISE", "MPC_XY_VEL_MAX"
SETTLE_S = 3.0
SILENCE_S = 0.5
PAGE = "https://mavlink.io/en/services/parameter.html"

pytestmark = pytest.mark.covers("PARAM_VALUE", source=PAGE)


def value_of(message: Any) -> Any:
    """PX4 sends an integer as its four bytes in the float field."""
    raw = bytes(message.get_msgbuf())[HEADER_BYTES : HEADER_BYTES + 4]
    layout = {REAL32: "<f", UINT32: "<I"}.get(message.param_type, "<i")
    return struct.unpack(layout, raw)[0]


def wire(value: float | int, kind: int) -> float:
    return float(value) if kind == REAL32 else struct.unpack("<f", struct.pack("<i", value))[0]


def values(station: Any, name: str, seconds: float, at_least: int = 0) -> list[float | int]:
    """What PARAM_VALUEs of that name say within a time; others may come, of what is not saved yet."""
    found = station.collect("PARAM_VALUE", seconds, at_least)
    return [value_of(message) for message in found if message.param_id == name]


def ask(station: Any, name: str = "", index: int = -1, target: tuple[int, int] | None = None) -> None:
    """Send PARAM_REQUEST_READ; what came before is forgotten."""
    system, component = target or (station.system, 1)
    values(station, name, 0.02)
    station.mav.param_request_read_send(system, component, name.encode(), index)


def read(station: Any, name: str = "", index: int = -1, target: tuple[int, int] | None = None) -> Any:
    """The answer to PARAM_REQUEST_READ."""
    ask(station, name, index, target)
    return station.receive("PARAM_VALUE")


def has_no_answer(station: Any, name: str = "", index: int = -1, target: tuple[int, int] | None = None) -> bool:
    """Whether PARAM_REQUEST_READ is not answered within half a second."""
    ask(station, name, index, target)
    return station.receive("PARAM_VALUE", SILENCE_S) is None


def set_value(station: Any, name: str, value: float | int, kind: int) -> None:
    station.mav.param_set_send(station.system, 1, name.encode(), wire(value, kind), kind)


@pytest.fixture(scope="module")
def listed(station: Any) -> list[Any]:
    """The answers to PARAM_REQUEST_LIST, the hash first."""
    station.mav.param_request_list_send(station.system, 1)
    first = station.receive("PARAM_VALUE")
    return [first, *(station.receive("PARAM_VALUE") for _ in range(first.param_count))]


@pytest.fixture(autouse=True)
def restored(station: Any) -> Iterator[None]:
    """The two parameters that tests change have their values again, and have been told for the last time."""
    before = {name: read(station, name) for name in (CRUISE, RC_LOSS_T, RC_IN_MODE)}
    yield
    for name, message in before.items():
        now = read(station, name)
        if now is None or value_of(now) != value_of(message):
            set_value(station, name, value_of(message), message.param_type)
            values(station, name, 0.3)


@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: the hash comes first, then all by name, indices in order")
def test_the_list_is_whole_and_in_order(listed: list[Any]) -> None:
    first, *others = listed
    assert (first.param_id, first.param_index, first.param_type) == (HASH, NO_INDEX, UINT32)
    assert [each.param_index for each in others] == list(range(first.param_count))
    assert {each.param_count for each in others} == {first.param_count}
    names = [each.param_id for each in others]
    assert names == sorted(set(names))
    assert {each.param_type for each in others} == {INT32, REAL32}


@pytest.mark.airframe(10044)
@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: 947 parameters of the simulated hexacopter")
def test_the_list_of_the_simulated_hexacopter(listed: list[Any]) -> None:
    assert len(listed) == 1 + 947
    found = {each.param_index: (each.param_id, each.param_type) for each in listed[1:]}
    assert [found[index] for index in (0, 1, 946)] == [
        ("ASPD_SCALE_1", REAL32),
        ("ATT_EN", INT32),
        ("WV_YRATE_MAX", REAL32),
    ]
    assert (found[147], found[550]) == (("CA_ROTOR11_KM", REAL32), ("MC_ROLLRATE_P", REAL32))


@pytest.mark.covers("PARAM_REQUEST_LIST", source="measured: asked for again, the list begins again")
def test_a_list_that_is_asked_for_again_begins_again(station: Any, listed: list[Any]) -> None:
    station.mav.param_request_list_send(station.system, 1)
    begun = [station.receive("PARAM_VALUE").param_index for _ in range(100)]
    station.mav.param_request_list_send(station.system, 1)
    indices = begun + [message.param_index for message in station.collect("PARAM_VALUE", 1.5)]
    assert indices.count(0) == 2
    assert set(range(listed[0].param_count)) <= set(indices)


@pytest.mark.covers("PARAM_SET", source="measured: _HASH_CHECK, whatever its value, ends the list")
def test_setting_the_hash_ends_the_list(station: Any, listed: list[Any]) -> None:
    station.mav.param_request_list_send(station.system, 1)
    assert station.receive("PARAM_VALUE").param_id == HASH
    station.mav.param_set_send(station.system, 1, HASH.encode(), 0.0, UINT32)
    assert len(station.collect("PARAM_VALUE", 1.0)) < len(listed) // 2


@pytest.mark.covers("PARAM_REQUEST_READ", source=PAGE)
@pytest.mark.parametrize("name", [RC_LOSS_T, RC_IN_MODE, "SYS_AUTOSTART"])
def test_a_parameter_is_read_by_its_name(station: Any, listed: list[Any], name: str) -> None:
    expected = next(each for each in listed if each.param_id == name)
    message = read(station, name)
    assert (message.param_id, message.param_index, message.param_type) == (
        name,
        expected.param_index,
        expected.param_type,
    )
    assert (message.param_count, value_of(message)) == (expected.param_count, value_of(expected))


@pytest.mark.covers("PARAM_REQUEST_READ", source=PAGE)
@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: an index counts, whatever the name says")
@pytest.mark.parametrize("name", ["", RC_LOSS_T])
@pytest.mark.parametrize("place", [0, 1, 500, -1])
def test_a_parameter_is_read_by_its_index(station: Any, listed: list[Any], name: str, place: int) -> None:
    expected = listed[1:][place]
    message = read(station, name, expected.param_index)
    assert (message.param_id, message.param_index) == (expected.param_id, expected.param_index)


@pytest.mark.covers(
    "PARAM_REQUEST_READ", source="measured: the hash, and a parameter outside the list, have index 65535"
)
@pytest.mark.parametrize(("name", "kind"), [(HASH, UINT32), ("FW_T_CLMB_MAX", REAL32)])
def test_what_the_list_has_not_is_read_without_an_index(station: Any, listed: list[Any], name: str, kind: int) -> None:
    message = read(station, name)
    assert (message.param_id, message.param_index, message.param_type) == (name, NO_INDEX, kind)
    assert message.param_count == listed[0].param_count


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: no answer")
@pytest.mark.parametrize(
    ("name", "index"), [("NO_SUCH_PARAM", -1), ("com_rc_loss_t", -1), ("", -1), ("", 32767), ("", -2)]
)
def test_what_is_not_there_has_no_answer(station: Any, name: str, index: int) -> None:
    assert has_no_answer(station, name, index)


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: no answer")
def test_after_the_last_index_there_is_nothing(station: Any, listed: list[Any]) -> None:
    assert has_no_answer(station, "", listed[0].param_count)


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: PX4 wants its own system, and component 1 or all")
@pytest.mark.parametrize(
    ("offset", "component", "answered"), [(0, 1, True), (0, 0, True), (0, 190, False), (77, 1, False)]
)
def test_targets(station: Any, offset: int, component: int, answered: bool) -> None:
    target = station.system + offset, component
    if answered:
        assert read(station, RC_LOSS_T, target=target).param_id == RC_LOSS_T
    else:
        assert has_no_answer(station, RC_LOSS_T, target=target)


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured: a broadcast has no answer")
@pytest.mark.parametrize("component", [0, 1])
def test_a_broadcast_has_no_answer(station: Any, component: int) -> None:
    assert has_no_answer(station, RC_LOSS_T, target=(0, component))


@pytest.mark.covers("PARAM_SET", source="measured: an echo to who sets it, then what is new to all links")
@pytest.mark.parametrize(("name", "kind", "value"), [(RC_LOSS_T, REAL32, 6.5), (RC_IN_MODE, INT32, 2)])
def test_a_changed_value_is_told_twice(station: Any, listed: list[Any], name: str, kind: int, value: float) -> None:
    expected = next(each for each in listed if each.param_id == name)
    set_value(station, name, value, kind)
    echo = station.receive("PARAM_VALUE")
    assert (echo.param_id, echo.param_type) == (name, kind)
    assert (echo.param_index, echo.param_count) == (expected.param_index, expected.param_count)
    assert value_of(echo) == value
    assert values(station, name, 0.25, at_least=1) == [value]
    assert value_of(read(station, name)) == value


@pytest.mark.covers("PARAM_SET", source="measured: one echo, as nothing has changed")
def test_the_same_value_is_told_once(station: Any) -> None:
    before = value_of(read(station, RC_LOSS_T))
    set_value(station, RC_LOSS_T, before, REAL32)
    assert values(station, RC_LOSS_T, 0.25, at_least=1) == [before]


@pytest.mark.covers("PARAM_SET", source="measured: ignored without an answer")
@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        (RC_LOSS_T, 7, INT32),
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
@pytest.mark.parametrize(("name", "value", "kind"), [(RC_LOSS_T, -3.0, REAL32), (RC_IN_MODE, 99, INT32)])
def test_a_value_out_of_bounds_is_taken(station: Any, name: str, value: float, kind: int) -> None:
    set_value(station, name, value, kind)
    assert value_of(station.receive("PARAM_VALUE")) == value
    values(station, name, 0.1)
    assert value_of(read(station, name)) == value


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers("PARAM_SET", source="measured: the position controller lowers MPC_XY_CRUISE to MPC_XY_VEL_MAX")
def test_a_cruise_speed_above_the_greatest_is_lowered(station: Any) -> None:
    greatest = value_of(read(station, GREATEST_SPEED))
    set_value(station, CRUISE, 5000.0, REAL32)
    assert value_of(station.receive("PARAM_VALUE")) == 5000.0
    told = []
    while (message := station.receive("PARAM_VALUE", SETTLE_S)) is not None and greatest not in told:
        told += [value_of(message)] if message.param_id == CRUISE else []
    assert greatest in told
    assert value_of(read(station, CRUISE)) == greatest


@pytest.mark.covers("PARAM_SET", source="measured: NaN is kept, and is no change that other links hear of")
def test_nan_is_taken(station: Any) -> None:
    set_value(station, RC_LOSS_T, math.nan, REAL32)
    told = values(station, RC_LOSS_T, 0.25, at_least=1)
    assert len(told) == 1
    assert math.isnan(told[0])
    assert math.isnan(value_of(read(station, RC_LOSS_T)))


@pytest.mark.covers("PARAM_SET", "PARAM_REQUEST_READ", source="measured: the hash follows the values")
def test_the_hash_changes_with_a_value_and_comes_back_with_it(station: Any) -> None:
    before = value_of(read(station, RC_LOSS_T))
    hashes = []
    for value in (before, 6.25, before):
        set_value(station, RC_LOSS_T, value, REAL32)
        values(station, RC_LOSS_T, 0.1)
        hashes.append(value_of(read(station, HASH)))
    assert hashes[0] != hashes[1]
    assert hashes[0] == hashes[2]


@pytest.mark.covers("PARAM_ERROR", "PARAM_REQUEST_READ", source="measured: error 1, DOES_NOT_EXIST")
@pytest.mark.parametrize(
    ("name", "index"), [("NO_SUCH_PARAM", -1), ("com_rc_loss_t", -1), ("", -1), ("", 32767), ("", -2)]
)
@pytest.mark.parametrize("component", [0, 1])
def test_reading_what_is_not_there_is_refused(station: Any, name: str, index: int, component: int) -> None:
    ask(station, name, index, (station.system, component))
    refusal = station.receive("PARAM_ERROR")
    assert refusal.error == 1
    assert (refusal.target_system, refusal.target_component) == (255, 190)
    assert (refusal.param_index if index >= 0 else refusal.param_id) == (index if index >= 0 else name)


@pytest.mark.covers("PARAM_ERROR", "PARAM_SET", source="measured: errors 1, 5, 6 and 7")
@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("NO_SUCH_PARAM", 1.0, REAL32, 1),
        (HASH, 0, UINT32, 5),
        (RC_IN_MODE, 1, UINT8, 6),
        (RC_IN_MODE, 1, UINT32, 6),
        (RC_IN_MODE, 3.0, REAL32, 7),
        (RC_LOSS_T, 7, INT32, 7),
    ],
)
def test_setting_what_cannot_be_set_is_refused(station: Any, name: str, value: float, kind: int, error: int) -> None:
    set_value(station, name, value, kind)
    refusal = station.receive("PARAM_ERROR")
    assert (refusal.param_id, refusal.error) == (name, error)


@pytest.mark.covers("PARAM_ERROR", source="measured: its own system, and component 1 or all")
@pytest.mark.parametrize("target", [(0, 0), (0, 1), (77, 1), (None, 190)])
def test_a_refusal_is_for_whom_asked_this_autopilot(station: Any, target: tuple[int | None, int]) -> None:
    system = station.system if target[0] is None else target[0]
    ask(station, "NO_SUCH_PARAM", target=(system, target[1]))
    assert station.receive("PARAM_ERROR", SILENCE_S) is None
