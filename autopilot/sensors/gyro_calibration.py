"""Puts the gyro's offset right while the vehicle stands still and is not armed (PX4's gyro_calibration, v1.18).

IMU_GYRO_CAL_EN starts it with the autopilot. It needs 5 s without motion, and without a change of any parameter. A gyro
without a calibration gets its first one so.
"""

import math

from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.sensors.sensor_calibration import (
    DEVICE_IDS,
    INTERNAL_PRIORITY,
    corrections_of,
    is_calibrated,
    raw_gyro,
)
from sitl_emu.autopilot.topics import Topics, Vector3

STILL_US, SILENCE_US = 5_000_000, 100_000
ACCEL_CHANGE_M_S2, MOST_ACCEL_M_S2 = 0.5, 1.3 * 9.80665
"""More is motion."""
MOST_VARIANCE = 0.001
ENOUGH_SAMPLES = 100
BETTER = 0.1
"""An offset of so much less variance is taken though it is nearly the same."""
LEAST_CHANGE_RAD_S = 0.01
"""But no smaller change is (Gyroscope::set_offset)."""
NOT_EXTERNAL = -1


class GyroCalibration:
    """Reads sensor_imu, writes CAL_GYRO0_*."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self.runs = bool(parameters["IMU_GYRO_CAL_EN"])
        self._notifications = parameters.notifications
        self._corrections = corrections_of(parameters)
        self._was = (False, False)
        """Whether it was armed, and being calibrated otherwise."""
        self._accel: Vector3 = (0.0, 0.0, 0.0)
        self._saved_variance: Vector3 = (0.0, 0.0, 0.0)
        self._since_us = self._sample_us = self.count = 0
        self._mean, self._squares = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        if not self.runs:
            return
        if self._is_disturbed(now_us):
            self._begin_anew(now_us)
        elif not self._was[0]:
            self._take_sample()
            if now_us - self._since_us > STILL_US:
                self._calibrate(now_us)

    @property
    def mean(self) -> Vector3:
        """Of its samples since it began anew, rad/s."""
        x, y, z = self._mean
        return x, y, z

    @property
    def variance(self) -> Vector3:
        """Of its samples since it began anew."""
        x, y, z = (squares / max(self.count - 1, 1) for squares in self._squares)
        return x, y, z

    def _begin_anew(self, now_us: int) -> None:
        self._since_us, self._sample_us, self.count = now_us, 0, 0
        self._mean, self._squares = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]

    def _is_disturbed(self, now_us: int) -> bool:
        """Something else goes on, something has changed, or the vehicle moves."""
        status, imu = self._topics.vehicle_status, self._topics.sensor_imu
        before, self._was = self._was, (status.armed, status.calibrating)
        if before != self._was or self._was[1]:
            return True
        if status.armed:
            return False
        notifications, self._notifications = self._notifications, self._parameters.notifications
        silent = self._sample_us and now_us - imu.timestamp > SILENCE_US
        if notifications != self._notifications or silent:
            self._corrections = corrections_of(self._parameters)
            return True
        accel = imu.accelerometer_m_s2
        if math.dist(accel, self._accel) > ACCEL_CHANGE_M_S2:
            self._accel = accel
            return True
        return math.hypot(*accel) > MOST_ACCEL_M_S2

    def _take_sample(self) -> None:
        imu = self._topics.sensor_imu
        if imu.timestamp == self._sample_us:
            return
        self._sample_us = imu.timestamp
        self.count += 1
        for axis, value in enumerate(raw_gyro(imu.gyro_rad_s, self._corrections)):
            change = value - self._mean[axis]
            self._mean[axis] += change / self.count
            self._squares[axis] += change * (value - self._mean[axis])

    def _calibrate(self, now_us: int) -> None:
        """Write the mean, where it is another offset."""
        x, y, z = self.variance
        if self.count <= 2 or math.hypot(x, y, z) > MOST_VARIANCE:
            self._begin_anew(now_us)
            return
        if self.count <= ENOUGH_SAMPLES:
            return
        old, variances = self._corrections.gyro_offset, (x, y, z)
        differs = any((m - o) ** 2 > v for m, o, v in zip(self._mean, old, variances, strict=True))
        better = any(v < BETTER * known for v, known in zip(variances, self._saved_variance, strict=True))
        first = not is_calibrated(self._parameters, "GYRO")
        if first or ((differs or better) and math.dist(self._mean, old) > LEAST_CHANGE_RAD_S):
            self._saved_variance = variances
            self._save()
            self._begin_anew(now_us)

    def _save(self) -> None:
        values: dict[str, Value] = {f"CAL_GYRO0_{axis}OFF": part for axis, part in zip("XYZ", self._mean, strict=True)}
        values |= {"CAL_GYRO0_ID": DEVICE_IDS["GYRO"], "CAL_GYRO0_ROT": NOT_EXTERNAL}
        if self._parameters["CAL_GYRO0_PRIO"] < 0:
            values["CAL_GYRO0_PRIO"] = INTERNAL_PRIORITY
        self._parameters.set_quietly(values)
