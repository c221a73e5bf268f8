"""SCALED_IMU: IMU and magnetometer in thousandths (PX4: streams/SCALED_IMU.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_SCALED_IMU
GRAVITY: Final = 9.80665


def milli(value: float, unit: float = 1.0) -> int:
    """Thousandths of a unit, cut to the whole number as in C++, within int16."""
    return max(min(truncated(value / unit * 1000.0), 32767), -32768) if value == value else 0


def centidegrees(temperature_c: float) -> int:
    """Within int16; 0 is not known, so that 0 degrees are told as 0.01."""
    if not math.isfinite(temperature_c):
        return 0
    return max(min(rounded(temperature_c * 100.0), 32767), -32768) or 1


def fields(now_us: int, context: Context) -> Fields:
    """mG, mrad/s, mgauss; the temperature is the barometer's."""
    topics = context.topics
    sample = topics.sensor_combined
    accel = (milli(value, GRAVITY) for value in sample.accelerometer_m_s2)
    gyro = (milli(value) for value in sample.gyro_rad_s)
    mag = (milli(value) for value in topics.sensor_mag.magnetometer_ga)
    return (sample.timestamp // 1000, *accel, *gyro, *mag, centidegrees(topics.sensor_baro.temperature_c))
