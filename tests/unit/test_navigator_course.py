"""GUIDED_COURSE of what has no wings: it stays where it was, at the height that is asked for."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle

AUTO, COURSE = 4, 19
CHANGE_ALTITUDE = mavlink.MAV_CMD_DO_CHANGE_ALTITUDE


def in_course(**parameters: float) -> FakeVehicle:
    vehicle = FakeVehicle(**parameters)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.north, vehicle.east = 12.0, -5.0
    assert vehicle.set_mode(AUTO, COURSE) == 0
    vehicle.run(0.2)
    assert vehicle.mode is NavState.GUIDED_COURSE
    return vehicle


def test_it_stays_where_it_entered_the_mode_and_changes_its_height() -> None:
    vehicle = in_course()
    current = vehicle.topics.position_setpoint_triplet.current
    assert current.type == SetpointType.POSITION
    assert PLACE.project(current.lat, current.lon) == pytest.approx((12.0, -5.0), abs=0.01)
    assert vehicle.result(CHANGE_ALTITUDE, HOME_ALT + 15.0) == 0
    vehicle.run(20.0)
    assert vehicle.mode is NavState.GUIDED_COURSE
    assert vehicle.up == pytest.approx(15.0, abs=0.1)


def test_beyond_the_fence_no_height_is_flown_to() -> None:
    vehicle = in_course(GF_ACTION=2, GF_MAX_VER_DIST=30.0)
    vehicle.take_texts()
    assert vehicle.result(CHANGE_ALTITUDE, HOME_ALT + 50.0) == 0
    vehicle.run(0.2)
    assert vehicle.take_texts() == ["Altitude change is outside geofence"]
    assert vehicle.topics.position_setpoint_triplet.current.alt == pytest.approx(HOME_ALT + 10.0, abs=1.0)


def test_a_reposition_without_a_place_keeps_the_mode() -> None:
    """As it is; with one, HOLD goes there."""
    vehicle, nan = in_course(), math.nan
    assert vehicle.result(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, nan, nan, nan, HOME_ALT + 12.0) == 0
    vehicle.run(0.2)
    assert now(vehicle.mode) is NavState.GUIDED_COURSE
    assert vehicle.reposition(20.0, 0.0, 10.0) == 0
    vehicle.run(0.2)
    assert vehicle.mode is NavState.AUTO_LOITER
