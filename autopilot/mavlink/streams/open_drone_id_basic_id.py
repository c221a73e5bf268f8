"""OPEN_DRONE_ID_BASIC_ID: who the aircraft is (PX4: streams/OPEN_DRONE_ID_BASIC_ID.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_BASIC_ID
ID_TYPE_SERIAL_NUMBER: Final = 1


def stamp(now_us: int, context: Context) -> int:
    """Once per vehicle_status, which comes twice a second and when it changes."""
    return context.topics.vehicle_status.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """On request; the identifier is the system's number."""
    name = f"SITL-EMU-{context.system_id:03d}".encode().ljust(20, b"\0")
    ua_type = context.traits.odid_ua_type
    return (0, 0, *(0,) * 20, ID_TYPE_SERIAL_NUMBER, ua_type, *name)
