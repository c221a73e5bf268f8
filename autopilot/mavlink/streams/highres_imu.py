"""HIGHRES_IMU: IMU, magnetometer and barometer in SI units (PX4: streams/HIGHRES_IMU.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_HIGHRES_IMU
ALL_FIELDS = 0b1101111111111
"""Everything but differential pressure (HIGHRES_IMU_UPDATED_FLAGS)."""


def fields(now_us: int, context: Context) -> Fields:
    """m/s², rad/s, gauss, hPa, m, °C."""
    topics = context.topics
    sample = topics.sensor_combined
    ax, ay, az = sample.accelerometer_m_s2
    p, q, r = sample.gyro_rad_s
    mx, my, mz = topics.sensor_mag.magnetometer_ga
    baro = topics.sensor_baro
    pressure_hpa = baro.pressure_pa * 0.01
    temperature_c = baro.temperature_c
    altitude_m = baro.baro_alt_m
    return (
        sample.timestamp,
        ax,
        ay,
        az,
        p,
        q,
        r,
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
