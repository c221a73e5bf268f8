"""What the IMU tells of itself: vibration, mean and variance."""

import math
import random

import pytest

from sitl_emu.autopilot.sensors.vehicle_imu import VehicleImu
from sitl_emu.autopilot.topics import SensorCombined, SensorImu, Topics

TICK_US = 4_000
NOISE = 0.1


def shaken(noise: float, ticks: int = 5_000) -> Topics:
    topics, draw = Topics(), random.Random(7)
    imu = VehicleImu(topics)
    for n in range(1, ticks + 1):
        gyro = (draw.gauss(0.0, noise), draw.gauss(0.0, noise), draw.gauss(0.0, noise))
        accel = (1.0, 2.0, -9.0 + draw.gauss(0.0, noise))
        topics.sensor_imu = SensorImu(n * TICK_US, gyro, accel)
        topics.sensor_combined = SensorCombined(n * TICK_US, gyro, accel)
        imu.update(n * TICK_US)
    return topics


def test_at_rest_nothing_shakes() -> None:
    told = shaken(0.0).vehicle_imu_status
    assert told.mean_accel == pytest.approx((1.0, 2.0, -9.0))
    assert (told.accel_vibration_metric, told.gyro_vibration_metric, told.delta_angle_coning_metric) == (0.0, 0.0, 0.0)
    assert told.var_accel == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_white_noise_shakes_by_the_mean_length_of_its_changes() -> None:
    """Of three axes: 2 sqrt(2/pi) times the root of 2 times the noise; of one: sqrt(2/pi) times that."""
    told = shaken(NOISE).vehicle_imu_status
    change = math.sqrt(2.0) * NOISE
    assert told.gyro_vibration_metric == pytest.approx(2.0 * math.sqrt(2.0 / math.pi) * change, rel=0.15)
    assert told.accel_vibration_metric == pytest.approx(math.sqrt(2.0 / math.pi) * change, rel=0.25)
    assert told.var_gyro == pytest.approx((NOISE**2,) * 3, rel=0.7)
    assert told.delta_angle_coning_metric > 0.0
