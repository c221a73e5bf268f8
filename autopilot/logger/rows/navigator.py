"""Where to go, and what became of the plan (topics/navigator.py)."""

import math
import struct

from sitl_emu.autopilot.logger.packing import by_name, zeros
from sitl_emu.autopilot.topics import (
    DistanceSensorModeChangeRequest,
    MissionResult,
    NavigatorMissionItem,
    NavigatorStatus,
    PositionSetpoint,
    PositionSetpointTriplet,
    RtlStatus,
    RtlTimeEstimate,
    VehicleRoi,
)

NAN = math.nan
TIME = struct.Struct("<Q")
_position_setpoint = by_name(
    "position_setpoint",
    PositionSetpoint,
    {
        "course": NAN,
        "cruising_throttle": NAN,
        **zeros("vx", "vy", "vz", "loiter_minor_radius", "loiter_orientation", "loiter_pattern"),
    },
)


def position_setpoint_triplet(record: PositionSetpointTriplet) -> bytes:
    """Where the navigator goes: previous, current, next."""
    return TIME.pack(record.timestamp) + b"".join(_position_setpoint(setpoint) for setpoint in record[1:])


vehicle_roi = by_name("vehicle_roi", VehicleRoi)
mission_result = by_name(
    "mission_result", MissionResult, zeros("home_position_counter", "item_do_jump_remaining", "execution_mode")
)
navigator_status = by_name("navigator_status", NavigatorStatus)
navigator_mission_item = by_name("navigator_mission_item", NavigatorMissionItem)
rtl_time_estimate = by_name("rtl_time_estimate", RtlTimeEstimate)
rtl_status = by_name("rtl_status", RtlStatus, zeros("has_vtol_approach"))
distance_sensor_mode_change_request = by_name("distance_sensor_mode_change_request", DistanceSensorModeChangeRequest)
