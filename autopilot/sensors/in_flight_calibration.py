"""Takes what the estimator has learnt of the sensors' biases in flight into their calibration, after disarming.

PX4's VehicleIMU (SensorCalibrationUpdate, SensorCalibrationSaveAccel and -Gyro, with SENS_IMU_AUTOCAL) and
VehicleMagnetometer (UpdateMagCalibration), v1.18. The IMU's offsets become what was learnt; the magnetometer's draws
near to it, the more so the surer that is. Both are looked at as long as the vehicle is armed, an uncalibrated IMU at
any time.
"""

import math

from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.sensors.sensor_calibration import (
    DEVICE_IDS,
    INTERNAL_PRIORITY,
    corrections_of,
    is_calibrated,
    raw_accel,
    raw_gyro,
    raw_mag,
)
from sitl_emu.autopilot.topics import Topics, Vector3

LOOK_EVERY_US, FRESH_US = 1_000_000, 1_000_000
QUIET_US = 30_000_000
"""After an offset was saved, that of an IMU is not looked at again for so long."""
ACCEL_CHANGE_M_S2, GYRO_CHANGE_RAD_S, MAG_CHANGE_GA = 0.05, 0.01, 0.005
"""Smaller changes are not worth saving."""
MAG_VARIANCE = 2.5e-6
"""Of a saved magnetometer offset, against which that of the learnt one is weighed."""
LEAST_MAG_VARIANCE, MOST_MAG_VARIANCE = 0.01 * MAG_VARIANCE, 500.0 * MAG_VARIANCE
NOT_EXTERNAL = -1
"""CAL_*_ROT of a sensor on the board."""


class InFlightCalibration:
    """Reads estimator_sensor_bias, writes CAL_ACC0_*, CAL_GYRO0_* and CAL_MAG0_*."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._due_us = 0
        self._version, self._calibrated = -1, False
        self._imu_bias_us = self._mag_bias_us = 0
        self._imu: dict[str, Vector3] = {}
        self._mag: tuple[Vector3, Vector3] | None = None
        """Offsets that were learnt and not saved yet; the magnetometer's with its variances."""

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        armed = self._topics.vehicle_status.armed
        if self._parameters["SENS_IMU_AUTOCAL"]:
            if now_us > self._due_us and (armed or not self._imu_is_calibrated()):
                self._due_us = now_us + LOOK_EVERY_US
                self._learn_imu(now_us)
            elif not armed:
                self._save_imu(now_us)
        if armed:
            self._learn_mag(now_us)
        elif self._mag is not None:
            self._save_mag(*self._mag)
            self._mag = None

    def _imu_is_calibrated(self) -> bool:
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._calibrated = is_calibrated(self._parameters, "ACC") and is_calibrated(self._parameters, "GYRO")
        return self._calibrated

    def _learn_imu(self, now_us: int) -> None:
        bias = self._topics.estimator_sensor_bias
        if bias.timestamp == self._imu_bias_us or now_us - bias.timestamp >= FRESH_US:
            return
        self._imu_bias_us = bias.timestamp
        corrections = corrections_of(self._parameters)
        if bias.accel_bias_valid and bias.accel_bias_stable:
            self._imu["ACC"] = raw_accel(bias.accel_bias, corrections)
        if bias.gyro_bias_valid and bias.gyro_bias_stable:
            self._imu["GYRO"] = raw_gyro(bias.gyro_bias, corrections)

    def _save_imu(self, now_us: int) -> None:
        if not self._imu:
            return
        corrections = corrections_of(self._parameters)
        for sensor, old, least in (
            ("ACC", corrections.accel_offset, ACCEL_CHANGE_M_S2),
            ("GYRO", corrections.gyro_offset, GYRO_CHANGE_RAD_S),
        ):
            new = self._imu.pop(sensor, None)
            if new is not None and (math.dist(new, old) > least or not is_calibrated(self._parameters, sensor)):
                self._save(sensor, new)
                self._due_us = now_us + QUIET_US

    def _learn_mag(self, now_us: int) -> None:
        bias = self._topics.estimator_sensor_bias
        if bias.timestamp == self._mag_bias_us:
            return
        self._mag_bias_us = bias.timestamp
        variances = bias.mag_bias_variance
        sure = min(variances) > LEAST_MAG_VARIANCE and max(variances) < MOST_MAG_VARIANCE
        if bias.mag_bias_valid and bias.mag_bias_stable and sure and now_us - bias.timestamp < FRESH_US:
            self._mag = raw_mag(bias.mag_bias, corrections_of(self._parameters)), variances

    def _save_mag(self, learnt: Vector3, variances: Vector3) -> None:
        offset = corrections_of(self._parameters).mag_offset
        x, y, z = (
            old + MAG_VARIANCE / (MAG_VARIANCE + variance) * (new - old)
            for old, new, variance in zip(offset, learnt, variances, strict=True)
        )
        if math.dist((x, y, z), offset) > MAG_CHANGE_GA:
            self._save("MAG", (x, y, z))

    def _save(self, sensor: str, offset: Vector3) -> None:
        values: dict[str, Value] = {f"CAL_{sensor}0_{axis}OFF": part for axis, part in zip("XYZ", offset, strict=True)}
        values |= {f"CAL_{sensor}0_ID": DEVICE_IDS[sensor], f"CAL_{sensor}0_ROT": NOT_EXTERNAL}
        if self._parameters[f"CAL_{sensor}0_PRIO"] < 0:
            values[f"CAL_{sensor}0_PRIO"] = INTERNAL_PRIORITY
        self._parameters.set_quietly(values)
