"""Heading from GNSS velocity and IMU alone: five small filters from five headings, weighted by how well they fit.

PX4's EKF2 (EKF/yaw_estimator/EKFGSF_yaw.cpp, v1.18): a Gaussian sum filter, each filter with velocity north and east
and yaw. PX4 runs an attitude reference for each of the five; as all of them feel the same gravity and differ by a turn
about the vertical alone, here there is one, and five yaws relative to it. Attitude is followed every 32 ms, not every
8.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator.samples import ImuSample
from sitl_emu.autopilot.topics import Quaternion, Vector3, YawEstimatorStatus
from sitl_emu.core.attitude import product, rotation
from sitl_emu.core.geodesy import wrap_pi

MODELS: Final = 5
GYRO_NOISE_RAD_S: Final = 0.1
ACCEL_NOISE_M_S2: Final = 2.0
TILT_GAIN: Final = 0.2
GYRO_BIAS_GAIN: Final = 0.04
GYRO_BIAS_LIMIT_RAD_S: Final = 0.05
SLOW_RAD_S = math.radians(10.0)
GRAVITY_M_S2: Final = 9.80665
LARGEST_NIS: Final = 25.0
LEAST_WEIGHT: Final = 1e-5
LEAST_VARIANCE: Final = 1e-6
CONVERGED_RAD: Final = 0.262


class Model:
    """One of the five: velocity, yaw relative to the attitude reference, and their covariance (upper triangle)."""

    __slots__ = ("innovation", "offset", "p00", "p01", "p02", "p11", "p12", "p22", "ve", "vn", "weight")

    def __init__(self, offset: float, velocity: tuple[float, float], variance: float) -> None:
        self.offset, (self.vn, self.ve) = offset, velocity
        self.p00 = self.p11 = variance
        self.p01 = self.p02 = self.p12 = 0.0
        self.p22 = (math.pi / MODELS) ** 2
        self.innovation = (0.0, 0.0)
        self.weight = 1.0 / MODELS

    def predict(self, dn: float, de: float, variance: float, yaw_variance: float) -> None:
        """Add a change of velocity that was made in the reference's axes."""
        cosine, sine = math.cos(self.offset), math.sin(self.offset)
        north, east = cosine * dn - sine * de, sine * dn + cosine * de
        self.vn += north
        self.ve += east
        a, b, p22 = -east, north, self.p22
        self.p00 += a * (2.0 * self.p02 + a * p22) + variance
        self.p11 += b * (2.0 * self.p12 + b * p22) + variance
        self.p01 += b * self.p02 + a * self.p12 + a * b * p22
        self.p02 += a * p22
        self.p12 += b * p22
        self.p22 = max(p22 + yaw_variance, LEAST_VARIANCE)

    def fuse(self, vn: float, ve: float, variance: float) -> None:
        """Correct by a velocity, and weigh by how likely it was."""
        s00, s01, s11 = self.p00 + variance, self.p01, self.p11 + variance
        inverse = 1.0 / max(s00 * s11 - s01 * s01, 1e-12)
        i00, i01, i11 = s11 * inverse, -s01 * inverse, s00 * inverse
        x, y = self.vn - vn, self.ve - ve
        k00, k01 = self.p00 * i00 + self.p01 * i01, self.p00 * i01 + self.p01 * i11
        k10, k11 = self.p01 * i00 + self.p11 * i01, self.p01 * i01 + self.p11 * i11
        k20, k21 = self.p02 * i00 + self.p12 * i01, self.p02 * i01 + self.p12 * i11
        p00, p01, p02, p11, p12, p22 = self.p00, self.p01, self.p02, self.p11, self.p12, self.p22
        self.p00 = max(p00 - k00 * p00 - k01 * p01, LEAST_VARIANCE)
        self.p01 = p01 - k00 * p01 - k01 * p11
        self.p02 = p02 - k00 * p02 - k01 * p12
        self.p11 = max(p11 - k10 * p01 - k11 * p11, LEAST_VARIANCE)
        self.p12 = p12 - k10 * p02 - k11 * p12
        self.p22 = max(p22 - k20 * p02 - k21 * p12, LEAST_VARIANCE)
        nis = x * (i00 * x + i01 * y) + y * (i01 * x + i11 * y)
        if nis > LARGEST_NIS:
            shrink = math.sqrt(LARGEST_NIS / nis)
            x, y, nis = x * shrink, y * shrink, LARGEST_NIS
        self.innovation = (x, y)
        self.vn -= k00 * x + k01 * y
        self.ve -= k10 * x + k11 * y
        self.offset = wrap_pi(self.offset - (k20 * x + k21 * y))
        self.weight = max(self.weight * math.sqrt(inverse) * math.exp(-0.5 * nis) / math.tau, LEAST_WEIGHT)


