"""Setpoints, sticks and overridden channels over MAVLink, as measured on PX4 v1.18."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.topics import (
    ManualControlSetpoint,
    ManualControlSwitches,
    Quaternion,
    Vector3,
)
from sitl_emu.core import dialect as mavlink
from tests.typed import now
from tests.unit.mavlink_peer import ALT_M, LAT_DEG, LON_DEG, ONBOARD, Peer, command_long, only


def position_target(mask: int, frame: int = 1, **fields: float) -> Any:
    values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0) | fields
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, coordinate_frame=frame, type_mask=mask, **values
    )


def test_local_setpoints() -> None:
    peer = Peer()
    peer.now_us = 1000
    peer.send(position_target(0b1101_1111_1000, x=1.0, y=2.0, z=-3.0))
    setpoint = peer.topics.offboard_setpoint
    assert setpoint.timestamp == 1000
    assert setpoint.trajectory is not None
    assert setpoint.trajectory.position == (1.0, 2.0, -3.0)
    assert all(value != value for value in (*setpoint.trajectory.velocity, setpoint.trajectory.yaw))
    peer.send(position_target(0b0101_1100_0111, 8, vx=2.0))
    assert peer.topics.offboard_setpoint.trajectory is not None
    assert peer.topics.offboard_setpoint.trajectory.velocity == pytest.approx((2.0, 0.0, 0.0))


def test_a_vehicle_that_is_told_so_listens_to_no_setpoints() -> None:
    """MAV_FWDEXTSP 0: nothing is taken, and nothing refused (Mavlink::get_forward_externalsp)."""
    peer = Peer()
    peer.now_us = 1000
    peer.parameters.set("MAV_FWDEXTSP", 0)
    peer.send(position_target(0xDF8))
    peer.send(position_target(0xDFF))
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.5))
    assert peer.topics.offboard_setpoint.timestamp == 0
    assert list(peer.texts.recent) == []
    peer.parameters.set("MAV_FWDEXTSP", 1)
    peer.send(position_target(0xDF8))
    assert peer.topics.offboard_setpoint.timestamp == 1000


LOCAL_REFUSED = "SET_POSITION_TARGET_LOCAL_NED "


@pytest.mark.parametrize(
    ("mask", "frame", "text"),
    [
        (0xDF8, 1, ""),
        (0x200 | 0xDF8, 1, ""),
        (0x200 | 0xC38, 1, "force not supported"),
        (0xDFF, 1, "invalid"),
        (0xDC7, 8, ""),
        (0xDCF, 8, "invalid"),
        (0xDF8, 7, "coordinate frame 7 unsupported"),
    ],
)
def test_what_px4_refuses_of_local_setpoints(mask: int, frame: int, text: str) -> None:
    """A place; a force without acceleration; with it; nothing; a velocity of the body, whole and not; an offset."""
    peer = Peer()
    peer.now_us = 1000
    peer.send(position_target(mask, frame))
    assert (peer.topics.offboard_setpoint.timestamp == 0) == bool(text)
    assert [each.text for each in peer.texts.recent] == ([f"{LOCAL_REFUSED}{text}\t"] if text else [])


@pytest.mark.parametrize(
    ("frame", "mask", "down_m", "text"),
    [
        (5, 0xDF8, ALT_M - 10.0, ""),
        (6, 0xDF8, -10.0, ""),
        (11, 0xDF8, None, ""),
        (3, 0xDF8, None, "SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 3\t"),
        (3, 0xDC7, math.nan, ""),
        (6, 0xDFF, None, ""),
    ],
)
def test_frames_of_global_setpoints(frame: int, mask: int, down_m: float | None, text: str) -> None:
    """AMSL, above home, above unknown ground, in a frame not of PX4's; a velocity, where it does not count; nothing."""
    peer = Peer()
    peer.run(0.1)
    peer.fly()
    place = (round(LAT_DEG * 1e7), round(LON_DEG * 1e7), 10.0)
    peer.send(mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, mask, *place, *(0.0,) * 8))
    told = peer.topics.offboard_setpoint.trajectory
    assert (told is None) == (down_m is None)
    if told is not None:
        assert told.position[2] == pytest.approx(down_m, abs=0.01, nan_ok=True)
    assert [each.text for each in peer.texts.recent] == [text] * bool(text)


