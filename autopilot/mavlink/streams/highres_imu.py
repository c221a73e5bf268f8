"""HIGHRES_IMU: IMU, magnetometer and barometer in SI units (PX4: streams/HIGHRES_IMU.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIGHRES_IMU
ALL_FIELDS = 0b1101111111111
"""Everything but differential pressure (HIGHRES_IMU_UPDATED_FLAGS)."""


def fields(now_us: int, context: Context) -> Fields:
    """m/s² and rad/s without the biases that the estimator found, gauss, hPa, m, °C."""
    topics = context.topics
    sample = topics.sensor_combined
    status = topics.estimator_status
    (ax, ay, az), (bx, by, bz) = sample.accelerometer_m_s2, status.accel_bias
    (p, q, r), (bp, bq, br) = sample.gyro_rad_s, status.gyro_bias
    mx, my, mz = topics.sensor_mag.magnetometer_ga
    baro = topics.sensor_baro
    pressure_hpa = baro.pressure_pa * 0.01
    temperature_c = baro.temperature_c
    altitude_m = baro.baro_alt_m
    return (
        sample.timestamp,
        ax - bx,
        ay - by,
        az - bz,
        p - bp,
        q - bq,
        r - br,
        mx,
        my,
        mz,
        pressure_hpa,
        0.0,
        altitude_m,
        temperature_c,
        ALL_FIELDS,
        0,
    )
