"""Accelerometer and gyroscope at 250 Hz: white noise, more of it while motors run, and biases drawn at start.

The gyroscope turns with the Earth too, as in SIH (sih.cpp, reconstruct_sensors_signals).

Bias instability over a flight and temperature are left out: PX4 re-estimates biases within seconds.
"""

import math
from typing import Final

from sitl_emu.vehicles.description import Imu as ImuData
from sitl_emu.vehicles.dynamics import Quaternion
from sitl_emu.world.noise import normals

EARTH_SPIN_RATE_RAD_S: Final = 7.2921150e-5


class Imu:
    """Reads specific force and body rates."""

    def __init__(self, data: ImuData, seed: int, name: str, latitude_deg: float = 0.0) -> None:
        draw = self._draw = normals(seed, name, "imu")
        bias_a, bias_g = data.accel_bias_m_s2, data.gyro_bias_rad_s
        self._accel_bias = (bias_a * draw(), bias_a * draw(), bias_a * draw())
        self._gyro_bias = (bias_g * draw(), bias_g * draw(), bias_g * draw())
        self._running = data.accel_noise_m_s2 + data.gyro_noise_rad_s
        self._spin_north = EARTH_SPIN_RATE_RAD_S * math.cos(math.radians(latitude_deg))
        self._spin_down = -EARTH_SPIN_RATE_RAD_S * math.sin(math.radians(latitude_deg))
        self._still = data.accel_noise_still_m_s2 + data.gyro_noise_still_rad_s

    def read(
        self,
        ax: float,
        ay: float,
        az: float,
        p: float,
        q: float,
        r: float,
        attitude: Quaternion,
        running: bool,
    ) -> tuple[float, float, float, float, float, float]:
        """(m/s² x, y, z, rad/s x, y, z) of one sample."""
        n0, n1, n2, n3, n4, n5 = self._running if running else self._still
        a0, a1, a2 = self._accel_bias
        g0, g1, g2 = self._gyro_bias
        w, x, y, z = attitude
        north, down = self._spin_north, self._spin_down
        draw = self._draw
        return (
            ax + a0 + n0 * draw(),
            ay + a1 + n1 * draw(),
            az + a2 + n2 * draw(),
            p + (1.0 - 2.0 * (y * y + z * z)) * north + 2.0 * (x * z - w * y) * down + g0 + n3 * draw(),
            q + 2.0 * (x * y - w * z) * north + 2.0 * (y * z + w * x) * down + g1 + n4 * draw(),
            r + 2.0 * (x * z + w * y) * north + (1.0 - 2.0 * (x * x + y * y)) * down + g2 + n5 * draw(),
        )
