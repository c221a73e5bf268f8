"""What the IMU tells of itself: how it shakes, and mean and variance of its samples.

PX4's VehicleIMU (src/modules/sensors/vehicle_imu, v1.18): the vibration metrics are filtered lengths of the change
from sample to sample, the coning metric that of the corrections which its integrator makes.
"""

import itertools
import math
from operator import attrgetter, itemgetter, mul
from typing import Final

from sitl_emu.autopilot.topics import SensorCombined, SensorImu, SensorSelection, Topics, Vector3, VehicleImuStatus

EVERY: Final = 25
"""Samples, 4 ms apart: PX4 tells of them after 100 ms (kIMUStatusPublishingInterval)."""
VIBRATION_WEIGHT: Final = 0.01
"""Of a new sample (UpdateAccelVibrationMetrics, UpdateGyroVibrationMetrics)."""
CONING_SHARE: Final = 1.0 / 12.0
"""Half of a sixth of the cross product of neighbouring delta angles (IntegratorConing)."""
SAMPLE_S: Final = 0.004


class VehicleImu:
    """Writer of vehicle_imu_status, and of sensor_selection: once, when the IMU is found (VotedSensorsUpdate)."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._samples: list[SensorCombined] = []
        """Those since the last time, behind the last one of then."""
        self._raw: list[SensorImu] = []
        self._accel_vibration = self._gyro_vibration = 0.0

    def update(self, now_us: int) -> None:
        """At every tick, behind the sensors."""
        self._samples.append(self._topics.sensor_combined)
        self._raw.append(self._topics.sensor_imu)
        if len(self._raw) == EVERY:
            self._publish(now_us)
            if not self._topics.sensor_selection.timestamp:
                self._topics.sensor_selection = SensorSelection(now_us)
            del self._samples[:-1]
            self._raw.clear()

    def _publish(self, now_us: int) -> None:
        gyro, accel = (list(map(itemgetter(place), self._samples)) for place in (1, 2))
        self._accel_vibration = filtered(self._accel_vibration, accel)
        self._gyro_vibration = filtered(self._gyro_vibration, gyro)
        raw_gyro, raw_accel = ([*map(attrgetter(name), self._raw)] for name in ("gyro_rad_s", "accelerometer_m_s2"))
        mean_accel, var_accel = mean_and_variance(raw_accel)
        mean_gyro, var_gyro = mean_and_variance(raw_gyro)
        self._topics.vehicle_imu_status = VehicleImuStatus(
            now_us,
            self._accel_vibration,
            self._gyro_vibration,
            coning(gyro),
            mean_accel,
            mean_gyro,
            var_accel,
            var_gyro,
        )


def filtered(metric: float, samples: list[Vector3]) -> float:
    """The vibration metric after these samples, the first of which it knows."""
    for change in itertools.starmap(math.dist, itertools.pairwise(samples)):
        metric += VIBRATION_WEIGHT * (change - metric)
    return metric


def coning(gyro: list[Vector3]) -> float:
    """Mean length of the corrections, rad, over these samples."""
    total = 0.0
    for (lx, ly, lz), (x, y, z) in itertools.pairwise(gyro):
        cx, cy, cz = ly * z - lz * y, lz * x - lx * z, lx * y - ly * x
        total += math.sqrt(cx * cx + cy * cy + cz * cz)
    return CONING_SHARE * SAMPLE_S * SAMPLE_S * total / (len(gyro) - 1)


def mean_and_variance(samples: list[Vector3]) -> tuple[Vector3, Vector3]:
    """Of each axis."""
    count = len(samples)
    x, y, z = zip(*samples, strict=True)
    mx, my, mz = sum(x) / count, sum(y) / count, sum(z) / count
    squares = (sum(map(mul, x, x)), sum(map(mul, y, y)), sum(map(mul, z, z)))
    vx, vy, vz = squares[0] / count - mx * mx, squares[1] / count - my * my, squares[2] / count - mz * mz
    return (mx, my, mz), (max(vx, 0.0), max(vy, 0.0), max(vz, 0.0))
