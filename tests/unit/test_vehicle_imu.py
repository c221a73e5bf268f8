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


def test_it_is_told_ten_times_a_second_of_all_samples() -> None:
    """A jolt in the last tick of one status is over in the first of the next: both changes count."""
    topics, told = Topics(), []
    imu = VehicleImu(topics)
    for n in range(1, 251):
        accel = (0.0, 0.0, -9.0 if n == 25 else -10.0)
        topics.sensor_imu = SensorImu(n * TICK_US, (0.0, 0.0, 0.0), accel)
        topics.sensor_combined = SensorCombined(n * TICK_US, (0.0, 0.0, 0.0), accel)
        imu.update(n * TICK_US)
        if topics.vehicle_imu_status.timestamp == n * TICK_US:
            told.append(topics.vehicle_imu_status)
    assert [one.timestamp for one in told] == list(range(100_000, 1_000_001, 100_000))
    assert told[0].accel_vibration_metric == pytest.approx(0.01)
    assert told[1].accel_vibration_metric == pytest.approx((0.01 * 0.99 + 0.01) * 0.99**24)
