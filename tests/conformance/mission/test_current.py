"""Mission protocol: the current item, told and set."""

from typing import Any

import pytest

from .plans import NO_MISSION, NOT_STARTED, SUSPENDED, THREE, Item, current, is_said, upload

NO_TOTAL = 65535
DO_SET_MISSION_CURRENT = 224
RESULT_UNSUPPORTED = 3


@pytest.mark.covers(
    "MISSION_CURRENT", source="measured mission/current/after_upload: no total without a mission; not started with one"
)
def test_the_current_item_is_told(station: Any) -> None:
    for items, told in (((), (0, NO_TOTAL, NO_MISSION, SUSPENDED)), (THREE, (0, 3, NOT_STARTED, SUSPENDED))):
        upload(station, items)
        assert current(station, *told) == told


@pytest.mark.covers("MISSION_SET_CURRENT", "MISSION_CURRENT", source="https://mavlink.io/en/messages/common.html")
def test_the_current_item_is_set(station: Any) -> None:
    """PX4's navigator has taken the mission over when MISSION_CURRENT tells it: before, it would begin it anew."""
    upload(station, (*THREE, Item()))
    first, third = (0, 4, NOT_STARTED, SUSPENDED), (2, 4, NOT_STARTED, SUSPENDED)
    assert current(station, *first) == first
    station.mav.mission_set_current_send(station.system, 1, 2)
    assert current(station, *third) == third
    station.mav.mission_set_current_send(station.system, 1, 4)
    assert is_said(station, "WPM: WP CURR CMD: Not in list\t")
    station.receive("MISSION_CURRENT")
    assert current(station, *third) == third


@pytest.mark.covers(
    "MAV_CMD_DO_SET_MISSION_CURRENT", source="measured mission/set_current/command/*: MAV_RESULT_UNSUPPORTED"
)
def test_the_command_for_it_is_not_known(station: Any) -> None:
    upload(station, THREE)
    assert station.command(DO_SET_MISSION_CURRENT, 1) == RESULT_UNSUPPORTED
