"""A return straight home or to a rally point, and what it does before it lands; after PX4's RtlDirect."""

import math

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.storage.dataman import RALLY, MissionItem, Plan
from sitl_emu.core import dialect as mavlink

from .navigation_fake import FakeVehicle
from .navigator_returns import (
    DIRECT,
    WITHOUT,
    flying,
    place,
    rally,
    return_home,
    rtl_status,
    run_until_reached,
)


def test_without_a_mission_it_goes_straight_home() -> None:
    vehicle = FakeVehicle(RTL_TYPE=2)
    vehicle.run(3.0)
    vehicle.take_off(10.0)
    vehicle.reposition(40.0, 0.0, 10.0)
    vehicle.run(12.0)
    texts = return_home(vehicle)
    assert "RTL: land at destination" in texts
    assert place(vehicle) == (0, 0)


def test_on_the_ground_it_refuses_to_take_off() -> None:
    vehicle = FakeVehicle(RTL_TYPE=2)
    vehicle.run(3.0)
    vehicle.upload(*WITHOUT)
    vehicle.run(2.5)
    assert vehicle.arm() == 0
    vehicle.take_texts()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(1.0)
    assert "No valid mission available, refusing takeoff" in vehicle.take_texts()
    assert vehicle.topics.position_setpoint_triplet.current.type == SetpointType.IDLE


def test_a_rally_point_is_arrived_at_with_any_heading() -> None:
    vehicle = flying(*WITHOUT)
    run_until_reached(vehicle, 1)
    rally(vehicle, 60.0, 40.0)
    assert rtl_status(vehicle) == (DIRECT, 0)
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run(12.0)
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.run_until_disarmed()
    assert place(vehicle) == (60, 40)


def test_a_rally_point_where_nobody_has_said_where_is_none() -> None:
    """RTL::extractValidSafePointPosition."""
    vehicle = flying(*WITHOUT)
    nowhere = MissionItem(0, 3, mavlink.MAV_CMD_NAV_RALLY_POINT, 1, 0, 0, 0, math.nan, 0, 0, 0.0)
    beyond = nowhere._replace(x=910000000, y=10)
    vehicle.parameters.set("RTL_TYPE", 5)
    vehicle.dataman.store(RALLY, Plan((nowhere, beyond)), 0)
    vehicle.run(2.1)
    assert rtl_status(vehicle) == (DIRECT, 255)


def test_a_return_that_waits_moves_to_its_place_again_before_it_lands() -> None:
    """RtlDirect::_updateRtlState, by what it tells the log (4 and 5 are a VTOL's); its height does not matter there."""
    vehicle = flying(*WITHOUT, RTL_TYPE=0, RTL_LAND_DELAY=3.0, RTL_DESCEND_ALT=6.0)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    phases: list[int] = []
    heights: dict[int, float] = {}
    looks_down: list[int] = []
    vehicle.parameters.set("RTL_LOITER_RAD", 60.0)
    circles: list[float] = []
    while vehicle.armed:
        vehicle.step()
        told, triplet = vehicle.topics.navigator_mission_item, vehicle.topics.position_setpoint_triplet
        if vehicle.mode is NavState.AUTO_RTL and phases[-1:] != [told.sequence_current]:
            phases.append(told.sequence_current)
            heights[told.sequence_current] = triplet.current.alt_acceptance_radius
            circles.append(told.loiter_radius)
            looks_down.append(vehicle.topics.distance_sensor_mode_change_request.request_on_off)
            if told.sequence_current == 2:
                assert (triplet.next.valid, triplet.next.type, triplet.next.alt) == (True, SetpointType.LAND, 0.0)
        if phases[-1:] == [3]:
            vehicle.up = 12.0
    assert phases == [0, 1, 2, 3, 6, 7, 8]
    assert looks_down == [0, 0, 1, 1, 1, 1, 0]
    assert circles == [80, 80, 60, 60, 60, 60, 80], "a place without a circle keeps the last one"
    assert math.isnan(heights[1])
    assert heights[3] == heights[6] > 1e38


def test_a_return_that_waits_turns_before_it_lands() -> None:
    vehicle = flying(*WITHOUT, RTL_TYPE=0, RTL_LAND_DELAY=2.0, RTL_DESCEND_ALT=6.0)
    run_until_reached(vehicle, 1)
    assert vehicle.set_mode(4, 5) == 0
    while vehicle.topics.navigator_mission_item.sequence_current != 3:
        vehicle.step()
    assert math.isnan(vehicle.topics.position_setpoint_triplet.current.yaw)
    vehicle.turned = 2.0
    vehicle.run(10.0)
    assert vehicle.topics.navigator_mission_item.sequence_current == 6
    vehicle.turned = 0.0
    vehicle.run(0.2)
    assert vehicle.topics.navigator_mission_item.sequence_current == 7


def test_a_rally_point_over_terrain_is_none() -> None:
    vehicle = flying(*WITHOUT)
    rally(vehicle, 60.0, 40.0, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT)
    assert rtl_status(vehicle) == (DIRECT, 255)


def test_type_5_without_a_rally_point_lands_where_it_is_and_warns() -> None:
    vehicle = FakeVehicle(RTL_TYPE=5)
    vehicle.run(5.0)
    assert set(vehicle.take_texts()) == {"No rally point configured"}
    vehicle.take_off(10.0)
    vehicle.reposition(40.0, 0.0, 10.0)
    vehicle.run(12.0)
    return_home(vehicle)
    assert place(vehicle) == (40, 0)
