"""SCALED_IMU: IMU and magnetometer in thousandths (PX4: streams/SCALED_IMU.hpp)."""

from typing import Final

from sitl_emu.autopilot.constants import IMU_TEMPERATURE_C
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_SCALED_IMU
GRAVITY: Final = 9.80665
IMU_TEMPERATURE_CDEG: Final = round(IMU_TEMPERATURE_C * 100.0)


def milli(value: float, unit: float = 1.0) -> int:
    """Thousandths of a unit, cut to the whole number as in C++, within int16."""
    return max(min(truncated(value / unit * 1000.0), 32767), -32768) if value == value else 0


def fields(now_us: int, context: Context) -> Fields:
    """mG, mrad/s, mgauss, centidegrees."""
    topics = context.topics
    sample = topics.sensor_combined
    accel = (milli(value, GRAVITY) for value in sample.accelerometer_m_s2)
    gyro = (milli(value) for value in sample.gyro_rad_s)
    mag = (milli(value) for value in topics.sensor_mag.magnetometer_ga)
    return (sample.timestamp // 1000, *accel, *gyro, *mag, IMU_TEMPERATURE_CDEG)
