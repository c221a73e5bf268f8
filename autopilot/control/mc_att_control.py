"""Attitude control of a multicopter: from an attitude setpoint to body rates.

PX4's quaternion law (src/modules/mc_att_control/AttitudeControl, v1.18), after D. Brescianini, M. Hehn and R. D'Andrea,
"Nonlinear quadrocopter attitude control" (ETH Zürich, 2013): the tilt is corrected the shortest way and first, the
remaining yaw with less weight (MC_YAW_WEIGHT). MC_ROLL_P, MC_PITCH_P, MC_YAW_P; limits MC_*RATE_MAX.
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import Quaternion, Vector3

NO_TWIST: Final = 1e-5


def rates_setpoint(
    q: Quaternion, q_d: Quaternion, yaw_rate_rad_s: float, gains: Vector3, yaw_weight: float, rate_limits: Vector3
) -> Vector3:
    """Body rates (rad/s) that turn attitude `q` to `q_d`.

    `yaw_rate_rad_s` is the feed-forward about the vertical; `gains` (1/s): MC_ROLL_P, MC_PITCH_P and MC_YAW_P divided
    by `yaw_weight`, for the weight takes it back.
    """
    qw, qx, qy, qz = q
    dw, dx, dy, dz = q_d
    # Error in the body frame: conj(q) * q_d, split into a twist about body z and a tilt.
    ew = qw * dw + qx * dx + qy * dy + qz * dz
    ex = qw * dx - qx * dw - qy * dz + qz * dy
    ey = qw * dy + qx * dz - qy * dw - qz * dx
    ez = qw * dz - qx * dy + qy * dx - qz * dw
    twist = math.sqrt(ew * ew + ez * ez)
    if twist > NO_TWIST:
        c, s = ew / twist, ez / twist
        tilt_x, tilt_y = ex * c - ey * s, ey * c + ex * s
        if c < 0.0:
            c, s = -c, -s
            tilt_x, tilt_y, twist = -tilt_x, -tilt_y, -twist
        half_yaw = yaw_weight * math.atan2(s, c)
        c, s = math.cos(half_yaw), math.sin(half_yaw)
        ew, ex, ey, ez = twist * c, tilt_x * c + tilt_y * s, tilt_y * c - tilt_x * s, twist * s
    sign = 2.0 if ew >= 0.0 else -2.0
    gain_x, gain_y, gain_z = gains
    rate_x, rate_y, rate_z = sign * ex * gain_x, sign * ey * gain_y, sign * ez * gain_z
    if yaw_rate_rad_s:
        rate_x += 2.0 * (qx * qz - qw * qy) * yaw_rate_rad_s
        rate_y += 2.0 * (qy * qz + qw * qx) * yaw_rate_rad_s
        rate_z += (1.0 - 2.0 * (qx * qx + qy * qy)) * yaw_rate_rad_s
    max_x, max_y, max_z = rate_limits
    return (
        max(-max_x, min(max_x, rate_x)),
        max(-max_y, min(max_y, rate_y)),
        max(-max_z, min(max_z, rate_z)),
    )