class YawEstimator:
    """`yaw` and `variance`, once `active`."""

    def __init__(self) -> None:
        self.active = False
        self.yaw, self.variance = 0.0, math.inf
        self._models: list[Model] = []
        self._q: Quaternion | None = None
        self._yaw_of_reference = 0.0
        self._gyro_bias: Vector3 = (0.0, 0.0, 0.0)
        self._accel: Vector3 = (0.0, 0.0, 0.0)
        self._dn = self._de = self._variance_v = self._variance_yaw = 0.0

    def reset(self) -> None:
        """GNSS is not in use: begin anew when it is."""
        self.active, self.variance = False, math.inf

    @property
    def converged(self) -> bool:
        """The heading may be used."""
        return self.active and 0.0 < self.variance < CONVERGED_RAD**2

    def predict(self, imu: ImuSample, steps: int, gyro_bias: Vector3, *, at_rest: bool, flying: bool) -> None:
        """Delayed IMU samples, `steps` of them added up; at rest, and until velocities are fused, the filter's gyro
        bias is taken over."""
        if not self.active or at_rest:
            self._gyro_bias = gyro_bias
        dt_s = imu.dt_s
        x, y, z = imu.delta_velocity
        self._follow(imu)
        if not self.active or self._q is None:
            return
        r = rotation(self._q)
        self._dn += r[0] * x + r[1] * y + r[2] * z
        self._de += r[3] * x + r[4] * y + r[5] * z
        noise = ACCEL_NOISE_M_S2 if flying else 2.0 * ACCEL_NOISE_M_S2
        spread = dt_s * dt_s / steps
        self._variance_v += noise * noise * spread
        self._variance_yaw += GYRO_NOISE_RAD_S**2 * spread
        self._yaw_of_reference = math.atan2(r[3], r[0])

    def _follow(self, imu: ImuSample) -> None:
        """The attitude reference: gyro, drawn towards where gravity is felt, less so in manoeuvres."""
        dt_s = imu.dt_s
        x, y, z = imu.delta_velocity
        ax, ay, az = x / dt_s, y / dt_s, z / dt_s
        weight = min(10.0 * dt_s * TILT_GAIN, 1.0)
        mx, my, mz = self._accel
        self._accel = mx, my, mz = mx + weight * (ax - mx), my + weight * (ay - my), mz + weight * (az - mz)
        norm = math.sqrt(mx * mx + my * my + mz * mz)
        if self._q is None:
            self._align(ax, ay, az, norm)
            return
        gain = TILT_GAIN * (1.0 - min(2.0 * abs(norm - GRAVITY_M_S2) / GRAVITY_M_S2, 1.0)) ** 2 / max(norm, 1e-3)
        w, x, y, z = self._q
        dx, dy, dz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        cx, cy, cz = (dy * mz - dz * my) * gain, (dz * mx - dx * mz) * gain, (dx * my - dy * mx) * gain
        x, y, z = imu.delta_angle
        bx, by, bz = self._gyro_bias
        gx, gy, gz = x / dt_s - bx, y / dt_s - by, z / dt_s - bz
        if gx * gx + gy * gy + gz * gz < SLOW_RAD_S**2:
            step, limit = GYRO_BIAS_GAIN * dt_s, GYRO_BIAS_LIMIT_RAD_S
            bx = min(max(bx - cx * step, -limit), limit)
            by = min(max(by - cy * step, -limit), limit)
            bz = min(max(bz - cz * step, -limit), limit)
            self._gyro_bias = (bx, by, bz)
        half = 0.5 * dt_s
        w, x, y, z = product(self._q, (1.0, (gx + cx) * half, (gy + cy) * half, (gz + cz) * half))
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        self._q = (w / norm, x / norm, y / norm, z / norm)

    def _align(self, ax: float, ay: float, az: float, mean: float) -> None:
        """Tilt from gravity, once nothing else is felt."""
        felt = math.sqrt(ax * ax + ay * ay + az * az)
        if 0.9 * GRAVITY_M_S2 < felt < 1.1 * GRAVITY_M_S2 and 0.9 * GRAVITY_M_S2 < mean < 1.1 * GRAVITY_M_S2:
            roll, pitch = math.atan2(-ay, -az), math.atan2(ax, math.hypot(ay, az))
            cr, sr = math.cos(roll / 2.0), math.sin(roll / 2.0)
            cp, sp = math.cos(pitch / 2.0), math.sin(pitch / 2.0)
            self._q = (cr * cp, sr * cp, cr * sp, -sr * sp)

    def fuse_velocity(self, vn: float, ve: float, accuracy_m_s: float, *, in_air: bool) -> None:
        """One GNSS velocity, m/s."""
        if self._q is None:
            return
        accuracy_m_s = max(accuracy_m_s, 0.01)
        if not self.active:
            self.yaw, self.variance = 0.0, (math.pi / 2.0) ** 2
            r = rotation(self._q)
            self._yaw_of_reference = math.atan2(r[3], r[0])
            self._models = [
                Model(
                    wrap_pi((2 * n + 1) * math.pi / MODELS - math.pi - self._yaw_of_reference),
                    (vn, ve),
                    accuracy_m_s**2,
                )
                for n in range(MODELS)
            ]
            self._dn = self._de = self._variance_v = self._variance_yaw = 0.0
            self.active = in_air or math.hypot(vn, ve) > accuracy_m_s
            return
        for model in self._models:
            model.predict(self._dn, self._de, self._variance_v, self._variance_yaw)
            model.fuse(vn, ve, accuracy_m_s**2)
        self._dn = self._de = self._variance_v = self._variance_yaw = 0.0
        total = sum(model.weight for model in self._models)
        for model in self._models:
            model.weight /= total
        self._combine()

    def _combine(self) -> None:
        north = sum(model.weight * math.cos(model.offset) for model in self._models)
        east = sum(model.weight * math.sin(model.offset) for model in self._models)
        mean = math.atan2(east, north)
        self.yaw = wrap_pi(mean + self._yaw_of_reference)
        self.variance = sum(model.weight * (model.p22 + wrap_pi(model.offset - mean) ** 2) for model in self._models)
        if not 0.0 < self.variance < math.inf:
            self.reset()

    def record(self, now_us: int, horizon_us: int) -> YawEstimatorStatus:
        """What uORB yaw_estimator_status tells."""
        models, yaw = self._models, self._yaw_of_reference
        return YawEstimatorStatus(
            now_us,
            horizon_us,
            self.yaw,
            self.variance,
            self.converged,
            tuple(wrap_pi(model.offset + yaw) for model in models),
            tuple(model.innovation[0] for model in models),
            tuple(model.innovation[1] for model in models),
            tuple(model.weight for model in models),
        )
