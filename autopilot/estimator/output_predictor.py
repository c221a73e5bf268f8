"""From the filter's late state to the present: the newest IMU samples integrated, drawn towards the filter.

PX4's EKF2 (EKF/output_predictor, v1.18; idea: A. Khosravian and others, "Recursive attitude estimation in the presence
of multi-rate and multi-delay vector measurements", ACC 2015). The past of the integration is kept as far back as the
fusion horizon. There it is compared with the filter: attitude errors are worked off by a turn that is added to each
sample, errors of velocity and position shift the whole past at once, with gains that follow from EKF2_TAU_VEL and
EKF2_TAU_POS. A second integration of the height alone keeps a velocity that fits the change of height (`z_deriv`).

Shifts of the whole past are kept as one sum: a stored velocity or position is what it was when stored, less that sum.
"""

import math
from collections import deque
from typing import Final

from sitl_emu.autopilot.topics import Quaternion, Vector3
from sitl_emu.core.attitude import Rotation, after_small_turn, product, rotation

Entry = tuple[Quaternion, float, float, float, float, float, float, float, float]
"""Attitude, velocity and position NED, vertical velocity of the second integration, its step (s)."""
LARGEST_TAU_S: Final = 10.0
INTEGRAL_SHARE: Final = 0.1
VERTICAL_DAMPING: Final = 1.1
ATTITUDE_SHARE: Final = 0.5
LEAST_DT_S: Final = 1e-4
MOST_DT_S: Final = 0.03
MEAN_WEIGHT: Final = 0.2
STEP_AT_START_S: Final = 0.01
SAMPLE_AT_START_S: Final = 0.005
LARGEST_ERROR_M_S: Final = 1e4
LARGEST_ERROR_M: Final = 1e7
"""Beyond this the past tells nothing, and the integration begins anew (ours; the filter's velocity is 1e3 at most)."""
LEAST_COS_SQUARED: Final = 1e-6
"""Of the pitch: straight up or down there is no yaw."""


