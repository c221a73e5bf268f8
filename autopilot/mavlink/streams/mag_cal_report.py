"""MAG_CAL_REPORT: the magnetometer's calibration as the parameters have it (PX4: streams/MAG_CAL_REPORT.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_MAG_CAL_REPORT
CONFIDENCE: Final = 1.0
SCALE_FACTOR: Final = 1.0


def stamp(now_us: int, context: Context) -> int:
    """Once per change of parameters."""
    return context.parameters.notifications


def fields(now_us: int, context: Context) -> Fields | None:
    """Gauss; nothing before the magnetometer has spoken, or while no calibration is its own."""
    parameters = context.parameters
    if not context.topics.sensor_mag.timestamp or parameters["CAL_MAG0_ID"] != DEVICE_IDS["MAG"]:
        return None
    names = (f"CAL_MAG0_{axis}{part}" for part in ("OFF", "SCALE", "ODIAG") for axis in "XYZ")
    numbers = (float(parameters[name]) for name in names)
    rotation = max(int(parameters["CAL_MAG0_ROT"]), 0)
    ends = (CONFIDENCE, rotation, rotation, SCALE_FACTOR)
    return (0.0, *numbers, 0, 0, mavlink.MAG_CAL_SUCCESS, 0, *ends)
