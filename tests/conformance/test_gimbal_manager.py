"""Gimbal protocol v2: a vehicle with a gimbal manager, and PX4's silence on one without (MNT_MODE_IN -1)."""

import math
from typing import Any

import pytest

REQUEST_MESSAGE = 512
CONFIGURE, PITCHYAW = 1001, 1000
GIMBAL_MANAGER_INFORMATION = 280
ACCEPTED, DENIED = 0, 2
UNCHANGED, RELEASE = -1, -3
SILENCE_S = 1.0

pytestmark = pytest.mark.covers(
    "MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW",
    "MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE",
    source="https://mavlink.io/en/services/gimbal_v2.html",
)


def manages_a_gimbal(station: Any) -> bool:
    return bool(station.command(REQUEST_MESSAGE, GIMBAL_MANAGER_INFORMATION) == ACCEPTED)


@pytest.mark.covers(
    "GIMBAL_MANAGER_INFORMATION",
    source="measured command/disarmed/*/1000, command/disarmed/*/1001: what PX4 answers without a gimbal",
)
def test_without_a_gimbal_nobody_answers(station: Any) -> None:
    if manages_a_gimbal(station):
        pytest.skip("this vehicle has a gimbal")
    assert station.command(CONFIGURE, 255, 190, UNCHANGED, UNCHANGED, limit_s=SILENCE_S) is None
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan, limit_s=SILENCE_S) is None


def test_only_who_is_in_control_points_it(station: Any) -> None:
    if not manages_a_gimbal(station):
        pytest.skip("this vehicle has no gimbal")
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == DENIED
    assert station.command(CONFIGURE, 255, 190, UNCHANGED, UNCHANGED) == ACCEPTED
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == ACCEPTED
    assert station.command(CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED) == ACCEPTED
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == DENIED
