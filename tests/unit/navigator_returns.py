"""Missions that a return meets, and a vehicle that flies one."""

import math

from sitl_emu.autopilot.storage.dataman import RALLY, MissionItem, Plan
from sitl_emu.core import dialect as mavlink

from .navigation_fake import PLACE, FakeVehicle, item

TAKEOFF, WAYPOINT, LAND = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LAND
LOITER_TIME, LOITER_TO_ALT = mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TO_ALT
LAND_START, JUMP, SPEED = mavlink.MAV_CMD_DO_LAND_START, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_CHANGE_SPEED
TRIGGER = mavlink.MAV_CMD_DO_TRIGGER_CONTROL
DIRECT, MISSION_LAND, FOLLOW, REVERSE = 1, 2, 3, 4
"""rtl_status.rtl_type."""
WITH_LANDING = (
    item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 60, 60, 8), item(WAYPOINT, 0, 60, 8),
    item(LAND, -40, 60),
)  # fmt: skip
WITHOUT = WITH_LANDING[:-1]
PATTERN = (
    item(TAKEOFF, 0, 0, 8), item(WAYPOINT, 60, 0, 8), item(WAYPOINT, 120, 0, 8), item(LAND_START),
    item(WAYPOINT, 60, 60, 12), item(WAYPOINT, 30, 60, 10), item(LAND, 0, 60),
)  # fmt: skip


def flying(*items: MissionItem, **parameters: float) -> FakeVehicle:
    """In MISSION, just armed."""
    vehicle = FakeVehicle(**{"RTL_RETURN_ALT": 15.0, "NAV_ACC_RAD": 2.0} | parameters)
    vehicle.run(3.0)
    vehicle.upload(*items)
    vehicle.run(0.1)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 0
    return vehicle


def run_until_reached(vehicle: FakeVehicle, seq: int) -> None:
    for _ in range(3000):
        vehicle.step()
        if vehicle.topics.mission_result.seq_reached == seq:
            return
    raise AssertionError(f"{seq} is not reached, only {vehicle.reached}")


def return_home(vehicle: FakeVehicle) -> list[str]:
    """Return, land; what was said."""
    vehicle.take_texts()
    vehicle.reached.clear()
    vehicle.current.clear()
    assert vehicle.set_mode(4, 5) == 0
    vehicle.run_until_disarmed()
    return vehicle.take_texts()


def place(vehicle: FakeVehicle) -> tuple[int, int]:
    return round(vehicle.north), round(vehicle.east)


def rally(vehicle: FakeVehicle, north_m: float, east_m: float, frame: int = 3) -> None:
    lat, lon = PLACE.reproject(north_m, east_m)
    point = MissionItem(
        0, frame, mavlink.MAV_CMD_NAV_RALLY_POINT, 1, 0, 0, 0, math.nan, round(lat * 1e7), round(lon * 1e7), 0.0
    )
    vehicle.dataman.store(RALLY, Plan((point,)), 0)
    vehicle.run(2.1)


def rtl_status(vehicle: FakeVehicle) -> tuple[int, int]:
    status = vehicle.topics.rtl_status
    return status.rtl_type, status.safe_point_index
