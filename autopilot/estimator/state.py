"""The filter's state at the fusion horizon, and its prediction from delayed IMU samples.

24 error states, as PX4's EKF2 has them (EKF/ekf.cpp, predictState and fuse; state.h; v1.18): attitude, velocity,
position, gyro bias, accelerometer bias, Earth's magnetic field, magnetic bias of the body, wind, terrain. Plain
scalars: the prediction runs 125 times a second. Position is kept in the local frame, north and east, and as altitude
AMSL; the Earth turns, but it is flat: Coriolis and transport accelerations (milli-g at 10 m/s) are left out, as in the
world.
"""

import math
from dataclasses import dataclass
from typing import Final

from sitl_emu.autopilot.estimator.samples import ImuSample
from sitl_emu.autopilot.topics import Quaternion, Vector3
from sitl_emu.core.attitude import Rotation, after_small_turn, product, rotated, rotation

GRAVITY_M_S2: Final = 9.80665
EARTH_SPIN_RATE_RAD_S: Final = 7.2921150e-5
ZERO: Vector3 = (0.0, 0.0, 0.0)
LARGEST_VELOCITY_M_S: Final = 1e3
LARGEST_EARTH_FIELD_GA: Final = 1.0
LARGEST_MAG_BIAS_GA: Final = 0.5
LARGEST_WIND_M_S: Final = 1e2
LARGEST_TERRAIN_M: Final = 1e4
HORIZONTAL_ACCELERATION_S: Final = 1.0
"""Time constant of the low-pass for manoeuvre detection."""
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class State:
    """Attitude `q` (body to NED), `rotation` the same as nine numbers by rows, velocity, `pn, pe`, `alt` and the rest.

    `dvn, dve, dvd`, `dt_s` and `steps` add up specific force (NED), time and samples since `restart_sums`, for the
    covariance, which is predicted less often.
    """

    def __init__(self) -> None:
        self.q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.rotation: Rotation = IDENTITY
        self.vn = self.ve = self.vd = 0.0
        self.pn = self.pe = self.alt = 0.0
        self.gyro_bias, self.accel_bias = ZERO, ZERO
        self.mag_i, self.mag_b = ZERO, ZERO
        self.wind = (0.0, 0.0)
        self.terrain = 0.0
        """Down position of the ground, with zero at sea level."""
        self.accel_horizontal = (0.0, 0.0)
        """Low-passed acceleration, NED."""
        self.gravity_m_s2 = GRAVITY_M_S2
        self._earth_rate_n = self._earth_rate_d = 0.0
        self.restart_sums()

    def set_latitude(self, latitude_deg: float) -> None:
        """Gravity (WGS 84) and the turn of the Earth follow from where the vehicle is."""
        latitude = math.radians(latitude_deg)
        self._earth_rate_n = EARTH_SPIN_RATE_RAD_S * math.cos(latitude)
        self._earth_rate_d = -EARTH_SPIN_RATE_RAD_S * math.sin(latitude)
        sine_squared = math.sin(latitude) ** 2
        self.gravity_m_s2 = (
            9.7803253359 * (1.0 + 0.001931852652 * sine_squared) / math.sqrt(1.0 - 0.006694379990 * sine_squared)
        )

    def restart_sums(self) -> None:
        """Begin a new interval of the covariance's prediction."""
        self.dvn = self.dve = self.dvd = self.dt_s = 0.0
        self.steps = 0

    def set_attitude(self, q: Quaternion) -> None:
        """Replace the attitude."""
        self.q, self.rotation = q, rotation(q)

    @property
    def yaw(self) -> float:
        """Heading, rad."""
        r = self.rotation
        return math.atan2(r[3], r[0]) if abs(r[6]) < 0.99999 else math.atan2(-r[1], r[4])

    def predict(self, imu: ImuSample, velocity_limit_m_s: float) -> None:
        """One delayed IMU sample further."""
        _, (ax, ay, az), (vx, vy, vz), dt = imu
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = self.rotation
        bx, by, bz = self.gyro_bias
        rate_n, rate_d = self._earth_rate_n, self._earth_rate_d
        hx = 0.5 * (ax - (bx + r00 * rate_n + r20 * rate_d) * dt)
        hy = 0.5 * (ay - (by + r01 * rate_n + r21 * rate_d) * dt)
        hz = 0.5 * (az - (bz + r02 * rate_n + r22 * rate_d) * dt)
        self.q = q = after_small_turn(self.q, hx, hy, hz)
        self.rotation = r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation(q)
        bx, by, bz = self.accel_bias
        vx -= bx * dt
        vy -= by * dt
        vz -= bz * dt
        dvn = r00 * vx + r01 * vy + r02 * vz
        dve = r10 * vx + r11 * vy + r12 * vz
        dvd = r20 * vx + r21 * vy + r22 * vz
        self.dvn += dvn
        self.dve += dve
        self.dvd += dvd
        self.dt_s += dt
        self.steps += 1
        weight = dt / (dt + HORIZONTAL_ACCELERATION_S)
        mean_n, mean_e = self.accel_horizontal
        self.accel_horizontal = (mean_n + weight * (dvn / dt - mean_n), mean_e + weight * (dve / dt - mean_e))
        dvd += self.gravity_m_s2 * dt
        vn, ve, vd = self.vn, self.ve, self.vd
        self.pn += (vn + 0.5 * dvn) * dt
        self.pe += (ve + 0.5 * dve) * dt
        self.alt -= (vd + 0.5 * dvd) * dt
        self.vn, self.ve, self.vd = _limited(vn + dvn, ve + dve, vd + dvd, velocity_limit_m_s)

    def correct(self, c: list[float], gyro_limit: float, accel_limit: float, *, mag: bool, wind: bool) -> None:
        """Apply a filter correction (24 error states), each within its limits; `mag`, `wind`: those are estimated."""
        self.turn(c[0], c[1], c[2])
        vn, ve, vd = self.vn + c[3], self.ve + c[4], self.vd + c[5]
        self.vn, self.ve, self.vd = _limited(vn, ve, vd, LARGEST_VELOCITY_M_S)
        self.pn += c[6]
        self.pe += c[7]
        self.alt -= c[8]
        x, y, z = self.gyro_bias
        self.gyro_bias = _limited(x + c[9], y + c[10], z + c[11], gyro_limit)
        x, y, z = self.accel_bias
        self.accel_bias = _limited(x + c[12], y + c[13], z + c[14], accel_limit)
        if mag:
            x, y, z = self.mag_i
            self.mag_i = _limited(x + c[15], y + c[16], z + c[17], LARGEST_EARTH_FIELD_GA)
            x, y, z = self.mag_b
            self.mag_b = _limited(x + c[18], y + c[19], z + c[20], LARGEST_MAG_BIAS_GA)
        if wind:
            north, east, limit = self.wind[0] + c[21], self.wind[1] + c[22], LARGEST_WIND_M_S
            self.wind = (min(max(north, -limit), limit), min(max(east, -limit), limit))
        limit = LARGEST_TERRAIN_M
        self.terrain = min(max(self.terrain + c[23], -limit), limit)

    def turn(self, tx: float, ty: float, tz: float) -> None:
        """Turn the attitude by a small angle in NED (rad)."""
        angle = math.sqrt(tx * tx + ty * ty + tz * tz)
        if angle == 0.0:
            return
        sine = math.sin(0.5 * angle) / angle
        w, x, y, z = product((math.cos(0.5 * angle), tx * sine, ty * sine, tz * sine), self.q)
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        self.set_attitude((w / norm, x / norm, y / norm, z / norm))

    def to_body(self, n: float, e: float, d: float) -> Vector3:
        """A vector of NED in the body frame."""
        r = self.rotation
        return (r[0] * n + r[3] * e + r[6] * d, r[1] * n + r[4] * e + r[7] * d, r[2] * n + r[5] * e + r[8] * d)

    def to_earth(self, x: float, y: float, z: float) -> Vector3:
        """A vector of the body frame in NED."""
        return rotated(self.rotation, (x, y, z))


