"""Missions flown by the navigation fake: uploaded, started, and followed to an item."""

from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import FakeVehicle

TAKEOFF, WAYPOINT, LAND = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LAND
RTL, DELAY, LOITER_TIME = (
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
    mavlink.MAV_CMD_NAV_DELAY,
    mavlink.MAV_CMD_NAV_LOITER_TIME,
)
LOITER_TO_ALT, ROI_LOCATION = mavlink.MAV_CMD_NAV_LOITER_TO_ALT, mavlink.MAV_CMD_DO_SET_ROI_LOCATION
JUMP, SPEED = mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_CHANGE_SPEED
NO_MISSION, NOT_STARTED, ACTIVE, PAUSED, COMPLETE = 1, 2, 3, 4, 5
ROVER = {"RA_WHEEL_BASE": 0.321, "RA_MAX_STR_ANG": 0.5236, "RA_ACC_RAD_GAIN": 2.0, "RA_ACC_RAD_MAX": 3.0}


def uploaded(*items: MissionItem, rover: bool = False, **parameters: float) -> FakeVehicle:
    """On the ground, with a mission."""
    vehicle = FakeVehicle(VehicleKind.ROVER_ACKERMANN if rover else VehicleKind.MULTICOPTER, **parameters)
    vehicle.run(3.0)
    vehicle.upload(*items)
    vehicle.run(0.1)
    return vehicle


def started(*items: MissionItem, rover: bool = False, **parameters: float) -> FakeVehicle:
    """Armed in MISSION."""
    vehicle = uploaded(*items, rover=rover, **parameters)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 0
    return vehicle


def mission_state(vehicle: FakeVehicle) -> int:
    return vehicle.topics.mission_result.mission_state


def run_until(vehicle: FakeVehicle, reached: int, limit_s: float = 60.0) -> None:
    for _ in range(round(limit_s * 25)):
        vehicle.step()
        if vehicle.topics.mission_result.seq_reached == reached:
            return
    raise AssertionError(f"{reached} is not reached, only {vehicle.reached}")
