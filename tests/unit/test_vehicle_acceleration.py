"""vehicle_acceleration: calibrated, without its bias, low-passed by IMU_ACCEL_CUTOFF."""

import math
import random

import pytest

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.vehicle_acceleration import AccelerationFilter
from sitl_emu.autopilot.topics import EstimatorSensorBias, SensorImu, Topics, Vector3
from sitl_emu.autopilot.vehicle_kind import VehicleKind

TICK_US = 4_000
NO_RATES = (0.0, 0.0, 0.0)


class Table:
    """An accelerometer and what filters it."""

    def __init__(self, **parameters: float) -> None:
        self.topics = Topics()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, parameters)
        self.filter = AccelerationFilter(self.topics, self.parameters)
        self.now_us = 0

    def feel(self, accel: Vector3) -> Vector3:
        """One sample, and what is told of it."""
        self.now_us += TICK_US
        self.topics.sensor_imu = SensorImu(self.now_us, NO_RATES, accel)
        self.filter.update(self.now_us)
        return self.topics.vehicle_acceleration.xyz


def spread(cutoff_hz: float) -> float:
    """Standard deviation of what becomes of noise of 1 m/s²."""
    table, draw = Table(IMU_ACCEL_CUTOFF=cutoff_hz), random.Random(7)
    told = [table.feel((draw.gauss(0.0, 1.0), 0.0, 0.0))[0] for _ in range(5_000)]
    return math.sqrt(sum(x * x for x in told) / len(told))


def test_it_begins_with_the_first_sample_and_stays_with_what_stays() -> None:
    table = Table()
    for _ in range(3):
        assert table.feel((0.1, 0.2, -9.8)) == pytest.approx((0.1, 0.2, -9.8))
    told = table.topics.vehicle_acceleration
    assert (told.timestamp, told.timestamp_sample) == (3 * TICK_US, 3 * TICK_US)


def test_noise_is_filtered_at_30_hz_and_by_the_parameter() -> None:
    """PX4's SIH at rest, noise of 0.1 m/s²: 0.051 in vehicle_acceleration of its log (VehicleAcceleration.cpp)."""
    assert spread(30.0) == pytest.approx(0.51, abs=0.02)
    assert spread(5.0) == pytest.approx(0.21, abs=0.02)
    assert spread(0.0) == pytest.approx(1.0, abs=0.02)


def test_the_estimated_bias_is_taken_off() -> None:
    table = Table(IMU_ACCEL_CUTOFF=0.0)
    table.topics.estimator_sensor_bias = EstimatorSensorBias(1, accel_device_id=1, accel_bias=(0.1, -0.2, 0.3))
    assert table.feel((0.1, -0.2, -9.5)) == pytest.approx((0.0, 0.0, -9.8))
    table.topics.estimator_sensor_bias = EstimatorSensorBias(2)
    assert table.feel((0.1, -0.2, -9.5)) == (0.1, -0.2, -9.5), "EKF2_IMU_CTRL without it"


def test_another_cutoff_begins_with_the_last_sample() -> None:
    table = Table()
    table.feel((0.0, 0.0, -9.8))
    table.feel((0.0, 0.0, -19.8))
    table.parameters.set("IMU_ACCEL_CUTOFF", 10.0)
    assert table.feel((0.0, 0.0, -19.8)) == pytest.approx((0.0, 0.0, -19.8))


def test_a_change_of_another_parameter_changes_nothing() -> None:
    table, other = Table(), Table()
    for each in (table, other):
        each.feel((0.0, 0.0, -9.8))
        each.feel((0.0, 0.0, -19.8))
    table.parameters.set("MPC_XY_CRUISE", 3.0)
    assert table.feel((0.0, 0.0, -9.8)) == other.feel((0.0, 0.0, -9.8))


def test_a_silent_accelerometer_leaves_what_was_told() -> None:
    table = Table()
    table.feel((0.0, 0.0, -9.8))
    told = table.topics.vehicle_acceleration
    table.filter.update(table.now_us + TICK_US)
    assert table.topics.vehicle_acceleration is told
