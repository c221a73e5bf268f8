"""The filter's state and its prediction: attitude, velocity and position integrated from the IMU.

Plain strapdown integration at the IMU's rate (Savage, "Strapdown Inertial Navigation Integration Algorithm Design",
1998, without the coning and sculling terms, which 250 Hz and rotor vehicles don't need), on a flat Earth that does not
turn: PX4's EKF2 (v1.18) predicts alike, and turns the Earth besides.
"""

import math

from autopilot.topics import Quaternion, Vector3

GRAVITY_M_S2 = 9.80665


class Strapdown:
    """Attitude `q` (body to NED), velocity `vn, ve, vd`, position `pn, pe, pd` and the two biases; all scalars.

    `rotation` is q as a matrix by rows; `accel` the acceleration in NED of the last step; `dvn, dve, dvd`, `dt_s` and
    `turn_x, turn_y, turn_z` add up specific force (NED), time and measured rotation since `restart_sums`.
    """

    def __init__(self) -> None:
        self.q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.rotation = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        self.accel: Vector3 = (0.0, 0.0, 0.0)
        self.vn = self.ve = self.vd = 0.0
        self.pn = self.pe = self.pd = 0.0
        self.gyro_bias: Vector3 = (0.0, 0.0, 0.0)
        self.accel_bias: Vector3 = (0.0, 0.0, 0.0)
        self.restart_sums()

    def restart_sums(self) -> None:
        """Begin a new interval of the covariance's prediction."""
        self.dvn = self.dve = self.dvd = self.dt_s = 0.0
        self.turn_x = self.turn_y = self.turn_z = 0.0

    def predict(self, gyro: Vector3, accel: Vector3, dt: float) -> None:
        """One IMU sample further: `gyro` rad/s, `accel` m/s², `dt` s."""
        gx, gy, gz = gyro
        bx, by, bz = self.gyro_bias
        self.turn_x += gx * dt
        self.turn_y += gy * dt
        self.turn_z += gz * dt
        half = 0.5 * dt
        hx, hy, hz = (gx - bx) * half, (gy - by) * half, (gz - bz) * half
        qw, qx, qy, qz = self.q
        # One Newton step of 1/sqrt normalises a quaternion that is already close to one.
        w = qw - qx * hx - qy * hy - qz * hz
        x = qx + qw * hx + qy * hz - qz * hy
        y = qy + qw * hy + qz * hx - qx * hz
        z = qz + qw * hz + qx * hy - qy * hx
        scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
        w *= scale
        x *= scale
        y *= scale
        z *= scale
        self.q = (w, x, y, z)
        xx, yy, zz = x * x, y * y, z * z
        xy, xz, yz = x * y, x * z, y * z
        wx, wy, wz = w * x, w * y, w * z
        r00, r01, r02 = 1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)
        r10, r11, r12 = 2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)
        r20, r21, r22 = 2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)
        self.rotation = (r00, r01, r02, r10, r11, r12, r20, r21, r22)
        ax, ay, az = accel
        bx, by, bz = self.accel_bias
        ax -= bx
        ay -= by
        az -= bz
        an = r00 * ax + r01 * ay + r02 * az
        ae = r10 * ax + r11 * ay + r12 * az
        ad = r20 * ax + r21 * ay + r22 * az
        dvn, dve, dvd = an * dt, ae * dt, ad * dt
        self.dvn += dvn
        self.dve += dve
        self.dvd += dvd
        self.dt_s += dt
        ad += GRAVITY_M_S2
        self.accel = (an, ae, ad)
        vn, ve, vd = self.vn, self.ve, self.vd
        self.pn += (vn + 0.5 * dvn) * dt
        self.pe += (ve + 0.5 * dve) * dt
        self.pd += (vd + half * ad) * dt
        self.vn = vn + dvn
        self.ve = ve + dve
        self.vd = vd + ad * dt

    def correct(self, correction: list[float], gyro_bias_limit: float, accel_bias_limit: float) -> None:
        """Apply a filter correction (15 error states, order of covariance.py), biases held within their limits."""
        (tx, ty, tz, dvn, dve, dvd, dpn, dpe, dpd, gx, gy, gz, ax, ay, az) = correction
        qw, qx, qy, qz = self.q
        hx, hy, hz = 0.5 * tx, 0.5 * ty, 0.5 * tz
        w = qw - hx * qx - hy * qy - hz * qz
        x = qx + hx * qw + hy * qz - hz * qy
        y = qy + hy * qw + hz * qx - hx * qz
        z = qz + hz * qw + hx * qy - hy * qx
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        self.q = (w / norm, x / norm, y / norm, z / norm)
        self.vn += dvn
        self.ve += dve
        self.vd += dvd
        self.pn += dpn
        self.pe += dpe
        self.pd += dpd
        bx, by, bz = self.gyro_bias
        self.gyro_bias = _limited(bx + gx, by + gy, bz + gz, gyro_bias_limit)
        bx, by, bz = self.accel_bias
        self.accel_bias = _limited(bx + ax, by + ay, bz + az, accel_bias_limit)


def _limited(x: float, y: float, z: float, limit: float) -> Vector3:
    return max(-limit, min(limit, x)), max(-limit, min(limit, y)), max(-limit, min(limit, z))
