"""VIBRATION: vibration metrics of the IMU (PX4: streams/VIBRATION.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_VIBRATION


def fields(now_us: int, context: Context) -> Fields:
    """Coning, gyro and accelerometer metrics; nothing clips in simulation."""
    coning, gyro, accel = context.topics.estimator_status.vibration
    return (now_us, coning, gyro, accel, 0, 0, 0)
