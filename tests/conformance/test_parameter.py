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
SETTLE_S = 10.0
SILENCE_S = 0.5
LATE = (
    {"FW_LND_ANG", "MIS_DIST_1WP", "MIS_TKO_LAND_REQ"},
    {"SENS_FLOW_MAXHGT", "SENS_FLOW_MAXR", "SENS_FLOW_MINHGT", "SENS_FLOW_RATE", "SENS_FLOW_ROT", "SENS_FLOW_SCALE"},
)
"""Parameters that join the list when a mission is checked (PX4 src/modules/navigator/MissionFeasibility/
FeasibilityChecker.cpp), and with the first optical flow (src/modules/sensors/sensors.cpp)."""
DOES_NOT_EXIST, READ_ONLY, TYPE_UNSUPPORTED, TYPE_MISMATCH = 1, 5, 6, 7
"""MAV_PARAM_ERROR."""
ERROR = ["PARAM_ERROR", "UNKNOWN_345"]
"""Older pymavlinks do not know its name."""
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
    return told(station, name, index)


def told(station: Any, name: str = "", index: int = -1) -> Any:
    """The next PARAM_VALUE of that index or name; others may come before, of what is not saved yet."""
    while (message := station.receive("PARAM_VALUE")) is not None:
        if message.param_index == index or (index < 0 and message.param_id == name):
            break
    return message


def has_no_answer(station: Any, name: str = "", index: int = -1, target: tuple[int, int] | None = None) -> bool:
    """Whether PARAM_REQUEST_READ is not answered within half a second."""
    ask(station, name, index, target)
    return station.receive(["PARAM_VALUE", *ERROR], SILENCE_S) is None


def refused(station: Any, name: str = "", index: int = -1) -> int | None:
    """The error of the next PARAM_ERROR, if it is ours and about that name or index; None if none comes.

    The index of a name that was asked for, and the name of an index, are unset memory in PX4.
    """
    # Values that come first say nothing: what has changed meanwhile is told to all, and may be late on a busy machine.
    message = station.receive(ERROR)
    if message is None:
        return None
    frame = bytes(message.get_msgbuf())
    payload = frame[HEADER_BYTES : HEADER_BYTES + frame[1]].ljust(21, b"\0")
    told_index, system, component, told_name, error = struct.unpack("<hBB16sB", payload)
    assert (system, component) == (255, 190)
    assert told_index == index if index >= 0 else told_name.rstrip(b"\0").decode() == name
    return int(error)


def set_value(station: Any, name: str, value: float | int, kind: int) -> None:
    station.set_parameter(name, wire(value, kind), kind)


@pytest.fixture(scope="module")
def listed(station: Any) -> list[Any]:
    """The answers to PARAM_REQUEST_LIST, the hash first."""
    while values(station, "", SILENCE_S):
        pass  # what PX4 tells by itself
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
            told(station, name)
            values(station, name, 0.3)


@pytest.mark.covers(
    "PARAM_REQUEST_LIST", source="measured param_list/*: the hash comes first, then all by name, indices in order"
)
def test_the_list_is_whole_and_in_order(listed: list[Any]) -> None:
    first, *others = listed
    assert (first.param_id, first.param_index, first.param_type) == (HASH, NO_INDEX, UINT32)
    assert [each.param_index for each in others] == list(range(first.param_count))
    assert {each.param_count for each in others} == {first.param_count}
    names = [each.param_id for each in others]
    assert names == sorted(set(names))
    assert {each.param_type for each in others} == {INT32, REAL32}


@pytest.mark.airframe(10044)
@pytest.mark.covers(
    "PARAM_REQUEST_LIST", source="measured param_list/param_count: 947 parameters of the simulated hexacopter"
)
def test_the_list_of_the_simulated_hexacopter(listed: list[Any]) -> None:
    """Once started; what joins it later does so together."""
    names = {each.param_id for each in listed[1:]}
    assert all(late <= names or not late & names for late in LATE)
    found = [(each.param_id, each.param_type) for each in listed[1:] if each.param_id not in set.union(*LATE)]
    assert len(found) == 947
    assert [found[index] for index in (0, 1, 946)] == [
        ("ASPD_SCALE_1", REAL32),
        ("ATT_EN", INT32),
        ("WV_YRATE_MAX", REAL32),
    ]
    assert (found[147], found[550]) == (("CA_ROTOR11_KM", REAL32), ("MC_ROLLRATE_P", REAL32))