class OutputPredictor:
    """Attitude `q` (body to NED), velocity `vn, ve, vd`, position `pn, pe, pd` in the local frame; plain scalars."""

    def __init__(self, length: int) -> None:
        """`length`: how many filter steps the horizon lies behind, plus one."""
        self.q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.rotation: Rotation = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        self.vn = self.ve = self.vd = 0.0
        self.pn = self.pe = self.pd = 0.0
        self.z_deriv = 0.0
        self.unaided_yaw = 0.0
        self.tracking_error: Vector3 = (0.0, 0.0, 0.0)
        """At the horizon: rad, m/s, m."""
        self.gravity_m_s2 = 9.80665
        self._past: deque[Entry] = deque(maxlen=length)
        self._shift_v = (0.0, 0.0, 0.0)
        self._shift_p = (0.0, 0.0, 0.0)
        self._shift_z_deriv = 0.0
        self._oldest_down_m = 0.0
        """Height of the second integration at the horizon."""
        self._dt_s = 0.0
        self._gyro_bias: Vector3 = (0.0, 0.0, 0.0)
        self._accel_bias: Vector3 = (0.0, 0.0, 0.0)
        self._turn: Vector3 = (0.0, 0.0, 0.0)
        """Half the angle that is added to each sample, in the body's axes."""
        self._attitude_error = 0.0
        self._v_integral: Vector3 = (0.0, 0.0, 0.0)
        self._p_integral: Vector3 = (0.0, 0.0, 0.0)
        self._step_s, self._sample_s = STEP_AT_START_S, SAMPLE_AT_START_S
        """Means of what lies between two corrections, and between two samples."""
        self._sum_vn = self._sum_ve = self._sum_vd = 0.0
        self.acceleration: Vector3 = (0.0, 0.0, 0.0)
        """Mean over the last step of the filter, NED."""

    def align(self, q: Quaternion, velocity: Vector3, position: Vector3) -> None:
        """Begin anew at this state; the past is forgotten."""
        self.q, self.rotation = q, rotation(q)
        self.vn, self.ve, self.vd = velocity
        self.pn, self.pe, self.pd = position
        self.z_deriv, self._oldest_down_m = self.vd, self.pd
        self._past.clear()
        self._shift_v = self._shift_p = (0.0, 0.0, 0.0)
        self._shift_z_deriv = 0.0
        self._v_integral = self._p_integral = (0.0, 0.0, 0.0)

    def update(self, ux: float, uy: float, uz: float, ax: float, ay: float, az: float, dt: float) -> None:
        """The newest sample: by how much it has turned (rad), and how its velocity has changed (m/s), in `dt` (s)."""
        self._sample_s += MEAN_WEIGHT * (min(max(dt, LEAST_DT_S), MOST_DT_S) - self._sample_s)
        bx, by, bz = self._gyro_bias
        tx, ty, tz = self._turn
        half = 0.5 * dt
        ux, uy, uz = 0.5 * ux - bx * half, 0.5 * uy - by * half, 0.5 * uz - bz * half
        self.q = q = after_small_turn(self.q, ux + tx, uy + ty, uz + tz)
        self.rotation = r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation(q)
        bx, by, bz = self._accel_bias
        ax -= bx * dt
        ay -= by * dt
        az -= bz * dt
        dvn = r00 * ax + r01 * ay + r02 * az
        dve = r10 * ax + r11 * ay + r12 * az
        dvd = r20 * ax + r21 * ay + r22 * az + self.gravity_m_s2 * dt
        self._sum_vn += dvn
        self._sum_ve += dve
        self._sum_vd += dvd
        self._dt_s += dt
        vn, ve, vd = self.vn, self.ve, self.vd
        self.pn += (vn + 0.5 * dvn) * dt
        self.pe += (ve + 0.5 * dve) * dt
        self.pd += (vd + 0.5 * dvd) * dt
        self.vn, self.ve, self.vd = vn + dvn, ve + dve, vd + dvd
        self.z_deriv += dvd
        # Rate of the Euler angle yaw, from the gyro alone.
        self.unaided_yaw += 2.0 * (r21 * uy + r22 * uz) / max(1.0 - r20 * r20, LEAST_COS_SQUARED)

    def correct(
        self,
        delay_s: float,
        dt_s: float,
        q: Quaternion,
        velocity: Vector3,
        position: Vector3,
        biases: tuple[Vector3, Vector3],
        taus_s: tuple[float, float],
    ) -> None:
        """Follow the filter, which has these states `delay_s` ago; `taus_s`: EKF2_TAU_VEL, EKF2_TAU_POS."""
        self._step_s += MEAN_WEIGHT * (min(max(dt_s, LEAST_DT_S), MOST_DT_S) - self._step_s)
        since_s = self._dt_s
        self.acceleration = (self._sum_vn / since_s, self._sum_ve / since_s, self._sum_vd / since_s)
        self._sum_vn = self._sum_ve = self._sum_vd = 0.0
        self._gyro_bias, self._accel_bias = biases
        on, oe, od, opn, ope, opd = self._remember(q, delay_s)
        step_s = self._step_s
        gain_v = step_s / min(max(taus_s[0], step_s), LARGEST_TAU_S)
        gain_p = step_s / min(max(taus_s[1], step_s), LARGEST_TAU_S)
        en, ee, ed = velocity[0] - on, velocity[1] - oe, velocity[2] - od
        fn, fe, fd = position[0] - opn, position[1] - ope, position[2] - opd
        self.tracking_error = (
            self._attitude_error,
            math.sqrt(en * en + ee * ee + ed * ed),
            math.sqrt(fn * fn + fe * fe + fd * fd),
        )
        if not (self.tracking_error[1] < LARGEST_ERROR_M_S and self.tracking_error[2] < LARGEST_ERROR_M):
            self.align(q, velocity, position)
            return
        i_n, i_e, i_d = self._v_integral
        self._v_integral = i_n, i_e, i_d = i_n + en, i_e + ee, i_d + ed
        share = INTEGRAL_SHARE * gain_v * gain_v
        self._shift_velocity(en * gain_v + i_n * share, ee * gain_v + i_e * share, ed * gain_v + i_d * share)
        i_n, i_e, i_d = self._p_integral
        self._p_integral = i_n, i_e, i_d = i_n + fn, i_e + fe, i_d + fd
        share = INTEGRAL_SHARE * gain_p * gain_p
        self._shift_position(fn * gain_p + i_n * share, fe * gain_p + i_e * share, fd * gain_p + i_d * share)
        self._correct_vertical(velocity[2], position[2], gain_v, gain_p)

    def _remember(self, q: Quaternion, delay_s: float) -> tuple[float, float, float, float, float, float]:
        """Store the present, work off the attitude's error at the horizon; velocity and position there."""
        sn, se, sd = self._shift_v
        tn, te, td = self._shift_p
        past = self._past
        if not past:
            self._oldest_down_m = self.pd
        past.append(
            (
                self.q, self.vn - sn, self.ve - se, self.vd - sd, self.pn - tn, self.pe - te, self.pd - td,
                self.z_deriv - self._shift_z_deriv, self._dt_s,
            )
        )  # fmt: skip
        self._dt_s = 0.0
        (ow, ox, oy, oz), vn, ve, vd, pn, pe, pd, _, _ = past[0]
        w, x, y, z = q
        # error = inverse(q) * past attitude; its vector part is half the angle in the body's axes
        scalar = w * ow + x * ox + y * oy + z * oz
        sign = -1.0 if scalar >= 0.0 else 1.0
        ex = sign * (w * ox - x * ow - y * oz + z * oy)
        ey = sign * (w * oy + x * oz - y * ow - z * ox)
        ez = sign * (w * oz - x * oy + y * ox - z * ow)
        gain = ATTITUDE_SHARE * self._sample_s / max(delay_s, self._sample_s)
        self._turn = (ex * gain, ey * gain, ez * gain)
        self._attitude_error = 2.0 * math.sqrt(ex * ex + ey * ey + ez * ez)
        return vn + sn, ve + se, vd + sd, pn + tn, pe + te, pd + td

    def _correct_vertical(self, vd: float, pd: float, gain_v: float, gain_p: float) -> None:
        """The second integration: velocity corrected by both errors, height followed from the corrected velocity."""
        past = self._past
        oldest = past[0][7] + self._shift_z_deriv
        correction = (pd - self._oldest_down_m) * gain_p + (vd - oldest) * gain_v * VERTICAL_DAMPING
        self._shift_z_deriv += correction
        self.z_deriv += correction
        if len(past) == past.maxlen and len(past) > 1:
            # The next entry is the horizon of the next step.
            following = past[1]
            mean = 0.5 * (past[0][7] + following[7]) + self._shift_z_deriv
            self._oldest_down_m += mean * following[8]

    # --- resets --------------------------------------------------------------------------------------------

    def reset_quaternion(self, change: Quaternion) -> None:
        """Turn past and present by `change` (in NED)."""
        self.q = _normalized(product(change, self.q))
        self.rotation = rotation(self.q)
        past = self._past
        for _ in range(len(past)):
            entry = past.popleft()
            past.append((_normalized(product(change, entry[0])), *entry[1:]))

    def reset_horizontal_velocity(self, delta_n: float, delta_e: float) -> None:
        """The filter's velocity jumped by this much (m/s)."""
        self._shift_velocity(delta_n, delta_e, 0.0)

    def reset_vertical_velocity(self, delta_d: float) -> None:
        """The filter's vertical velocity jumped by this much (m/s)."""
        self._shift_velocity(0.0, 0.0, delta_d)
        self._shift_z_deriv += delta_d
        self.z_deriv += delta_d

    def reset_position(self, delta_n: float, delta_e: float, delta_d: float) -> None:
        """The filter's position jumped by this much (m)."""
        self._shift_position(delta_n, delta_e, delta_d)
        self._oldest_down_m += delta_d

    def _shift_velocity(self, n: float, e: float, d: float) -> None:
        self.vn += n
        self.ve += e
        self.vd += d
        sn, se, sd = self._shift_v
        self._shift_v = (sn + n, se + e, sd + d)

    def _shift_position(self, n: float, e: float, d: float) -> None:
        self.pn += n
        self.pe += e
        self.pd += d
        sn, se, sd = self._shift_p
        self._shift_p = (sn + n, se + e, sd + d)


def _normalized(q: Quaternion) -> Quaternion:
    norm = math.sqrt(sum(value * value for value in q))
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)