def _limited(x: float, y: float, z: float, limit: float) -> Vector3:
    """Each within ±limit (NaN: none); nearly always all are, and this runs with every correction of the filter."""
    if -limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit:
        return x, y, z
    return min(max(x, -limit), limit), min(max(y, -limit), limit), min(max(z, -limit), limit)


@dataclass(slots=True)
class Resets:
    """How often each part of the state jumped, and by how much it did last (NED; metres and m/s)."""

    vel_ne: int = 0
    vel_d: int = 0
    pos_ne: int = 0
    pos_d: int = 0
    quat: int = 0
    hagl: int = 0
    vel_ne_change: tuple[float, float] = (0.0, 0.0)
    vel_d_change: float = 0.0
    pos_ne_change: tuple[float, float] = (0.0, 0.0)
    pos_d_change: float = 0.0
    quat_change: Quaternion = (1.0, 0.0, 0.0, 0.0)
    hagl_change: float = 0.0


def shortest_turn_to_level(accel: Vector3) -> Quaternion:
    """The smallest rotation that makes the measured force point up (body to NED)."""
    norm = math.hypot(*accel)
    x, y, z = accel[0] / norm, accel[1] / norm, accel[2] / norm
    # from (x, y, z) to (0, 0, -1): axis is their cross product, cosine their dot product
    w = 1.0 - z
    if w < 1e-6:
        return 0.0, 1.0, 0.0, 0.0  # upside down
    q = (w, -y, x, 0.0)
    length = math.sqrt(sum(value * value for value in q))
    return (q[0] / length, q[1] / length, q[2] / length, 0.0)
