"""REQUEST_MESSAGE: which messages a ground station may ask for, and what it is answered."""

from typing import Any

import pytest

REQUEST_MESSAGE, GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL = 512, 510, 511
ACCEPTED, DENIED = 0, 2
MANUAL_CONTROL, MESSAGE_INTERVAL, STORAGE_INFORMATION = 69, 244, 261
GIVEN = (
    *(0, 1, 2, 8, 26, 30, 31, 32, 33, 49, 74, 105, 115, 141, 147, 148, 230, 242, 244, 245, 261, 286),
    *(292, 300, 331, 395, 397, 435, 436, 514, 12900, 12901),
)
"""Message ids; ESC_EEPROM (292) is accepted, and nothing comes."""
GIVEN_ONCE = {24: 200_000, 441: 1_000_000, 12904: 1_000_000}
"""GPS_RAW_INT, GNSS_INTEGRITY and OPEN_DRONE_ID_SYSTEM are sent once per fix, so that a stream may have been
faster; and their intervals."""
GIVEN_BY_A_MULTICOPTER = (83, 93, 375)
NOT_GIVEN = (22, 27, 42, 77, 259, 260, 263, 269, 345, 390, 396, 9999, 70000, -1)
"""Those of the camera's component, no stream of that name (MISSION_CURRENT, for one), no such message."""
GIMBAL = (280, 281, 283, 284, 285)

pytestmark = pytest.mark.covers(
    "MAV_CMD_REQUEST_MESSAGE", source="https://mavlink.io/en/messages/common.html#MAV_CMD_REQUEST_MESSAGE"
)


def ask(station: Any, *params: float) -> None:
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, *params, *(0.0,) * (7 - len(params)))


@pytest.mark.covers(source="measured request_message/*: what PX4 has without camera and gimbal")
@pytest.mark.parametrize("number", GIVEN)
def test_given(station: Any, number: int) -> None:
    assert station.request(number)[0] == ACCEPTED


@pytest.mark.covers(
    source="measured request_message/*: what PX4 has without camera and gimbal, with its streams stopped"
)
@pytest.mark.parametrize("number", GIVEN_ONCE)
def test_given_while_it_is_not_streamed(station: Any, number: int) -> None:
    assert station.command(SET_MESSAGE_INTERVAL, number, -1) == ACCEPTED
    try:
        assert station.request(number)[0] == ACCEPTED
    finally:
        station.command(SET_MESSAGE_INTERVAL, number, GIVEN_ONCE[number])


@pytest.mark.covers("MANUAL_CONTROL", source="measured request_message/69: given")
@pytest.mark.covers(
    "MANUAL_CONTROL", source="PX4 src/modules/mavlink/streams/MANUAL_CONTROL.hpp: once, until the sticks speak again"
)
def test_sticks_are_given_when_they_have_spoken(station: Any) -> None:
    """The first sticks of all choose Position where nobody has chosen a mode: the one that is, is chosen."""
    mode = station.heartbeat().custom_mode
    station.set_mode(mode >> 16 & 0xFF, mode >> 24)
    station.mav.manual_control_send(station.system, 0, 0, 500, 0, 0)
    assert station.request(MANUAL_CONTROL)[0] == ACCEPTED


@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
@pytest.mark.covers(source="measured request_message/*: what PX4's hexacopter has, and its rover has not")
@pytest.mark.parametrize("number", GIVEN_BY_A_MULTICOPTER)
def test_given_by_a_multicopter(station: Any, number: int) -> None:
    assert station.request(number)[0] == ACCEPTED


@pytest.mark.airframe(10044, 10045)
@pytest.mark.covers(source="measured request_message/*: MAV_RESULT_DENIED without a gimbal")
@pytest.mark.parametrize("number", GIMBAL)
def test_denied_without_a_gimbal(station: Any, number: int) -> None:
    assert station.command(REQUEST_MESSAGE, number) == DENIED


@pytest.mark.covers(source="measured request_message/*: MAV_RESULT_DENIED")
@pytest.mark.parametrize("number", NOT_GIVEN)
def test_denied(station: Any, number: int) -> None:
    assert station.command(REQUEST_MESSAGE, number) == DENIED


@pytest.mark.covers(source="measured request_message/delivery/gcs/*: the message comes first, then the acknowledgement")
def test_the_message_comes_before_its_acknowledgement(station: Any) -> None:
    ask(station, 148)
    names = [station.receive(["AUTOPILOT_VERSION", "COMMAND_ACK"]).get_type() for _ in range(2)]
    assert names == ["AUTOPILOT_VERSION", "COMMAND_ACK"]


@pytest.mark.covers("MESSAGE_INTERVAL", source="https://mavlink.io/en/messages/common.html#MAV_CMD_REQUEST_MESSAGE")
def test_an_interval_is_a_message_too(station: Any) -> None:
    ask(station, MESSAGE_INTERVAL, 30)
    interval = station.receive("MESSAGE_INTERVAL")
    assert (interval.message_id, interval.interval_us) == (30, 20_000)


@pytest.mark.covers("STORAGE_INFORMATION", source="https://mavlink.io/en/messages/common.html#STORAGE_INFORMATION")
def test_storage(station: Any) -> None:
    ask(station, STORAGE_INFORMATION)
    storage = station.receive("STORAGE_INFORMATION")
    assert (storage.storage_id, storage.storage_count, storage.status) == (1, 1, 2)
    assert storage.total_capacity == pytest.approx(storage.used_capacity + storage.available_capacity, rel=0.01)
    assert 0.0 < storage.available_capacity < storage.total_capacity
