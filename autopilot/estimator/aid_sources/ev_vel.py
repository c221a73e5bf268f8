"""Velocity from external vision, in its own axes, in NED or in the body's.

PX4's EKF2 (EKF/aid_sources/external_vision: ev_vel_control.cpp, ev_vel.h, v1.18).
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.uncertain_turn import turned, turned_variances
from sitl_emu.autopilot.estimator.ekf import NO_AID_TIMEOUT_US, Ekf
from sitl_emu.autopilot.estimator.resets import reset_velocity, reset_vertical_velocity
from sitl_emu.autopilot.estimator.samples import ImuSample, VisionSample, VisionUpdate
from sitl_emu.autopilot.topics import FRAME_BODY_FRD, FRAME_FRD, NAN3, Quaternion, Vector3
from sitl_emu.core.attitude import rotation

VELOCITY: Final = 4
"""Bit of EKF2_EV_CTRL."""
RESETS_IN_FLIGHT: Final = 5
LEAST_NOISE_M_S: Final = 0.01
BODY_RESET_FACTOR: Final = 5.0
"""A velocity of the body's axes that the state is set to is taken to be that much less certain."""
STARTING_GATE_FACTOR = math.sqrt(10.0)


class VisionVelocity:
    """Beside the other three of a pose."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(3)
        self._resets_left = 0
        self._measured = self._variance = NAN3
        self._in_body = False

    def control(self, imu: ImuSample, update: VisionUpdate) -> None:
        """A pose has come to the horizon."""
        sample, turn, enabled, starting, jumped, good = update
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        self._measure(imu, sample, turn)
        usable = (
            enabled
            and int(value["EKF2_EV_CTRL"]) & VELOCITY
            and flags.tilt_align
            and math.hypot(*sample.vel) <= value["EKF2_VEL_LIM"]
            and math.isfinite(sum((*self._measured, *self._variance)))
        )
        realigned = (flags.ev_yaw and not ekf.was_ev_yaw) or flags.yaw_align != ekf.was_yaw_aligned
        gate = max(value["EKF2_EVV_GATE"], 1.0)
        if flags.ev_vel:
            if usable:
                self._continue(sample.time_us, gate, jumped=jumped, realigned=realigned, good=good)
            else:
                flags.ev_vel = False
        elif usable and starting:
            self._start(sample.time_us, gate, realigned=realigned)

    def _measure(self, imu: ImuSample, sample: VisionSample, turn: Quaternion | None) -> None:
        """Velocity of the body's origin, and variances of at least EKF2_EVV_NOISE."""
        ekf, state, value = self._ekf, self._ekf.state, self._ekf.settings
        x, y, z = ekf.offsets["EV"]
        gx, gy, gz = (part / imu.dt_s - bias for part, bias in zip(imu.delta_angle, state.gyro_bias, strict=True))
        offset = (gy * z - gz * y, gz * x - gx * z, gx * y - gy * x)
        variance = sample.velocity_var
        self._in_body = sample.vel_frame == FRAME_BODY_FRD
        if self._in_body:
            measured = sample.vel
        else:
            offset = state.to_earth(*offset)
            measured = sample.vel
            if sample.vel_frame == FRAME_FRD and not ekf.flags.ev_yaw:
                if turn is None:
                    self._measured = NAN3
                    return
                measured, variance = turned(sample.vel, sample.velocity_var, sample.orientation_var, rotation(turn))
            elif sample.vel_frame != FRAME_FRD and not ekf.flags.yaw_align:
                self._measured = NAN3
                return
        least = max(value["EKF2_EVV_NOISE"], LEAST_NOISE_M_S) ** 2
        self._variance = (max(variance[0], least), max(variance[1], least), max(variance[2], least))
        self._measured = (measured[0] - offset[0], measured[1] - offset[1], measured[2] - offset[2])

    def _continue(self, time_us: int, gate: float, *, jumped: bool, realigned: bool, good: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if (jumped and not ekf.flags.other_horizontal_aid(flags.ev_vel)) or realigned:
            if not good:
                flags.ev_vel = False
                return
            self._reset()
        elif good:
            self._fuse(time_us, gate)
        else:
            aid.innovation_rejected = True
        if ekf.timed_out(aid.time_last_fuse, NO_AID_TIMEOUT_US):
            if self._resets_left > 0 and good:
                self._reset()
                if flags.in_air:
                    self._resets_left -= 1
            else:
                flags.ev_vel = False
        elif ekf.height_reset_required():
            # PX4 takes the third axis as it is, the body's as well (resetVerticalVelocity of ev_vel.h is not virtual).
            reset_vertical_velocity(ekf, self._measured[2], self._variance[2])

    def _start(self, time_us: int, gate: float, *, realigned: bool) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        if not ekf.flags.horizontal_aiding or realigned:
            self._reset()
            flags.ev_vel = True
        else:
            flags.ev_vel = self._fuse(time_us, gate * STARTING_GATE_FACTOR)
        if flags.ev_vel:
            self._resets_left = RESETS_IN_FLIGHT
            ekf.events.add("starting_vision_vel_fusion")

    def _in_ned(self) -> tuple[Vector3, Vector3]:
        """What a reset sets the velocity to."""
        if not self._in_body:
            return self._measured, self._variance
        r, variance = self._ekf.state.rotation, self._variance
        a, b, c = (BODY_RESET_FACTOR * spread for spread in turned_variances(variance, r))
        return self._ekf.state.to_earth(*self._measured), (a, b, c)

    def _reset(self) -> None:
        ekf = self._ekf
        ekf.events.add("reset_vel_to_vision")
        self.aid.observation, self.aid.observation_variance = list(self._measured), list(self._variance)
        reset_velocity(ekf, *self._in_ned())
        self.aid.reset(ekf.time_us)

    def _fuse(self, time_us: int, gate: float) -> bool:
        ekf, aid, state = self._ekf, self.aid, self._ekf.state
        if not self._in_body:
            told = [ekf.variance(cov.VELOCITY + axis) + self._variance[axis] for axis in range(3)]
            n, e, d = self._measured
            aid.update(time_us, self._measured, self._variance, (state.vn - n, state.ve - e, state.vd - d), told, gate)
            fused = ekf.fuse_velocity(aid)
            ekf.apply()
            return fused
        jacobians = [self._jacobian(axis) for axis in range(3)]
        told = [ekf.innovation_variance(h, self._variance[axis])[1] for axis, h in enumerate(jacobians)]
        aid.update(time_us, self._measured, self._variance, self._body_innovation(), told, gate)
        if aid.innovation_rejected:
            return False
        for axis, h in enumerate(jacobians):
            ph, aid.innovation_variance[axis] = ekf.innovation_variance(h, self._variance[axis])
            aid.innovation[axis] = self._body_innovation()[axis]
            ekf.fuse(ph, aid.innovation[axis], aid.innovation_variance[axis])
        aid.fused, aid.time_last_fuse = True, ekf.time_us
        ekf.hor_vel_fused_us = ekf.ver_vel_fused_us = ekf.time_us
        return True

    def _body_innovation(self) -> Vector3:
        state = self._ekf.state
        x, y, z = state.to_body(state.vn, state.ve, state.vd)
        return x - self._measured[0], y - self._measured[1], z - self._measured[2]

    def _jacobian(self, axis: int) -> cov.Matrix:
        state = self._ekf.state
        h = np.zeros(cov.STATES)
        rx, ry, rz = state.rotation[axis], state.rotation[3 + axis], state.rotation[6 + axis]
        vn, ve, vd = state.vn, state.ve, state.vd
        h[0:3] = (ry * vd - rz * ve, rz * vn - rx * vd, rx * ve - ry * vn)
        h[3:6] = (rx, ry, rz)
        return h
