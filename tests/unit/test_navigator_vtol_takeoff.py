"""VTOL_TAKEOFF of what has no wings; after PX4's VtolTakeoff."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle

NAN = math.nan
SOUTH_EAST = PLACE.reproject(-30.0, 30.0)


def commanded(
    alt_m: float, *, param2: float = 0.0, param4: float = NAN, kind: VehicleKind = VehicleKind.MULTICOPTER
) -> FakeVehicle:
    vehicle = FakeVehicle(kind)
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.run(1.0)
    assert vehicle.result(mavlink.MAV_CMD_NAV_VTOL_TAKEOFF, 0, param2, NAN, param4, *SOUTH_EAST, alt_m) == 0
    vehicle.run(0.2)
    return vehicle


def asked_of_others(vehicle: FakeVehicle) -> list[VehicleCommand]:
    return vehicle.navigator._state.outgoing.waiting


@pytest.mark.parametrize(("param2", "param4", "yaw_deg"), [(0.0, NAN, 135.0), (0.0, 20.0, 135.0), (3.0, 200.0, -160.0)])
def test_it_climbs_here_turns_and_asks_for_a_transition_that_nobody_gives(
    param2: float, param4: float, yaw_deg: float
) -> None:
    vehicle = commanded(HOME_ALT + 8.0, param2=param2, param4=param4)
    current = vehicle.topics.position_setpoint_triplet.current
    assert (current.type, current.alt, math.isnan(current.yaw)) == (SetpointType.TAKEOFF, HOME_ALT + 8.0, True)
    assert PLACE.project(current.lat, current.lon) == pytest.approx((0.0, 0.0), abs=0.01)
    vehicle.run(20.0)
    current = vehicle.topics.position_setpoint_triplet.current
    assert (current.type, current.alt) == (SetpointType.POSITION, HOME_ALT + 8.0)
    assert math.degrees(current.yaw) == pytest.approx(yaw_deg, abs=0.01)
    assert asked_of_others(vehicle) == []
    vehicle.turned = current.yaw
    vehicle.run(1.0)
    (asked,) = asked_of_others(vehicle)
    fields = (asked.command, *asked[1:8], asked.target_component, asked.from_external)
    assert fields == (mavlink.MAV_CMD_DO_VTOL_TRANSITION, 4.0, 0.0, 80.0, current.yaw, 0.0, 0.0, current.alt, 0, False)
    vehicle.run(10.0)
    assert vehicle.modes[-1] == "AUTO_VTOL_TAKEOFF"
    assert vehicle.take_texts() == ["Armed by external command", "Takeoff detected"]
    assert asked_of_others(vehicle) == [asked]


def test_a_rover_asks_at_once() -> None:
    rover = commanded(HOME_ALT + 8.0, kind=VehicleKind.ROVER_ACKERMANN)
    assert rover.mode is NavState.AUTO_VTOL_TAKEOFF
    rover.run(0.5)
    assert [command.command for command in asked_of_others(rover)] == [mavlink.MAV_CMD_DO_VTOL_TRANSITION]


@pytest.mark.parametrize("unknown", [NAN, math.inf])
def test_without_a_place_any_heading_will_do_and_without_a_height_it_stays(unknown: float) -> None:
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.result(mavlink.MAV_CMD_NAV_VTOL_TAKEOFF, 0, 0, 0, NAN, unknown, unknown, HOME_ALT + 8.0)
    vehicle.run(20.0)
    assert len(asked_of_others(vehicle)) == 1
    vehicle.result(mavlink.MAV_CMD_NAV_VTOL_TAKEOFF, 0, 0, 0, NAN, *SOUTH_EAST, unknown)
    vehicle.run(1.0)
    assert len(asked_of_others(vehicle)) == 1
