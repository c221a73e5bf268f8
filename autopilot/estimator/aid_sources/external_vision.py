"""Poses from outside: which of their parts are used is EKF2_EV_CTRL's.

PX4's EKF2 (EKF/aid_sources/external_vision/ev_control.cpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator.aid_sources.ev_height import VisionHeight
from sitl_emu.autopilot.estimator.aid_sources.ev_pos import VisionPosition
from sitl_emu.autopilot.estimator.aid_sources.ev_vel import VisionVelocity
from sitl_emu.autopilot.estimator.aid_sources.ev_yaw import VisionYaw
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.samples import ImuSample, SampleBuffer, VisionSample, VisionUpdate
from sitl_emu.autopilot.topics import FRAME_NED, Quaternion
from sitl_emu.core.attitude import product

SENS_EN: Final = 1 << 3
"""Its bit of EKF2_SENS_EN."""
MAX_INTERVAL_US: Final = 200_000
TURN_WEIGHT: Final = 0.01 / (0.01 + 10.0)
"""Of a new sample in the low-pass of the turn from vision's axes to the filter's: of ten seconds."""


class ExternalVision:
    """Its four parts, and the turn between its axes and the filter's."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[VisionSample] = SampleBuffer(ekf.observation_buffer_length)
        self.yaw, self.vel = VisionYaw(ekf), VisionVelocity(ekf)
        self.pos, self.height = VisionPosition(ekf), VisionHeight(ekf)
        self._previous = VisionSample(0)
        self._turn: Quaternion | None = None

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return bool(int(self._ekf.settings["EKF2_EV_CTRL"])) and bool(self._ekf.sens_en & SENS_EN)

    def control(self, imu: ImuSample) -> None:
        """One step of the filter."""
        ekf, flags = self._ekf, self._ekf.flags
        if ekf.on_yaw_change is not None:
            if self._turn is not None:
                self._turn = product(ekf.on_yaw_change, self._turn)
            ekf.on_yaw_change = None
        sample = self.buffer.pop(imu.time_us)
        if sample is not None:
            self._on_sample(imu, sample)
        elif (flags.ev_pos or flags.ev_vel or flags.ev_yaw or flags.ev_hgt) and ekf.timed_out(
            self._previous.time_us, 2 * MAX_INTERVAL_US
        ):
            flags.ev_pos = flags.ev_vel = flags.ev_yaw = False
            self.height.stop()
            self._turn = None

    def _on_sample(self, imu: ImuSample, sample: VisionSample) -> None:
        ekf, previous, newest = self._ekf, self._previous, self.buffer.newest()
        least = int(ekf.settings["EKF2_EV_QMIN"])
        jumped = sample.reset_counter != previous.reset_counter
        good = least <= 0 or sample.quality >= least
        starting = (
            good
            and sample.time_us - previous.time_us < MAX_INTERVAL_US
            and (least <= 0 or previous.quality >= least)
            and (least <= 0 or newest is None or newest.quality >= least)
            and ekf.newest_recent(self.buffer.pushed_us, MAX_INTERVAL_US)
        )
        self._follow_turn(sample, jumped=jumped)
        enabled = bool(ekf.sens_en & SENS_EN)
        update = VisionUpdate(sample, self._turn, enabled=enabled, starting=starting, jumped=jumped, good=good)
        self.yaw.control(update)
        self.vel.control(imu, update)
        self.pos.control(update)
        self.height.control(update)
        ekf.apply()
        if good:
            self._previous = sample
            ekf.ne_vision_pos, ekf.ne_vision_vel = sample.pos_frame == FRAME_NED, sample.vel_frame == FRAME_NED

    def _follow_turn(self, sample: VisionSample, *, jumped: bool) -> None:
        """The turn from vision's axes to the filter's, slowly followed."""
        w, x, y, z = sample.q
        turn = product(self._ekf.state.q, (w, -x, -y, -z))
        if not math.isfinite(sum(turn)):
            return
        if self._turn is None or jumped:
            self._turn = turn
            return
        dot = sum(a * b for a, b in zip(turn, self._turn, strict=True))
        sign = 1.0 if dot >= 0.0 else -1.0
        mixed = [old + TURN_WEIGHT * (sign * new - old) for old, new in zip(self._turn, turn, strict=True)]
        norm = math.sqrt(sum(value * value for value in mixed)) or 1.0
        self._turn = (mixed[0] / norm, mixed[1] / norm, mixed[2] / norm, mixed[3] / norm)
