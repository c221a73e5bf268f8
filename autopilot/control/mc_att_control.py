"""Attitude control of a multicopter: from an attitude setpoint to body rates.

PX4's quaternion law (src/modules/mc_att_control/AttitudeControl, v1.18), after D. Brescianini, M. Hehn and R. D'Andrea,
"Nonlinear quadrocopter attitude control" (ETH Zürich, 2013): the tilt is corrected the shortest way and first, the
remaining yaw with less weight (MC_YAW_WEIGHT). MC_ROLL_P, MC_PITCH_P, MC_YAW_P; limits MC_*RATE_MAX. What is followed
is not the setpoint itself but a critically damped model of the second order that follows it (`AttitudeReference`).
"""

import math
from typing import Final

from sitl_emu.autopilot.topics import NAN, NAN3, Quaternion, Vector3
from sitl_emu.core.attitude import product

NO_TWIST: Final = 1e-5
LEAST_FREQUENCY_RAD_S: Final = 0.1
FLT_EPSILON: Final = 1.2e-7
NO_ATTITUDE: Quaternion = (NAN, NAN, NAN, NAN)  # no Final: mypyc takes NaN for one that was never set


class AttitudeReference:
    """The attitude that is followed: the setpoint, smoothed (AttitudeControl::propagateReferenceModel).

    With MC_REF_W_N of 50 rad/s it lags 40 ms behind. Its own rate is fed forward by MC_REF_FF, no faster than
    MC_REF_FF_MAX; the yaw rate that a setpoint gives is always. After a setpoint without a direction it is NaN, for
    ever, and PX4 flies no attitude any more, whatever the mode (setAttitudeSetpoint).
    """

    def __init__(self) -> None:
        self.q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._correction: Vector3 = (0.0, 0.0, 0.0)
        """Rate by which it goes after the setpoint, about its own axes; rad/s."""
        self._known = False
        self._frequency = 50.0
        self._gain = self._most = 0.0

    def set_parameters(self, frequency_rad_s: float, gain: float, most_rad_s: float) -> None:
        """MC_REF_W_N, MC_REF_FF and MC_REF_FF_MAX (0: no limit)."""
        self._frequency = max(frequency_rad_s, LEAST_FREQUENCY_RAD_S)
        self._gain, self._most = max(0.0, min(1.0, gain)), max(most_rad_s, 0.0)

    def follow(self, q_d: Quaternion, yaw_rate_rad_s: float, dt_s: float) -> None:
        """A new setpoint, `dt_s` after the one before; what is not above 0 makes it the reference at once."""
        if not self._known or not dt_s > 0.0:
            self.q, self._correction, self._known = _normalised(q_d), (0.0, 0.0, 0.0), True
            return
        rw, rx, ry, rz = self.q
        up_x, up_y, up_z = 2.0 * (rx * rz - rw * ry), 2.0 * (ry * rz + rw * rx), 1.0 - 2.0 * (rx * rx + ry * ry)
        yaw_rate = yaw_rate_rad_s if yaw_rate_rad_s == yaw_rate_rad_s else 0.0
        w, x, y, z = product((rw, -rx, -ry, -rz), _normalised(q_d))
        sign = 2.0 if w >= 0.0 else -2.0
        error = (sign * x, sign * y, sign * z)
        phase = self._frequency * dt_s
        decay = math.exp(-phase)
        stays, by_rate = (1.0 + phase) * decay, dt_s * decay
        turn, correction = [], []
        for up, missing, rate in zip((up_x, up_y, up_z), error, self._correction, strict=True):
            turn.append((1.0 - stays) * missing + by_rate * rate + up * yaw_rate * dt_s)
            correction.append(self._frequency**2 * by_rate * missing + (1.0 - phase) * decay * rate)
        cx, cy, cz = correction
        if abs(yaw_rate) > FLT_EPSILON:
            # a heading setpoint follows the heading that is measured then: fed forward it would drive itself
            about = cx * up_x + cy * up_y + cz * up_z
            cx, cy, cz = cx - about * up_x, cy - about * up_y, cz - about * up_z
        self._correction = cx, cy, cz
        tx, ty, tz = turn
        angle = math.sqrt(tx * tx + ty * ty + tz * tz)
        share = math.sin(angle / 2.0) / angle if angle > 0.0 else 0.5
        self.q = _normalised(product(self.q, (math.cos(angle / 2.0), tx * share, ty * share, tz * share)))

    def turned(self, delta_heading: float) -> None:
        """The estimate of the heading has jumped."""
        half = delta_heading / 2.0
        self.q = _normalised(product((math.cos(half), 0.0, 0.0, math.sin(half)), self.q))

    def feed_forward(self, q: Quaternion) -> Vector3:
        """Its rate about the vehicle's axes, as far as it is fed forward."""
        if not self._gain:
            return 0.0, 0.0, 0.0
        qw, qx, qy, qz = q
        between = product((qw, -qx, -qy, -qz), self.q)
        _, x, y, z = product(product(between, (0.0, *self._correction)), _conjugated(between))
        most = self._most if self._most > 0.0 else math.inf
        ahead = [max(-most, min(most, self._gain * rate)) for rate in (x, y, z)]
        return ahead[0], ahead[1], ahead[2]


def _normalised(q: Quaternion) -> Quaternion:
    w, x, y, z = q
    size = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / size, x / size, y / size, z / size) if 0.0 < size < math.inf else NO_ATTITUDE


def _conjugated(q: Quaternion) -> Quaternion:
    return q[0], -q[1], -q[2], -q[3]


def rates_setpoint(
    q: Quaternion,
    q_d: Quaternion,
    yaw_rate_rad_s: float,
    gains: Vector3,
    yaw_weight: float,
    rate_limits: Vector3,
    feed_forward: Vector3 = (0.0, 0.0, 0.0),
) -> Vector3:
    """Body rates (rad/s) that turn attitude `q` to `q_d`; NaN to one that is NaN.

    `yaw_rate_rad_s` is the feed-forward about the vertical, `feed_forward` another about the body's axes; `gains`
    (1/s): MC_ROLL_P, MC_PITCH_P and MC_YAW_P divided by `yaw_weight`, for the weight takes it back.
    """
    qw, qx, qy, qz = q
    dw, dx, dy, dz = q_d
    if dw != dw:
        return NAN3
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
    more_x, more_y, more_z = feed_forward
    return (
        max(-max_x, min(max_x, rate_x + more_x)),
        max(-max_y, min(max_y, rate_y + more_y)),
        max(-max_z, min(max_z, rate_z + more_z)),
    )
