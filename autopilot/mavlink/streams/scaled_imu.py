"""SCALED_IMU: IMU and magnetometer in thousandths (PX4: streams/SCALED_IMU.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_SCALED_IMU
GRAVITY = 9.80665


def milli(value: float, unit: float = 1.0) -> int:
    """Thousandths of a unit, within int16."""
    return max(min(round(value / unit * 1000.0), 32767), -32768) if value == value else 0


def fields(now_us: int, context: Context) -> Fields:
    """mG, mrad/s, mgauss."""
    topics = context.topics
    sample = topics.sensor_combined
    accel = (milli(value, GRAVITY) for value in sample.accelerometer_m_s2)
    gyro = (milli(value) for value in sample.gyro_rad_s)
    mag = (milli(value) for value in topics.sensor_mag.magnetometer_ga)
    return (sample.timestamp // 1000, *accel, *gyro, *mag, 0)
