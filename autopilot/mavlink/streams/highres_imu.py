"""HIGHRES_IMU: IMU, magnetometer and barometer in SI units (PX4: streams/HIGHRES_IMU.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIGHRES_IMU
IMU_FIELDS: Final = 0b111111
MAG_FIELDS: Final = 0b111 << 6
BARO_FIELDS: Final = 0b1101 << 9
"""HIGHRES_IMU_UPDATED_FLAGS; there is no differential pressure."""
NONE: Final = (0.0, 0.0, 0.0)


def since(context: Context, told: tuple[int, ...] | int) -> tuple[tuple[int, ...], list[Fields]]:
    """Each message has a new measurement of the IMU, and tells which of the others are new since the last."""
    topics = context.topics
    before = told if isinstance(told, tuple) else (0, 0, 0)
    imu_us = topics.sensor_combined.timestamp
    if imu_us == before[0]:
        return before, []
    stamps = (imu_us, topics.vehicle_magnetometer.timestamp, topics.vehicle_air_data.timestamp)
    updated = IMU_FIELDS
    updated |= MAG_FIELDS if stamps[1] != before[1] else 0
    updated |= BARO_FIELDS if stamps[2] != before[2] else 0
    return stamps, [_message(topics, updated)]


def fields(now_us: int, context: Context) -> Fields | None:
    """Measurements are told as they come."""
    return None


def _message(topics: Topics, updated: int) -> Fields:
    """m/s² and rad/s without the biases that the estimator found, gauss, hPa, m, °C (of the air)."""
    sample = topics.sensor_combined
    bias = topics.estimator_sensor_bias
    accel_bias = bias.accel_bias if bias.accel_device_id else NONE
    gyro_bias = bias.gyro_bias if bias.gyro_device_id else NONE
    mag_bias = bias.mag_bias if bias.mag_device_id else NONE
    (ax, ay, az), (bx, by, bz) = sample.accelerometer_m_s2, accel_bias
    (p, q, r), (bp, bq, br) = sample.gyro_rad_s, gyro_bias
    mag, baro = topics.vehicle_magnetometer, topics.vehicle_air_data
    (mx, my, mz), (bmx, bmy, bmz) = mag.magnetometer_ga if mag.timestamp else NONE, mag_bias
    pressure_hpa = altitude_m = temperature_c = 0.0
    if baro.timestamp:
        pressure_hpa, altitude_m = baro.baro_pressure_pa * 0.01, baro.baro_alt_meter
        temperature_c = baro.ambient_temperature
    return (
        sample.timestamp,
        ax - bx,
        ay - by,
        az - bz,
        p - bp,
        q - bq,
        r - br,
        mx - bmx,
        my - bmy,
        mz - bmz,
        pressure_hpa,
        0.0,
        altitude_m,
        temperature_c,
        updated,
        0,
    )
