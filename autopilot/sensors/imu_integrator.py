"""From IMU samples to what the estimator integrates.

PX4 v1.18's VehicleIMU (src/modules/sensors/vehicle_imu, Integrator.hpp): with one sample to an integral, the trapezoid
between it and the one before, so that white noise becomes its mean of two neighbours.
"""

from sitl_emu.autopilot.topics import SensorCombined, Topics, Vector3


class ImuIntegrator:
    """Writer of sensor_combined."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._gyro: Vector3 | None = None
        self._accel: Vector3 = (0.0, 0.0, 0.0)
        self.accel_calibrations = self.gyro_calibrations = 0

    def update(self, now_us: int, gyro: Vector3, accel: Vector3) -> None:
        """One sample, calibrated: rad/s, m/s²."""
        if self._gyro is None:
            self._gyro, self._accel = gyro, accel
        (gx, gy, gz), (ax, ay, az) = gyro, accel
        (lx, ly, lz), (mx, my, mz) = self._gyro, self._accel
        self._gyro, self._accel = gyro, accel
        self._topics.sensor_combined = SensorCombined(
            now_us,
            (0.5 * (gx + lx), 0.5 * (gy + ly), 0.5 * (gz + lz)),
            (0.5 * (ax + mx), 0.5 * (ay + my), 0.5 * (az + mz)),
            self.accel_calibrations,
            self.gyro_calibrations,
        )