def test_a_home_above_the_origin_lowers_heights_above_home() -> None:
    """The sign is PX4's (handle_message_set_position_target_global_int): home lies 2 m above, so 10 m become 8 m."""
    peer = Peer()
    peer.run(0.1)
    peer.fly()
    peer.topics.home_position = peer.topics.home_position._replace(alt=ALT_M + 2.0)
    place = (round(LAT_DEG * 1e7), round(LON_DEG * 1e7), 10.0)
    peer.send(mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, 0xDF8, *place, *(0.0,) * 8))
    told = peer.topics.offboard_setpoint.trajectory
    assert told is not None
    assert told.position[2] == pytest.approx(-8.0, abs=0.01)


def test_global_setpoints() -> None:
    peer = Peer()
    peer.run(0.1)
    peer.fly()
    message = mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, 6, 0xDF8, round(LAT_DEG * 1e7) + 1000, round(LON_DEG * 1e7), 10.0, 0, 0, 0, 0, 0, 0, 0, 0
    )
    peer.send(message)
    setpoint = peer.topics.offboard_setpoint.trajectory
    assert setpoint is not None
    assert setpoint.position == pytest.approx((11.12, 0.0, -10.0), abs=0.02)
    assert peer.topics.home_position.alt == ALT_M


def test_attitude_and_rates() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0b111, [1, 0, 0, 0], 0, 0, 0, 0.5))
    assert peer.topics.offboard_setpoint.attitude is not None
    assert peer.topics.offboard_setpoint.attitude.thrust_body == (0.0, 0.0, -0.5)
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0x80, [1, 0, 0, 0], 0.1, 0.2, 0.3, 0.5))
    assert peer.topics.offboard_setpoint.rates is not None
    assert peer.topics.offboard_setpoint.rates.rates == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("mask", [0x40, 0x80 | 0x40, 0x80 | 0x1, 0x80 | 0x7])
def test_an_attitude_target_without_thrust_or_without_roll_or_pitch_is_none(mask: int) -> None:
    """mavlink_receiver.cpp, handle_message_set_attitude_target."""
    peer = Peer()
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1, 0, 0, 0], 0.1, 0.2, 0.3, 0.5))
    assert peer.topics.offboard_setpoint.timestamp == 0


@pytest.mark.parametrize(
    ("mav_type", "thrust_body"),
    [
        (mavlink.MAV_TYPE_GROUND_ROVER, (0.5, 0.0, 0.0)),
        (mavlink.MAV_TYPE_OCTOROTOR, (0.0, 0.0, -0.5)),
        (mavlink.MAV_TYPE_DODECAROTOR, (0.0, 0.0, 0.0)),
    ],
)
def test_the_kind_of_vehicle_says_where_thrust_goes(mav_type: int, thrust_body: Vector3) -> None:
    """MavlinkReceiver::fill_thrust, which does not know them all."""
    peer = Peer()
    peer.parameters.set("MAV_TYPE", mav_type)
    for mask in (0b111, 0x80):
        peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1, 0, 0, 0], 0, 0, 0, 0.5))
        told = peer.topics.offboard_setpoint.attitude or peer.topics.offboard_setpoint.rates
        assert told is not None and told.thrust_body == thrust_body


def test_thrust_along_all_axes_and_rates_that_are_not_told() -> None:
    peer = Peer()
    told = [0.0, 0.2, -1.6]
    mask = 0x80 | 0x20 | 0x4
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1, 0, 0, 0], math.nan, 1, 9, 0, told))
    rates = peer.topics.offboard_setpoint.rates
    assert rates is not None
    assert rates.thrust_body == pytest.approx(told) and rates.rates[1] == 1.0
    assert math.isnan(rates.rates[0]) and math.isnan(rates.rates[2])


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 0.0)])
def test_an_attitude_is_passed_on_as_it_comes(q: Quaternion) -> None:
    """handle_message_set_attitude_target does not look at it: whatever it is, offboard control goes on."""
    peer = Peer()
    peer.now_us = 2000
    peer.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0b111, q, 0, 0, 0, -1.5))
    setpoint = peer.topics.offboard_setpoint
    assert setpoint.timestamp == 2000 and setpoint.attitude is not None
    assert setpoint.attitude.q_d == pytest.approx(q, nan_ok=True)
    assert setpoint.attitude.thrust_body == (0.0, 0.0, 1.5) and math.isnan(setpoint.attitude.yaw_sp_move_rate)


def test_a_joystick_is_an_input() -> None:
    peer = Peer()
    peer.send(mavlink.MAVLink_manual_control_message(1, 500, -1000, 250, 0, 3), ONBOARD)
    sticks = peer.topics.manual_control_mavlink
    assert (sticks.data_source, sticks.pitch, sticks.roll, sticks.throttle, sticks.buttons) == (3, 0.5, -1.0, -0.5, 3)
    peer.send(mavlink.MAVLink_manual_control_message(2, 0, 0, 0, 0, 0), ONBOARD)
    assert peer.topics.manual_control_mavlink is sticks
    peer.send(mavlink.MAVLink_manual_control_message(1, 2000, 0, -500, 0, 0))
    assert peer.topics.manual_control_mavlink[1:6] == (2, 0.0, 0.0, 0.0, 0.0)


