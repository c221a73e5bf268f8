"""FOLLOW_TARGET is taken without an answer; its mode is there."""

from typing import Any

import pytest

FOLLOW_TARGET_MODE, HOLD = (4, 8), (4, 3)


@pytest.mark.covers("FOLLOW_TARGET", source="https://mavlink.io/en/messages/common.html#FOLLOW_TARGET")
@pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
def test_the_mode_can_be_chosen_and_the_message_is_taken(station: Any) -> None:
    station.set_mode(*FOLLOW_TARGET_MODE)
    try:
        zeros = (0.0, 0.0, 0.0)
        station.mav.follow_target_send(0, 3, 473977420, 85455940, 490.0, zeros, zeros, (1.0, *zeros), zeros, zeros, 0)
        assert station.receive("COMMAND_ACK", 0.5) is None
    finally:
        station.set_mode(*HOLD)
