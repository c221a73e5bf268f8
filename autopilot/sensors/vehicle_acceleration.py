"""The acceleration that PX4's controllers and land detectors see: calibrated, without its bias, low-passed.

PX4's VehicleAcceleration (src/modules/sensors/vehicle_acceleration/VehicleAcceleration.cpp, v1.18): from each sample of
the accelerometer the bias is taken off that the estimator told last, and a second-order low-pass follows
(IMU_ACCEL_CUTOFF), which begins anew with the last sample when the cutoff changes. Its samples are calibrated here
already (sensors.py).

IMU_INTEG_RATE is not read: at its default PX4's simulation publishes with each sample, and where it asks for more
samples than one its clock stands still (a lockstep waits for the estimator).
"""

from typing import Final

from sitl_emu.autopilot.estimator.imu_filter import LowPass2p
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, Vector3, VehicleAcceleration

IMU_HZ: Final = 250.0
LEAST_CHANGE_HZ: Final = 0.1
"""A cutoff that differs by no more is the same one (CheckAndUpdateFilters)."""


class AccelerationFilter:
    """Writer of vehicle_acceleration."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._version = parameters.version
        self._cutoff_hz = float(parameters["IMU_ACCEL_CUTOFF"])
        self._low_pass = LowPass2p(IMU_HZ, self._cutoff_hz)
        self._last: Vector3 = (0.0, 0.0, 0.0)
        """The last sample, without its bias."""
        self._sample_us = 0

    def update(self, now_us: int) -> None:
        """At every tick, behind the sensors; an accelerometer that says nothing leaves the record as it is."""
        imu = self._topics.sensor_imu
        if imu.timestamp == self._sample_us:
            return
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._take_cutoff(float(self._parameters["IMU_ACCEL_CUTOFF"]))
        last = imu.accelerometer_m_s2
        bias = self._topics.estimator_sensor_bias
        if bias.accel_device_id:  # 0: nobody estimates it
            (x, y, z), (bx, by, bz) = last, bias.accel_bias
            last = (x - bx, y - by, z - bz)
        self._last = last
        if self._sample_us == 0:
            self._low_pass.begin_at(*last)
        self._sample_us = imu.timestamp
        self._topics.vehicle_acceleration = VehicleAcceleration(now_us, imu.timestamp, self._low_pass.update(*last))

    def _take_cutoff(self, cutoff_hz: float) -> None:
        if abs(cutoff_hz - self._cutoff_hz) > LEAST_CHANGE_HZ:
            self._cutoff_hz = cutoff_hz
            self._low_pass = LowPass2p(IMU_HZ, cutoff_hz)
            self._low_pass.begin_at(*self._last)