def test_auxiliary_sticks_of_a_joystick_are_those_that_it_says_it_has() -> None:
    peer = Peer()
    extensions = {"enabled_extensions": 0b0000_1100, "aux1": 500, "aux2": -1001, "aux3": 700}
    peer.send(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0, **extensions))
    assert peer.topics.manual_control_mavlink.aux == (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_sticks_are_told_with_the_switches_of_the_rc() -> None:
    """Two bits each for return, hold, offboard and kill, at 2, 6, 10 and 12 (PX4's MANUAL_CONTROL.hpp)."""
    peer = Peer()
    peer.topics.manual_control_setpoint = ManualControlSetpoint(
        1, True, 0.5, -0.25, 0.0, -1.0, buttons=7, aux=(1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    )
    peer.topics.manual_control_switches = ManualControlSwitches(1, return_to_launch=1, loiter=3, kill=3)
    told = only(peer.send(command_long(512, 69)), "MANUAL_CONTROL")[0]
    assert (told.x, told.y, told.z, told.r, told.target) == (-250, 500, 0, 0, 1)
    assert told.buttons == 1 << 2 | 3 << 6 | 3 << 12
    assert (told.enabled_extensions, told.aux1, told.aux2, told.aux6) == (0xFC, 1000, 0, -1000)


def test_a_target_to_follow_is_kept_as_it_is_told() -> None:
    """handle_message_follow_target; the estimator of the mode knows what to do with one that has no height."""
    peer = Peer()
    peer.now_us = 1_000
    place, motion = (473977420, 85455940, math.nan), ((1.0, 2.0, 3.0), (0.0,) * 3)
    zeros, covariance = (0.0,) * 3, (0.0,) * 3
    peer.send(mavlink.MAVLink_follow_target_message(0, 1, *place, *motion, (1.0, 0, 0, 0), zeros, covariance, 0))
    told = peer.topics.follow_target
    assert (told.timestamp, told.velocity) == (1_000, (1.0, 2.0, 3.0))
    assert told.lat == pytest.approx(47.397742) and math.isnan(told.alt)


def test_limits_of_speed_are_kept_as_they_are_told() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.send(mavlink.MAVLink_set_velocity_limits_message(2.0, math.nan, 0.5, 1, 1))
    told = peer.topics.velocity_limits
    assert (told.timestamp, told.horizontal_velocity, told.yaw_rate) == (1_000, 2.0, 0.5)
    assert math.isnan(told.vertical_velocity)


@pytest.mark.parametrize(
    ("channels", "values"),
    [
        ((1000, 2000, 65535, 1500, 0, 65535, 65535, 65535), (1000, 2000, 65535, 1500, 0)),
        ((0,) * 8, (0,) * 8),
        ((1500,) * 8 + (1100, 65534, 0), (1500,) * 8 + (1100, 65534)),
        ((65535,) * 8, ()),
    ],
)
def test_channels_that_are_ignored(channels: tuple[int, ...], values: tuple[int, ...]) -> None:
    """UINT16_MAX ignores any channel, 0 only those above the eighth; PX4 takes 65534 for a value.

    Between others an ignored one stays as it is (handle_message_rc_channels_override).
    """
    peer = Peer()
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *channels))
    assert peer.topics.input_rc.values == values


def test_the_first_link_with_channels_is_the_receiver() -> None:
    """Each link's is an instance of input_rc of its own, and PX4 reads the first (rc_update.h)."""
    peer = Peer()
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(1100,) * 8), ONBOARD)
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(1900,) * 8))
    assert peer.topics.input_rc.values == (1100,) * 8
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(1200,) * 8), ONBOARD)
    assert now(peer.topics).input_rc.values == (1200,) * 8


def test_overridden_channels_are_shown() -> None:
    peer = Peer()
    peer.now_us = 1_000_000
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(1500,) * 8))
    shown = only(peer.send(command_long(512, 65)), "RC_CHANNELS")[0]
    assert (shown.chan1_raw, shown.chan9_raw, shown.chancount, shown.rssi) == (1500, 65535, 8, 100)
    peer.now_us = 2_000_000
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *(65535,) * 8))
    released = only(peer.send(command_long(512, 65)), "RC_CHANNELS")[0]
    assert (released.chan1_raw, released.chancount, released.rssi) == (65535, 0, 0)
