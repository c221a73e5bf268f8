"""VIBRATION: vibration metrics of the IMU (PX4: streams/VIBRATION.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_VIBRATION


def stamp(now_us: int, context: Context) -> int:
    """Once per vehicle_imu_status."""
    return context.topics.vehicle_imu_status.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """Coning, gyro and accelerometer metrics; nothing clips in simulation."""
    imu = context.topics.vehicle_imu_status
    return (now_us, imu.delta_angle_coning_metric, imu.gyro_vibration_metric, imu.accel_vibration_metric, 0, 0, 0)