@pytest.mark.covers(
    "PARAM_REQUEST_LIST",
    source="measured param_list/restart_when_requested_again/*: asked for again, the list begins again",
)
def test_a_list_that_is_asked_for_again_begins_again(station: Any, listed: list[Any]) -> None:
    station.mav.param_request_list_send(station.system, 1)
    begun = [station.receive("PARAM_VALUE").param_index for _ in range(100)]
    station.mav.param_request_list_send(station.system, 1)
    indices, last = list(begun), listed[0].param_count - 1
    while (message := station.receive("PARAM_VALUE")) is not None and message.param_index != last:
        indices.append(message.param_index)
    assert indices.count(0) == 2
    assert set(range(last)) <= set(indices)


@pytest.mark.covers(
    "PARAM_SET", source="PX4 src/modules/mavlink/mavlink_parameters.cpp: _HASH_CHECK, whatever its value, ends the list"
)
def test_setting_the_hash_ends_the_list(station: Any, listed: list[Any]) -> None:
    station.mav.param_request_list_send(station.system, 1)
    assert station.receive("PARAM_VALUE").param_id == HASH
    station.mav.param_set_send(station.system, 1, HASH.encode(), 0.0, UINT32)
    assert len(station.collect("PARAM_VALUE", 1.0)) < len(listed) // 2


@pytest.mark.covers("PARAM_SET", "PARAM_ERROR", source="PX4 src/modules/mavlink/mavlink_parameters.cpp")
def test_the_hash_can_not_be_set(station: Any) -> None:
    station.mav.param_set_send(station.system, 1, HASH.encode(), 0.0, UINT32)
    assert refused(station, HASH) == READ_ONLY


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
@pytest.mark.covers("PARAM_REQUEST_READ", source="measured param_read/index/*: an index counts, whatever the name says")
@pytest.mark.parametrize("name", ["", RC_LOSS_T])
@pytest.mark.parametrize("place", [0, 1, 500, -1])
def test_a_parameter_is_read_by_its_index(station: Any, listed: list[Any], name: str, place: int) -> None:
    expected = listed[1:][place]
    message = read(station, name, expected.param_index)
    assert (message.param_id, message.param_index) == (expected.param_id, expected.param_index)


@pytest.mark.covers(
    "PARAM_REQUEST_READ",
    source="measured param_read/inactive, param_list/first: what the list has not has index 65535",
)
@pytest.mark.parametrize(("name", "kind"), [(HASH, UINT32), ("FW_T_CLMB_MAX", REAL32)])
def test_what_the_list_has_not_is_read_without_an_index(station: Any, listed: list[Any], name: str, kind: int) -> None:
    message = read(station, name)
    assert (message.param_id, message.param_index, message.param_type) == (name, NO_INDEX, kind)
    assert message.param_count == listed[0].param_count


@pytest.mark.covers("PARAM_REQUEST_READ", "PARAM_ERROR", source="PX4 src/modules/mavlink/mavlink_parameters.cpp")
@pytest.mark.parametrize(
    ("name", "index"), [("NO_SUCH_PARAM", -1), ("com_rc_loss_t", -1), ("", -1), ("", 32767), ("", -2)]
)
def test_what_is_not_there_can_not_be_read(station: Any, name: str, index: int) -> None:
    ask(station, name, index)
    assert refused(station, name, index) == DOES_NOT_EXIST


@pytest.mark.covers("PARAM_REQUEST_READ", "PARAM_ERROR", source="PX4 src/modules/mavlink/mavlink_parameters.cpp")
def test_after_the_last_index_there_is_nothing(station: Any, listed: list[Any]) -> None:
    ask(station, "", listed[0].param_count)
    assert refused(station, index=listed[0].param_count) == DOES_NOT_EXIST


@pytest.mark.covers(
    "PARAM_REQUEST_READ", source="measured param_target/read/*: PX4 wants its own system, and component 1 or all"
)
@pytest.mark.parametrize(
    ("offset", "component", "answered"), [(0, 1, True), (0, 0, True), (0, 190, False), (77, 1, False)]
)
def test_targets(station: Any, offset: int, component: int, answered: bool) -> None:
    target = station.system + offset, component
    if answered:
        assert read(station, RC_LOSS_T, target=target).param_id == RC_LOSS_T
        ask(station, "NO_SUCH_PARAM", target=target)
        assert refused(station, "NO_SUCH_PARAM") == DOES_NOT_EXIST
    else:
        assert has_no_answer(station, RC_LOSS_T, target=target)
        assert has_no_answer(station, "NO_SUCH_PARAM", target=target)


