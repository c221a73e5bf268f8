"""Horizontal position from external vision; beside GNSS with its offset estimated.

PX4's EKF2 (EKF/aid_sources/external_vision/ev_pos_control.cpp, EKF/bias_estimator/position_bias_estimator.hpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.uncertain_turn import turned
from sitl_emu.autopilot.estimator.ekf import NO_AID_TIMEOUT_US, Ekf
from sitl_emu.autopilot.estimator.resets import reset_horizontal_position
from sitl_emu.autopilot.estimator.samples import VisionSample, VisionUpdate
from sitl_emu.autopilot.topics import FRAME_FRD, FRAME_NED, NAN, Quaternion
from sitl_emu.core.attitude import rotation

HORIZONTAL: Final = 1
"""Bit of EKF2_EV_CTRL."""
RESETS_IN_FLIGHT: Final = 5
LEAST_NOISE_M: Final = 0.01
BIAS_NOISE_M_SQRT_S: Final = 0.13


class VisionPosition:
    """Beside the other three of a pose."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(2)
        self._resets_left = 0
        self._bias_active = self._bias_was_active = False
        """Offsets are estimated; they ever were."""
        self._predicted_us = 0

    @property
    def _bias(self) -> tuple[float, float]:
        north, east = self._ekf.ev_pos_bias
        return north.bias, east.bias

    def control(self, update: VisionUpdate) -> None:
        """A pose has come to the horizon."""
        sample, turn, enabled, starting, jumped, good = update
        ekf, flags, aid, value = self._ekf, self._ekf.flags, self.aid, self._ekf.settings
        realigned = (flags.ev_yaw and not ekf.was_ev_yaw) or flags.yaw_align != ekf.was_yaw_aligned
        was_active = self._bias_active
        self._predict_bias()
        measured, variance = self._measure(sample, turn)
        valid = math.isfinite(sum((*measured, *variance)))
        place = (ekf.state.pn, ekf.state.pe)
        if valid and self._bias_active and not was_active:
            if good:
                self._set_bias(measured)
            elif ekf.flags.other_horizontal_aid(flags.ev_pos):
                flags.ev_pos = False
        north, east = ekf.ev_pos_bias
        position = (measured[0] - north.bias, measured[1] - east.bias)
        told = (variance[0] + north.variance, variance[1] + east.variance)
        own = (ekf.variance(cov.POSITION), ekf.variance(cov.POSITION + 1))
        innovation = (place[0] - position[0], place[1] - position[1])
        gate = max(value["EKF2_EVP_GATE"], 1.0)
        aid.update(sample.time_us, position, told, innovation, (own[0] + told[0], own[1] + told[1]), gate)
        if valid and good and self._bias_active:
            for axis, bias in enumerate((north, east)):
                noise = math.sqrt(variance[axis])
                bias.fuse(measured[axis] - place[axis], variance[axis] + own[axis], noise, ekf.dt_s)
        usable = enabled and int(value["EKF2_EV_CTRL"]) & HORIZONTAL and flags.tilt_align and valid
        if flags.ev_pos:
            if usable:
                again = jumped or realigned or was_active != self._bias_active
                self._continue(measured, variance, again=again, good=good)
            else:
                flags.ev_pos = False
        elif usable and starting:
            self._start(measured, variance)
        ekf.apply()

    def _predict_bias(self) -> None:
        ekf = self._ekf
        if self._bias_active and self._predicted_us:
            for bias in ekf.ev_pos_bias:
                bias.predict(BIAS_NOISE_M_SQRT_S, (ekf.time_us - self._predicted_us) * 1e-6)
        self._predicted_us = ekf.time_us

    def _measure(
        self, sample: VisionSample, turn: Quaternion | None
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Place of the body's origin in the filter's axes, and its variances; NaN where that can't be told."""
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        unknown = ((NAN, NAN), (NAN, NAN))
        on, oe, _ = ekf.state.to_earth(*ekf.offsets["EV"])
        (x, y, _), (a, b, _) = sample.pos, sample.position_var
        own_frame = sample.pos_frame == FRAME_FRD and flags.ev_yaw
        if (sample.pos_frame == FRAME_NED and not flags.yaw_align) or sample.pos_frame not in (FRAME_NED, FRAME_FRD):
            self._stop_bias()
            return unknown
        if own_frame:
            self._stop_bias()
        else:
            self._bias_active = flags.gnss_pos
            self._bias_was_active |= self._bias_active
        if sample.pos_frame == FRAME_FRD and not own_frame:
            if turn is None:
                return unknown
            (x, y, _), (a, b, _) = turned(sample.pos, sample.position_var, sample.orientation_var, rotation(turn))
        least = max(value["EKF2_EVP_NOISE"], LEAST_NOISE_M) ** 2
        if flags.gnss_pos:
            least = max(least, value["EKF2_GPS_P_NOISE"] ** 2)
        return (x - on, y - oe), (max(a, least), max(b, least))

    def _stop_bias(self) -> None:
        self._bias_active = False
        for bias in self._ekf.ev_pos_bias:
            bias.reset()

    def _set_bias(self, measured: tuple[float, float]) -> None:
        north, east = self._ekf.ev_pos_bias
        north.bias, east.bias = measured[0] - self._ekf.state.pn, measured[1] - self._ekf.state.pe

    def _reset(self, measured: tuple[float, float], variance: tuple[float, float]) -> None:
        ekf = self._ekf
        north, east = ekf.ev_pos_bias
        ekf.events.add("reset_pos_to_vision")
        reset_horizontal_position(
            ekf,
            (measured[0] - north.bias, measured[1] - east.bias),
            (variance[0] + north.variance, variance[1] + east.variance),
        )
        self._set_bias(measured)

    def _start(self, measured: tuple[float, float], variance: tuple[float, float]) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        if flags.gnss_pos:
            self._set_bias(measured)
            self._bias_active = self._bias_was_active = True
        else:
            if not self._bias_was_active:
                self._stop_bias()
            self._reset(measured, variance)
        self.aid.time_last_fuse = ekf.time_us
        self._resets_left = RESETS_IN_FLIGHT
        ekf.events.add("starting_vision_pos_fusion")
        flags.ev_pos = True

    def _continue(
        self, measured: tuple[float, float], variance: tuple[float, float], *, again: bool, good: bool
    ) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if again:
            if not good:
                flags.ev_pos = False
                return
            if flags.gnss_pos:
                self._set_bias(measured)
            else:
                self._reset(measured, variance)
            aid.time_last_fuse = ekf.time_us
        elif good:
            ekf.fuse_horizontal_position(aid)
        else:
            aid.innovation_rejected = True
        if not ekf.timed_out(aid.time_last_fuse, NO_AID_TIMEOUT_US):
            return
        if self._resets_left <= 0 or not good:
            flags.ev_pos = False
            return
        if flags.gnss_pos and not ekf.timed_out(ekf.hor_pos_fused_us, NO_AID_TIMEOUT_US):
            self._set_bias(measured)
        else:
            self._reset(measured, variance)
        aid.time_last_fuse = ekf.time_us
        if flags.in_air:
            self._resets_left -= 1
