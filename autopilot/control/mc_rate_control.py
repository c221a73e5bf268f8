"""Rate control of a multicopter: from body rates to normalised torques.

PX4's RateControl (src/lib/rate_control, v1.18): PID per axis with MC_*RATE_{P,I,D,FF,K}, integrators limited by
MC_*R_INT_LIM, slowed at large errors, frozen in the direction in which the motors are saturated and while the vehicle
stands on the ground; the yaw torque is low-passed (MC_YAW_TQ_CUTOFF).
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import Vector3

INTEGRATOR_FADE_RAD_S: Final = math.radians(400.0)
"""Rate error at which an integrator no longer moves: flips don't wind it up."""


class RateControl:
    """Gains are set through `gain_p` … `int_limit`, each (roll, pitch, yaw); `saturation` by the allocator."""

    def __init__(self) -> None:
        self.gain_p: Vector3 = (0.0, 0.0, 0.0)
        self.gain_i: Vector3 = (0.0, 0.0, 0.0)
        self.gain_d: Vector3 = (0.0, 0.0, 0.0)
        self.gain_ff: Vector3 = (0.0, 0.0, 0.0)
        self.int_limit: Vector3 = (0.0, 0.0, 0.0)
        self.yaw_torque_alpha = 1.0
        self.integral: Vector3 = (0.0, 0.0, 0.0)
        """What the integrators have learnt: torques."""
        self._yaw_torque = 0.0

    def reset_integral(self) -> None:
        """Forget what was learnt."""
        self.integral = (0.0, 0.0, 0.0)

    def update(
        self, rates: Vector3, setpoint: Vector3, derivative: Vector3, dt: float, landed: bool, unallocated: Vector3
    ) -> Vector3:
        """Torques (-1..1 is what the motors may give at most) for rates in rad/s and their derivative.

        `unallocated`: torque that the allocator could not give last time; its sign stops an integrator.
        """
        (px, py, pz), (dx, dy, dz), (fx, fy, fz) = self.gain_p, self.gain_d, self.gain_ff
        (sx, sy, sz), (ax, ay, az) = setpoint, derivative
        ex, ey, ez = sx - rates[0], sy - rates[1], sz - rates[2]
        ix, iy, iz = self.integral
        torque_x = px * ex + ix - dx * ax + fx * sx
        torque_y = py * ey + iy - dy * ay + fy * sy
        torque_z = pz * ez + iz - dz * az + fz * sz
        if not landed:
            if any(unallocated):
                ex, ey, ez = _stopped(ex, unallocated[0]), _stopped(ey, unallocated[1]), _stopped(ez, unallocated[2])
            (gx, gy, gz), (lx, ly, lz) = self.gain_i, self.int_limit
            fade = dt / (INTEGRATOR_FADE_RAD_S * INTEGRATOR_FADE_RAD_S)
            ix += gx * ex * max(0.0, dt - ex * ex * fade)
            iy += gy * ey * max(0.0, dt - ey * ey * fade)
            iz += gz * ez * max(0.0, dt - ez * ez * fade)
            self.integral = (max(-lx, min(lx, ix)), max(-ly, min(ly, iy)), max(-lz, min(lz, iz)))
        self._yaw_torque = filtered = self._yaw_torque + self.yaw_torque_alpha * (torque_z - self._yaw_torque)
        return torque_x, torque_y, filtered


def _stopped(error: float, unallocated: float) -> float:
    if unallocated > 0.0:
        return min(error, 0.0)
    return max(error, 0.0) if unallocated < 0.0 else error