@pytest.mark.covers("PARAM_REQUEST_READ", source="measured param_target/read/0/0: a broadcast has no answer")
@pytest.mark.parametrize("component", [0, 1])
def test_a_broadcast_has_no_answer(station: Any, component: int) -> None:
    assert has_no_answer(station, RC_LOSS_T, target=(0, component))


@pytest.mark.covers(
    "PARAM_SET",
    source="measured param_set/float/echo_gcs, param_set/int/*: an echo to who sets it, then what is new to all links",
)
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


@pytest.mark.covers("PARAM_SET", source="measured param_set/same_value/echo_gcs: one echo, as nothing has changed")
def test_the_same_value_is_told_once(station: Any) -> None:
    before = value_of(read(station, RC_LOSS_T))
    set_value(station, RC_LOSS_T, before, REAL32)
    assert values(station, RC_LOSS_T, 0.25, at_least=1) == [before]


@pytest.mark.covers("PARAM_SET", "PARAM_ERROR", source="PX4 src/modules/mavlink/mavlink_parameters.cpp")
@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        (RC_LOSS_T, 7, INT32, TYPE_MISMATCH),
        (RC_IN_MODE, 3.0, REAL32, TYPE_MISMATCH),
        (RC_IN_MODE, 1, UINT8, TYPE_UNSUPPORTED),
        (RC_IN_MODE, 1, INT16, TYPE_UNSUPPORTED),
        (RC_IN_MODE, 1, UINT32, TYPE_UNSUPPORTED),
    ],
)
def test_a_value_of_another_type_is_refused(station: Any, name: str, value: float, kind: int, error: int) -> None:
    before = value_of(read(station, name))
    station.mav.param_set_send(station.system, 1, name.encode(), wire(value, kind), kind)
    assert refused(station, name) == error
    assert value_of(read(station, name)) == before


@pytest.mark.covers("PARAM_SET", "PARAM_ERROR", source="PX4 src/modules/mavlink/mavlink_parameters.cpp")
def test_what_is_not_there_can_not_be_set(station: Any) -> None:
    station.mav.param_set_send(station.system, 1, b"NO_SUCH_PARAM", 1.0, REAL32)
    assert refused(station, "NO_SUCH_PARAM") == DOES_NOT_EXIST


@pytest.mark.covers(
    "PARAM_SET",
    source="measured param_set/float_above_max/*, param_set/int_above_max/*: the service does not look at bounds",
)
@pytest.mark.parametrize(("name", "value", "kind"), [(RC_LOSS_T, -3.0, REAL32), (RC_IN_MODE, 99, INT32)])
def test_a_value_out_of_bounds_is_taken(station: Any, name: str, value: float, kind: int) -> None:
    set_value(station, name, value, kind)
    assert value_of(told(station, name)) == value
    values(station, name, 0.1)
    assert value_of(read(station, name)) == value


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(
    "PARAM_SET",
    source="measured flights/parameter_coupling: the position controller lowers MPC_XY_CRUISE to MPC_XY_VEL_MAX",
)
def test_a_cruise_speed_above_the_greatest_is_lowered(station: Any) -> None:
    greatest = value_of(read(station, GREATEST_SPEED))
    set_value(station, CRUISE, 5000.0, REAL32)
    assert value_of(told(station, CRUISE)) == 5000.0
    heard: list[float | int] = []
    while greatest not in heard and (message := station.receive("PARAM_VALUE", SETTLE_S)) is not None:
        heard += [value_of(message)] if message.param_id == CRUISE else []
    assert greatest in heard
    assert value_of(read(station, CRUISE)) == greatest


@pytest.mark.covers(
    "PARAM_SET", source="measured param_set/float_nan/*: NaN is kept, and is no change that other links hear of"
)
def test_nan_is_taken(station: Any) -> None:
    set_value(station, RC_LOSS_T, math.nan, REAL32)
    told = values(station, RC_LOSS_T, 0.25, at_least=1)
    assert len(told) == 1
    assert math.isnan(told[0])
    assert math.isnan(value_of(read(station, RC_LOSS_T)))


@pytest.mark.covers("PARAM_SET", "PARAM_REQUEST_READ", source="measured param_hash/*: the hash follows the values")
def test_the_hash_changes_with_a_value_and_comes_back_with_it(station: Any) -> None:
    before = value_of(read(station, RC_LOSS_T))
    hashes = []
    for value in (before, 6.25, before):
        set_value(station, RC_LOSS_T, value, REAL32)
        values(station, RC_LOSS_T, 0.1)
        hashes.append(value_of(read(station, HASH)))
    assert hashes[0] != hashes[1]
    assert hashes[0] == hashes[2]
