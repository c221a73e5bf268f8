"""Poses from outside are taken in silence; without EKF2_EV_CTRL they change nothing."""

import math
import time
from typing import Any

import pytest

FAR_M = 500.0
UNKNOWN = (math.nan,) + (0.0,) * 20


@pytest.mark.covers(
    "ODOMETRY", "VISION_POSITION_ESTIMATE", source="https://mavlink.io/en/messages/common.html#ODOMETRY"
)
@pytest.mark.covers("ODOMETRY", source="PX4 parameter EKF2_EV_CTRL: 0 by default")
def test_without_ev_ctrl_they_change_nothing(station: Any) -> None:
    for _ in range(20):
        station.mav.vision_position_estimate_send(0, FAR_M, FAR_M, -FAR_M, 0.0, 0.0, 0.0, UNKNOWN)
        station.mav.odometry_send(
            0, 1, 12, FAR_M, FAR_M, -FAR_M, (1.0, 0.0, 0.0, 0.0), 0, 0, 0, 0, 0, 0, UNKNOWN, UNKNOWN, 0, 2, 100
        )
        time.sleep(0.05)
    place = station.receive("LOCAL_POSITION_NED")
    assert math.hypot(place.x, place.y, place.z) < 20.0
