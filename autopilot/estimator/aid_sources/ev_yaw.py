"""Heading from external vision.

PX4's EKF2 (EKF/aid_sources/external_vision/ev_yaw_control.cpp, v1.18). A pose in NED knows where north is; one in FRD
begins with a heading of its own, and whoever follows it gives up north.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import NO_AID_TIMEOUT_US, Ekf
from sitl_emu.autopilot.estimator.resets import reset_yaw
from sitl_emu.autopilot.estimator.samples import VisionSample, VisionUpdate
from sitl_emu.autopilot.topics import FRAME_FRD, FRAME_NED
from sitl_emu.core.attitude import heading
from sitl_emu.core.geodesy import wrap_pi

YAW: Final = 8
"""Bit of EKF2_EV_CTRL."""
RESETS_IN_FLIGHT: Final = 5
RESTART_AFTER_US: Final = 1_000_000
LEAST_NOISE_RAD: Final = 0.01


class VisionYaw:
    """Beside the other three of a pose."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(1)
        self._resets_left = 0

    def control(self, update: VisionUpdate) -> None:
        """A pose has come to the horizon."""
        sample, _, enabled, starting, jumped, good = update
        ekf, flags, aid, value = self._ekf, self._ekf.flags, self.aid, self._ekf.settings
        yaw = heading(sample.q)
        variance = max(sample.orientation_var[2], value["EKF2_EVA_NOISE"] ** 2, LEAST_NOISE_RAD**2)
        told = ekf.variance(cov.YAW) + variance
        gate = max(value["EKF2_HDG_GATE"], 1.0)
        difference = wrap_pi(ekf.state.yaw - yaw) if math.isfinite(yaw) else yaw
        aid.update(sample.time_us, (yaw,), (variance,), (difference,), (told,), gate)
        if jumped:
            flags.ev_yaw_fault = False
        gnss_knows_north = (flags.gnss_vel or flags.gnss_pos) and flags.yaw_align
        usable = (
            enabled
            and int(value["EKF2_EV_CTRL"]) & YAW
            and flags.tilt_align
            and not flags.ev_yaw_fault
            and math.isfinite(yaw)
            and math.isfinite(variance)
            and not (gnss_knows_north and sample.pos_frame != FRAME_NED)
        )
        if flags.ev_yaw:
            if usable:
                self._continue(jumped=jumped, good=good)
            else:
                flags.ev_yaw = False
        elif usable and starting and ekf.timed_out(aid.time_last_fuse, RESTART_AFTER_US):
            self._start(sample)

    def _continue(self, *, jumped: bool, good: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if jumped:
            if not good:
                flags.ev_yaw = False
                return
            self._reset()
        elif good:
            ekf.fuse_yaw(aid)
        else:
            aid.innovation_rejected = True
        if not ekf.timed_out(aid.time_last_fuse, NO_AID_TIMEOUT_US):
            return
        if self._resets_left > 0 and good:
            self._reset()
            if flags.in_air:
                self._resets_left -= 1
        else:
            flags.ev_yaw = False

    def _reset(self) -> None:
        aid = self.aid
        reset_yaw(self._ekf, aid.observation[0], aid.observation_variance[0])
        aid.time_last_fuse = self._ekf.time_us

    def _start(self, sample: VisionSample) -> None:
        ekf, flags = self._ekf, self._ekf.flags
        if sample.pos_frame == FRAME_NED:
            if flags.yaw_align:
                flags.ev_yaw = ekf.fuse_yaw(self.aid)
            else:
                self._reset()
                flags.yaw_align = flags.ev_yaw = True
        elif sample.pos_frame == FRAME_FRD:
            self._reset()
            flags.yaw_align, flags.ev_yaw = False, True
        if flags.ev_yaw:
            ekf.events.add("starting_vision_yaw_fusion")
            self._resets_left = RESETS_IN_FLIGHT
