"""FLIGHT_INFORMATION: when it was armed, and the number of the flight (PX4: streams/FLIGHT_INFORMATION.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION


def fields(now_us: int, context: Context) -> Fields:
    """µs since boot, though the message means UTC: so PX4 fills it. 0 for what has not happened."""
    status = context.topics.vehicle_status
    flight = int(context.parameters["COM_FLIGHT_UUID"])
    armed_us = status.armed_time if status.armed else 0
    return (armed_us, status.takeoff_time, flight, now_us // 1000, 0)
