"""MAVSDK gimbal: the m600's is found, taken, pointed, turned by rates and given back."""

import math
from collections.abc import Iterator
from typing import Any

import pytest
from mavsdk.plugins.gimbal import Gimbal
from mavsdk.plugins.gimbal.gimbal import ControlMode, GimbalError, GimbalMode, SendMode

from tests.interop.mavsdk_vehicle import Vehicle, connected, until

INSTANCE = 0


@pytest.fixture
def m600() -> Iterator[Vehicle]:
    with connected("m600", INSTANCE) as vehicle:
        yield vehicle


def test_the_gimbal_is_pointed_by_who_has_taken_it(m600: Vehicle) -> None:
    gimbal = Gimbal(m600.system)
    one = until(gimbal, "gimbal_list", lambda value: bool(value.gimbals)).gimbals[0].gimbal_id
    gimbal.take_control(one, ControlMode.PRIMARY)
    gimbal.set_angles(one, 0.0, -45.0, 30.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)

    def there(value: Any) -> bool:
        angle = value.euler_angle_forward
        return math.isclose(angle.pitch_deg, -45.0, abs_tol=0.5) and math.isclose(angle.yaw_deg, 30.0, abs_tol=0.5)

    until(gimbal, "attitude", there)
    gimbal.set_angular_rates(one, 0.0, 0.0, -20.0, GimbalMode.YAW_FOLLOW, SendMode.STREAM)
    until(gimbal, "attitude", lambda value: value.euler_angle_forward.yaw_deg < 0.0)
    gimbal.release_control(one)
    with pytest.raises(GimbalError):
        gimbal.set_angles(one, 0.0, 0.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
