"""Choosing a mode on the ground, without remote control: SET_MODE, DO_SET_MODE and DO_SET_STANDARD_MODE."""

from collections.abc import Iterator
from typing import Any

import pytest

DO_SET_MODE, DO_SET_STANDARD_MODE = 176, 262
CUSTOM = 1
HOLD = (4, 3)
ACCEPTED, TEMPORARILY_REJECTED = 0, 1
STICKS, ACRO, AUTO, BY_ITSELF = 81, 65, 29, 17
"""HEARTBEAT.base_mode while disarmed: custom (1), auto (4), guided (8), stabilised (16), manual input (64)."""
SELECTABLE = {
    (1, 0): STICKS,
    (2, 0): STICKS,
    (3, 0): STICKS,
    (3, 2): STICKS,
    (4, 2): AUTO,
    (4, 3): AUTO,
    (4, 4): AUTO,
    (4, 5): AUTO,
    (4, 6): AUTO,
    (4, 8): BY_ITSELF,
    (4, 9): AUTO,
    (4, 11): BY_ITSELF,
    (4, 19): AUTO,
    (5, 0): ACRO,
    (7, 0): STICKS,
    (11, 0): STICKS,
}
"""(main mode, sub mode) of px4_custom_mode."""
REFUSED = ((0, 0), (4, 1), (4, 7), (4, 10), (4, 20), (8, 0), (9, 0), (10, 0), (12, 0), (99, 0))
PAGE = "https://mavlink.io/en/messages/common.html"

pytestmark = pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")


@pytest.fixture(autouse=True)
def held(station: Any) -> Iterator[None]:
    """Every test begins and ends in Hold."""
    yield
    station.set_mode(*HOLD)


def custom_mode(main: int, sub: int) -> int:
    return main << 16 | sub << 24


@pytest.mark.covers("MAV_CMD_DO_SET_MODE", "HEARTBEAT", source=f"{PAGE}#MAV_CMD_DO_SET_MODE")
@pytest.mark.covers(
    "MAV_CMD_DO_SET_MODE",
    source="measured mode/disarmed/DO_SET_MODE/*: on the ground every mode may be chosen, also unflyable ones",
)
@pytest.mark.parametrize(("mode", "base_mode"), SELECTABLE.items())
def test_a_mode_is_chosen(station: Any, mode: tuple[int, int], base_mode: int) -> None:
    assert station.command(DO_SET_MODE, CUSTOM, *mode) == ACCEPTED
    beat = station.heartbeat()
    assert (beat.custom_mode, beat.base_mode) == (custom_mode(*mode), base_mode)


@pytest.mark.covers(
    "MAV_CMD_DO_SET_MODE",
    source="measured mode/disarmed/DO_SET_MODE/*: MAV_RESULT_TEMPORARILY_REJECTED, and the mode stays",
)
@pytest.mark.parametrize("mode", REFUSED)
def test_a_mode_that_nobody_can_choose_is_refused(station: Any, mode: tuple[int, int]) -> None:
    assert station.command(DO_SET_MODE, CUSTOM, *mode) == TEMPORARILY_REJECTED
    assert station.heartbeat().custom_mode == custom_mode(*HOLD)


@pytest.mark.covers(
    "MAV_CMD_DO_SET_MODE", source="measured mode/disarmed/DO_SET_MODE/*: main mode AUTO without a sub mode is MISSION"
)
@pytest.mark.parametrize(("asked", "chosen"), [((4, 0), (4, 4)), ((3, 3), (3, 0))])
def test_a_sub_mode_that_is_not_known(station: Any, asked: tuple[int, int], chosen: tuple[int, int]) -> None:
    assert station.command(DO_SET_MODE, CUSTOM, *asked) == ACCEPTED
    assert station.heartbeat().custom_mode == custom_mode(*chosen)


@pytest.mark.covers("SET_MODE", "COMMAND_ACK", source=f"{PAGE}#SET_MODE")
@pytest.mark.covers(
    "SET_MODE", source="measured mode/disarmed/SET_MODE/*: answered as MAV_CMD_DO_SET_MODE, as QGroundControl expects"
)
@pytest.mark.parametrize(("main", "sub", "result"), [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 4, 0), (4, 5, 0), (99, 0, 1)])
def test_set_mode(station: Any, main: int, sub: int, result: int) -> None:
    station.mav.set_mode_send(station.system, CUSTOM, custom_mode(main, sub))
    ack = station.receive("COMMAND_ACK")
    assert (ack.command, ack.result) == (DO_SET_MODE, result)
    if result == ACCEPTED:
        assert station.heartbeat().custom_mode == custom_mode(main, sub)
