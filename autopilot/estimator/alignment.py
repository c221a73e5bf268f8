"""Initial attitude: tilt from the accelerometer, heading from the magnetometer, both averaged at rest.

As PX4's EKF2 starts (initialiseTilt in ekf.cpp and the heading reset in mag_control.cpp, v1.18). The vehicle has to
stand still meanwhile: samples that move begin the average anew.
"""

import math

from autopilot.topics import Quaternion, Vector3
from sitl_emu.core.attitude import quaternion

STILL_RAD_S = 0.2
STILL_M_S2 = 1.5
GRAVITY_M_S2 = 9.80665
IMU_SAMPLES = 75
MAG_SAMPLES = 5


class Alignment:
    """Averages of what the sensors say at rest."""

    def __init__(self) -> None:
        self._restart()

    def _restart(self) -> None:
        self._accel, self._imu_count = (0.0, 0.0, 0.0), 0
        self._mag, self._mag_count = (0.0, 0.0, 0.0), 0

    def on_imu(self, gyro: Vector3, accel: Vector3) -> None:
        """One IMU sample."""
        moving = math.hypot(*gyro) > STILL_RAD_S or abs(math.hypot(*accel) - GRAVITY_M_S2) > STILL_M_S2
        if moving:
            self._restart()
            return
        self._accel = _sum(self._accel, accel)
        self._imu_count += 1

    def on_mag(self, field: Vector3) -> None:
        """One magnetometer sample."""
        self._mag = _sum(self._mag, field)
        self._mag_count += 1

    def tilt_ready(self) -> bool:
        """Whether roll and pitch are known."""
        return self._imu_count >= IMU_SAMPLES

    def heading_ready(self) -> bool:
        """Whether heading is known."""
        return self._mag_count >= MAG_SAMPLES

    def attitude(self, declination_rad: float) -> Quaternion:
        """Body to NED; yaw 0 without a magnetometer."""
        ax, ay, az = self._accel
        roll, pitch = math.atan2(-ay, -az), math.atan2(ax, math.hypot(ay, az))
        yaw = 0.0
        if self._mag_count:
            north, east = level(self._mag, roll, pitch)
            yaw = declination_rad - math.atan2(east, north)
        return quaternion(roll, pitch, yaw)


def level(vector: Vector3, roll: float, pitch: float) -> tuple[float, float]:
    """The horizontal part of a body vector in the frame that is level and has the vehicle's heading."""
    x, y, z = vector
    forward = x * math.cos(pitch) + (y * math.sin(roll) + z * math.cos(roll)) * math.sin(pitch)
    return forward, y * math.cos(roll) - z * math.sin(roll)


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
