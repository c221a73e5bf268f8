"""The ground station's half of the gimbal protocol against our manager and device, on simulated time."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.gimbal_manager import GimbalManager
from tests.typed import now

from .gcs_link import converse
from .mavlink_peer import Peer
from .test_components_gimbal import DATA, Rig

assert DATA is not None


def found(rig: Rig) -> GimbalManager:
    gimbal = GimbalManager(1)
    converse(rig, gimbal, 3.0)
    assert gimbal.ready
    return gimbal


def do(rig: Rig, gimbal: GimbalManager, command: Command, seconds: float = 2.0) -> str:
    converse(rig, command, 1.0, lambda: command.done)
    converse(rig, gimbal, seconds)
    assert command.outcome is not None
    return command.outcome.text


def test_the_manager_is_found_and_tells_of_its_gimbal() -> None:
    gimbal = found(Rig())
    assert gimbal.information.gimbal_device_id == 154
    assert gimbal.in_control == (0, 0)
    assert gimbal.angles_deg == pytest.approx((0.0, -90.0, 0.0), abs=0.1)


def test_a_vehicle_without_a_gimbal_says_so() -> None:
    gimbal = GimbalManager(1)
    converse(Peer(), gimbal, 15.0, lambda: gimbal.done)
    assert (gimbal.ready, gimbal.refusal) == (False, "denied")


@pytest.mark.parametrize("after_s", [2.0, 20.0])
def test_a_gimbal_that_the_manager_finds_later_is_found_then(after_s: float) -> None:
    rig, gimbal = Rig(with_gimbal=False), GimbalManager(1)
    converse(rig, gimbal, after_s)
    assert (gimbal.ready, gimbal.refusal) == (False, "denied" if after_s > 5.0 else "")
    rig.plug_in_gimbal()
    converse(rig, gimbal, 4.0, lambda: gimbal.ready)
    assert now(gimbal.ready) and now(gimbal.refusal) == ""


def test_control_is_taken_used_and_released() -> None:
    rig = Rig()
    gimbal = found(rig)
    assert do(rig, gimbal, gimbal.point(-30.0, 20.0)) == "denied"
    assert do(rig, gimbal, gimbal.take_control(255, 190)) == "accepted"
    assert gimbal.in_control == (255, 190)
    assert do(rig, gimbal, gimbal.point(-30.0, 20.0)) == "accepted"
    assert gimbal.angles_deg == pytest.approx((0.0, -30.0, 20.0), abs=0.1)
    assert not gimbal.yaw_is_north
    assert do(rig, gimbal, gimbal.release_control()) == "accepted"
    assert gimbal.in_control == (0, 0)


def test_yaw_can_be_held_against_north() -> None:
    rig = Rig()
    gimbal = found(rig)
    do(rig, gimbal, gimbal.take_control(255, 190))
    do(rig, gimbal, gimbal.point(-10.0, 45.0, yaw_is_north=True))
    assert gimbal.yaw_is_north
    assert gimbal.angles_deg == pytest.approx((0.0, -10.0, 45.0), abs=0.1)


@pytest.mark.parametrize("by", ["rates", "stick"])
def test_setpoints_turn_it(by: str) -> None:
    rig = Rig()
    gimbal = found(rig)
    do(rig, gimbal, gimbal.take_control(255, 190))
    do(rig, gimbal, gimbal.point(-45.0, 0.0))
    setpoint: Any = gimbal.turn(10.0, 0.0) if by == "rates" else gimbal.stick(1.0, 0.0)
    rig.send(setpoint)
    converse(rig, gimbal, 1.0)
    assert gimbal.angles_deg is not None
    assert gimbal.angles_deg[1] > -38.0


def test_a_place_to_look_at_is_a_command_with_a_position() -> None:
    gimbal = GimbalManager(1)
    (message,) = gimbal.look_at(47.1, 8.2, 500.0).on_time(0)
    assert (message.get_msgId(), message.command, message.frame) == (mavlink.MAVLINK_MSG_ID_COMMAND_INT, 195, 0)
    assert (message.x, message.y, message.z) == (471000000, 82000000, 500.0)
    (message,) = gimbal.look_ahead().on_time(0)
    assert message.command == 197
