"""Where a gimbal looks, as telemetry knows it: for the pose of a camera that it carries."""

import math
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import euler, quaternion
from sitl_emu.gcs.telemetry import Telemetry

YAW_LOCK, IN_VEHICLE, IN_EARTH = 16, 32, 64
LIMIT_US = 200_000


def heard(*told: tuple[int, float, float, int], system: int = 1) -> Telemetry:
    """Telemetry that has heard (time_boot_ms, pitch, yaw, flags) of a gimbal."""
    telemetry = Telemetry(1)
    wire: Any = mavlink.MAVLink(None, srcSystem=system, srcComponent=154)
    for time_ms, pitch, yaw, flags in told:
        q = quaternion(0.0, pitch, yaw)
        message = mavlink.MAVLink_gimbal_device_attitude_status_message(0, 0, time_ms, flags, q, 0, 0, 0, 0, 0, 0, 0)
        telemetry.on_message(0, wire.decode(bytearray(message.pack(wire))))
    return telemetry


def looks(telemetry: Telemetry, time_us: int, heading: float = 0.0) -> tuple[float, float, float]:
    q = telemetry.gimbal_at(time_us, heading)
    assert q is not None
    return euler(q)


def test_between_two_messages_it_is_between_them() -> None:
    telemetry = heard((1000, -1.0, 0.0, IN_VEHICLE), (1100, -0.8, 0.1, IN_VEHICLE))
    assert looks(telemetry, 1_050_000) == pytest.approx((0.0, -0.9, 0.05), abs=0.01)
    assert looks(telemetry, 1_000_000) == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)


def test_yaw_counts_from_where_its_flags_say() -> None:
    follows = heard((1000, -0.5, 0.2, 12 | IN_VEHICLE))
    assert looks(follows, 1_000_000, heading=1.0) == pytest.approx((0.0, -0.5, 1.2), abs=1e-6)
    for flags in (12 | YAW_LOCK | IN_EARTH, 12 | YAW_LOCK):
        locked = heard((1000, -0.5, 0.2, flags))
        assert looks(locked, 1_000_000, heading=1.0) == pytest.approx((0.0, -0.5, 0.2), abs=1e-6)


def test_straight_down_turns_with_the_heading() -> None:
    down = heard((1000, -math.pi / 2, 0.0, IN_VEHICLE))
    q = down.gimbal_at(1_000_000, 0.7)
    assert q == pytest.approx(quaternion(0.0, -math.pi / 2, 0.7), abs=1e-6)


def test_it_is_not_known_before_it_was_heard_nor_long_after() -> None:
    assert heard().gimbal_at(1_000_000, 0.0) is None
    telemetry = heard((1000, -0.5, 0.2, IN_VEHICLE))
    assert telemetry.gimbal_at(999_000, 0.0) is None
    assert telemetry.gimbal_at(1_000_000 + LIMIT_US, 0.0) is not None
    assert telemetry.gimbal_at(1_001_000 + LIMIT_US, 0.0) is None


def test_another_systems_gimbal_is_not_ours() -> None:
    assert heard((1000, -0.5, 0.2, IN_VEHICLE), system=2).gimbal_at(1_000_000, 0.0) is None
