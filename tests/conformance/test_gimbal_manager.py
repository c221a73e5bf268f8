"""Gimbal protocol v2: a vehicle with a gimbal manager, and PX4's silence on one without (MNT_MODE_IN -1)."""

import math
from collections.abc import Iterator
from typing import Any

import pytest

REQUEST_MESSAGE = 512
CONFIGURE, PITCHYAW = 1001, 1000
GIMBAL_MANAGER_INFORMATION = 280
ACCEPTED, DENIED = 0, 2
UNCHANGED, RELEASE = -1, -3
SILENCE_S, TOLD_S = 1.0, 2.5
"""For what must not come; GIMBAL_MANAGER_STATUS and the gimbal's attitude come more often than this."""

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


@pytest.fixture
def left_pointing(station: Any) -> Iterator[None]:
    """Whoever was in control of the gimbal is again, and it points where it did, where it tells that."""
    status = station.receive("GIMBAL_MANAGER_STATUS", TOLD_S)
    attitude = None if status is None else station.receive("GIMBAL_DEVICE_ATTITUDE_STATUS", TOLD_S)
    yield
    if attitude is not None:
        assert station.command(CONFIGURE, 255, 190, UNCHANGED, UNCHANGED) == ACCEPTED
        assert (
            station.command(PITCHYAW, *pitch_and_yaw_deg(*attitude.q), math.nan, math.nan, attitude.flags) == ACCEPTED
        )
        assert station.command(CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED) == ACCEPTED
    if status is not None and status.primary_control_sysid:
        controller = status.primary_control_sysid, status.primary_control_compid
        assert station.command(CONFIGURE, *controller, UNCHANGED, UNCHANGED) == ACCEPTED


def pitch_and_yaw_deg(w: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Of a quaternion, as MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW has them."""
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return math.degrees(pitch), math.degrees(yaw)


@pytest.mark.usefixtures("left_pointing")
def test_only_who_is_in_control_points_it(station: Any) -> None:
    if not manages_a_gimbal(station):
        pytest.skip("this vehicle has no gimbal")
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == DENIED
    assert station.command(CONFIGURE, 255, 190, UNCHANGED, UNCHANGED) == ACCEPTED
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == ACCEPTED
    assert station.command(CONFIGURE, RELEASE, RELEASE, UNCHANGED, UNCHANGED) == ACCEPTED
    assert station.command(PITCHYAW, -30.0, 0.0, math.nan, math.nan) == DENIED
