"""Height from external vision: the reference, or beside another one with its offset estimated (EKF2_HGT_REF 3).

PX4's EKF2 (EKF/aid_sources/external_vision/ev_height_control.cpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.uncertain_turn import turned
from sitl_emu.autopilot.estimator.ekf import EV, HEIGHT_FUSION_TIMEOUT_US, UNKNOWN, Ekf
from sitl_emu.autopilot.estimator.resets import reset_altitude
from sitl_emu.autopilot.estimator.samples import VisionSample, VisionUpdate
from sitl_emu.autopilot.topics import FRAME_FRD, Quaternion
from sitl_emu.core.attitude import rotation

VERTICAL: Final = 2
"""Bit of EKF2_EV_CTRL."""
LEAST_NOISE_M: Final = 0.01
BIAS_NOISE_M_SQRT_S: Final = 0.13


class VisionHeight:
    """Beside the other three of a pose."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(1)
        self._predicted_us = 0

    def control(self, update: VisionUpdate) -> None:
        """A pose has come to the horizon."""
        sample, turn, enabled, starting, jumped, good = update
        ekf, flags, bias, value = self._ekf, self._ekf.flags, self._ekf.ev_hgt_bias, self._ekf.settings
        estimates = flags.ev_hgt and ekf.height_reference != EV
        if estimates and self._predicted_us:
            bias.predict(BIAS_NOISE_M_SQRT_S, (ekf.time_us - self._predicted_us) * 1e-6)
        self._predicted_us = ekf.time_us
        down, variance = self._measure(sample, turn)
        gate = max(value["EKF2_EVP_GATE"], 1.0)
        ekf.update_height_aid(self.aid, sample.time_us, down - bias.bias, variance + bias.variance, gate)
        valid = math.isfinite(down + variance)
        if valid and good and estimates:
            bias.fuse(down + ekf.state.alt, variance + ekf.variance(cov.HEIGHT), math.sqrt(variance), ekf.dt_s)
        usable = enabled and int(value["EKF2_EV_CTRL"]) & VERTICAL and valid
        if flags.ev_hgt:
            if usable:
                self._continue(down, variance, jumped=jumped, good=good)
            else:
                self.stop()
        elif usable and starting:
            self._start(down, variance)
        ekf.apply()

    def _measure(self, sample: VisionSample, turn: Quaternion | None) -> tuple[float, float]:
        """Down position of the body's origin, and its variance."""
        ekf, flags, value = self._ekf, self._ekf.flags, self._ekf.settings
        down, variance = sample.pos[2], sample.position_var[2]
        if not (flags.ev_yaw and flags.ev_pos) and sample.pos_frame == FRAME_FRD and turn is not None:
            (_, _, down), (_, _, variance) = turned(
                sample.pos, sample.position_var, sample.orientation_var, rotation(turn)
            )
        _, _, below = ekf.state.to_earth(*ekf.offsets["EV"])
        variance = max(variance, value["EKF2_EVP_NOISE"] ** 2, LEAST_NOISE_M**2)
        if flags.gps_hgt:
            variance = max(variance, value["EKF2_GPS_P_NOISE"] ** 2)
        return down - below, variance

    def _continue(self, down: float, variance: float, *, jumped: bool, good: bool) -> None:
        ekf, aid, bias = self._ekf, self.aid, self._ekf.ev_hgt_bias
        if jumped:
            if not good:
                self.stop()
                return
            if ekf.height_reference == EV:
                ekf.events.add("reset_hgt_to_ev")
                reset_altitude(ekf, -down, variance)
                bias.reset()
            else:
                bias.bias = down + ekf.state.alt
            aid.time_last_fuse = ekf.time_us
        elif good:
            ekf.fuse_vertical_position(aid)
        else:
            aid.innovation_rejected = True
        if ekf.height_reset_required() and good and ekf.height_reference == EV:
            # All height sources are failing. The bias' sign is PX4's, which is wrong (ev_height_control.cpp).
            ekf.events.add("reset_hgt_to_ev")
            reset_altitude(ekf, -down - bias.bias, variance)
            bias.bias = down + ekf.state.alt
            aid.time_last_fuse = ekf.time_us
        elif ekf.timed_out(aid.time_last_fuse, HEIGHT_FUSION_TIMEOUT_US):
            self.stop()

    def _start(self, down: float, variance: float) -> None:
        ekf, bias = self._ekf, self._ekf.ev_hgt_bias
        if int(ekf.settings["EKF2_HGT_REF"]) == EV:
            ekf.events.add("reset_hgt_to_ev")
            reset_altitude(ekf, -down, variance)
            ekf.height_reference = EV
            bias.reset()
        else:
            bias.bias = down + ekf.state.alt
        self.aid.time_last_fuse = ekf.time_us
        ekf.flags.ev_hgt = True

    def stop(self) -> None:
        """Its height is used no more."""
        ekf = self._ekf
        if ekf.flags.ev_hgt:
            if ekf.height_reference == EV:
                ekf.height_reference = UNKNOWN
            ekf.flags.ev_hgt = False
