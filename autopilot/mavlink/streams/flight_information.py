"""FLIGHT_INFORMATION: when it was armed, and the number of the flight (PX4: streams/FLIGHT_INFORMATION.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION


def fields(now_us: int, context: Context) -> Fields:
    """UTC µs; 0 for what has not happened."""
    status = context.topics.vehicle_status
    armed_utc_us = context.boot_unix_us + status.armed_time if status.armed else 0
    takeoff_utc_us = context.boot_unix_us + status.takeoff_time if status.takeoff_time else 0
    return (armed_utc_us, takeoff_utc_us, int(context.parameters["COM_FLIGHT_UUID"]), now_us // 1000, 0)
