"""DO_SET_ROI and its kin: the region of interest that the navigator makes of them, and how a mission looks at it."""

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.topics import Topics, VehicleRoi
from sitl_emu.core import dialect as mavlink
from tests.unit.vehicle_command import vehicle_command

from .navigation_fake import PLACE, item
from .navigator_missions import ROI_LOCATION, TAKEOFF, WAYPOINT, run_until, started

NAV_ROI, LOCATION, WPNEXT_OFFSET, NONE, SET_ROI = 80, 195, 196, 197, 201


def made_of(number: int, *params: float) -> VehicleRoi:
    topics = Topics()
    Roi(cast(Any, SimpleNamespace(topics=topics, now_us=4000))).take(vehicle_command(number, *params))
    assert topics.vehicle_roi.timestamp == 4000
    return topics.vehicle_roi._replace(timestamp=0)


def test_a_location_an_offset_and_none() -> None:
    assert made_of(LOCATION, 0, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi(3, 47.4, 8.5, 500.0)
    offset = made_of(WPNEXT_OFFSET, 0, 0, 0, 0, 10.0, 20.0, 30.0)
    assert offset.mode == 1
    angles = (offset.pitch_offset, offset.roll_offset, offset.yaw_offset)
    assert angles == pytest.approx([math.radians(value) for value in (10.0, 20.0, 30.0)])
    assert made_of(NONE, 0, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi()


@pytest.mark.parametrize("number", [NAV_ROI, SET_ROI])
@pytest.mark.parametrize(("value", "mode"), [(0.0, 0), (1.0, 1), (3.0, 3), (4.9, 4), (math.nan, 0), (256.0, 0)])
def test_the_deprecated_commands_choose_a_mode_alone(number: int, value: float, mode: int) -> None:
    assert made_of(number, value, 0, 0, 0, 47.4, 8.5, 500.0) == VehicleRoi(mode, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("gimbal_looks", "reached"), [(0, [-1, 1, 2]), (1, [-1, 1])])
def test_a_waypoint_looks_at_the_region_of_interest_whatever_yaw_it_has(gimbal_looks: int, reached: list[int]) -> None:
    """MissionBase::heading_sp_update; the fake looks north and never turns. With MIS_MNT_YAW_CTL a gimbal looks."""
    roi = item(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 400, 0, 0)
    east = item(WAYPOINT, 40, 0, 8, 0.0, 0.0, 0.0, 90.0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), roi, east, MIS_MNT_YAW_CTL=gimbal_looks)
    vehicle.run(25.0)
    assert vehicle.reached == reached


def test_a_takeoffs_place_looks_at_it_too_once_the_vehicle_is_above_it() -> None:
    """Mission::handleTakeoff makes a waypoint of it, which waits for its heading; the fake looks north."""
    vehicle = started(item(ROI_LOCATION, 0, 400, 0), item(TAKEOFF, 0, 0, 30), item(WAYPOINT, 40, 0, 30))
    vehicle.run(5.0)
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.run(20.0)
    assert vehicle.topics.position_setpoint_triplet.current.yaw == pytest.approx(math.radians(90.0), abs=0.01)
    assert vehicle.reached[-1] == 0
    vehicle.turned = math.radians(90.0)
    run_until(vehicle, 2)


def test_a_mission_forgets_the_region_of_interest_of_before() -> None:
    """MissionBase::update_mission; gimbals do not."""
    vehicle = started(item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 80, 0, 8, 0.0, 0.0, 0.0, 90.0))
    vehicle.run(6.0)
    vehicle.command(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, *PLACE.reproject(4000, 0), 0.0)
    vehicle.run(1.0)
    assert vehicle.topics.position_setpoint_triplet.current.yaw == pytest.approx(0.0, abs=0.01)
    vehicle.set_mode(4, 3)
    vehicle.run(1.0)
    vehicle.set_mode(4, 4)
    vehicle.run(1.0)
    assert vehicle.topics.position_setpoint_triplet.current.yaw == pytest.approx(math.radians(90.0))
    assert vehicle.topics.vehicle_roi.mode == 3


def test_a_region_of_interest_in_a_mission() -> None:
    roi = item(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 20, 20, 0)
    vehicle = started(item(TAKEOFF, 0, 0, 8), roi, item(WAYPOINT, 40, 0, 8))
    run_until(vehicle, 1)
    assert vehicle.topics.vehicle_roi.mode == 3
    lat, lon = PLACE.reproject(20, 20)
    assert vehicle.topics.vehicle_roi.lat == pytest.approx(lat, abs=1e-6)
    assert vehicle.topics.vehicle_roi.lon == pytest.approx(lon, abs=1e-6)
