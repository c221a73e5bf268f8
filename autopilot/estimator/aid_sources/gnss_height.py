"""Height from GNSS: the reference, or beside another one with its offset estimated (EKF2_HGT_REF).

PX4's EKF2 (EKF/aid_sources/gnss/gnss_height_control.cpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.gnss import DEAD_RECKONING, VPOS, Gnss
from sitl_emu.autopilot.estimator.ekf import GNSS, HEIGHT_FUSION_TIMEOUT_US, UNKNOWN, Ekf
from sitl_emu.autopilot.estimator.resets import initialise_altitude, reset_altitude
from sitl_emu.autopilot.estimator.samples import GnssSample

MAX_INTERVAL_US: Final = 500_000
BIAS_NOISE_M_SQRT_S: Final = 0.13
NOISE_FACTOR: Final = 1.5
"""A typical ratio of vertical to horizontal errors."""


class GnssHeight:
    """Beside `Gnss`, whose samples it takes."""

    def __init__(self, ekf: Ekf, gnss: Gnss) -> None:
        self._ekf, self._gnss = ekf, gnss
        self.aid = AidSource(1)
        self._predicted_us = 0
        self._rejected_us = 0

    def control(self) -> None:
        """One step of the filter."""
        gnss, flags = self._gnss, self._ekf.flags
        if gnss.stopped:
            self.stop()
        elif gnss.ready and gnss.sample is not None:
            self._on_sample(gnss.sample)
        elif flags.gps_hgt and not self._newest_recent():
            self.stop()

    def _newest_recent(self) -> bool:
        return self._ekf.newest_recent(self._gnss.buffer.pushed_us, 2 * MAX_INTERVAL_US)

    def _on_sample(self, sample: GnssSample) -> None:
        ekf, flags, bias = self._ekf, self._ekf.flags, self._ekf.gnss_hgt_bias
        value = ekf.settings
        if flags.gps_hgt and ekf.height_reference != GNSS and self._predicted_us:
            bias.predict(BIAS_NOISE_M_SQRT_S, (ekf.time_us - self._predicted_us) * 1e-6)
        self._predicted_us = ekf.time_us
        noise = max(sample.vacc, NOISE_FACTOR * value["EKF2_GPS_P_NOISE"])
        if not (flags.gps_hgt and ekf.flags.vertical_position_aids() == 1):
            noise = min(noise, value["EKF2_NOAID_NOISE"])
        variance = noise * noise
        _, _, offset = ekf.state.to_earth(*self._gnss.offset(sample))
        height = sample.alt + offset
        gate = max(value["EKF2_GPS_P_GATE"], 1.0)
        ekf.update_height_aid(self.aid, sample.time_us, -(height - bias.bias), variance + bias.variance, gate)
        valid = math.isfinite(height + variance)
        common = valid and ekf.origin is not None and self._gnss.checks.passed and not flags.gnss_fault
        wanted = common and bool(int(value["EKF2_GPS_CTRL"]) & VPOS)
        if flags.gps_hgt:
            if wanted:
                self._continue(height, variance)
            else:
                self.stop()
        elif common:
            self._start(height, variance, wanted=wanted)
        ekf.apply()

    def _continue(self, height: float, variance: float) -> None:
        ekf, aid, bias = self._ekf, self.aid, self._ekf.gnss_hgt_bias
        if ekf.height_reference != GNSS:
            measured = height - ekf.state.alt
            bias.fuse(measured, variance + ekf.variance(cov.HEIGHT), math.sqrt(variance), ekf.dt_s)
        ekf.fuse_vertical_position(aid)
        if ekf.height_reset_required() and ekf.height_reference == GNSS and self._reset_allowed():
            # All height sources are failing.
            ekf.events.add("reset_hgt_to_gps")
            reset_altitude(ekf, height, variance)
            bias.bias = height - ekf.state.alt
            aid.reset(ekf.time_us)
        elif ekf.timed_out(aid.time_last_fuse, HEIGHT_FUSION_TIMEOUT_US):
            self.stop()
            if not self._reset_allowed():
                ekf.flags.gnss_hgt_fault = True
                self._rejected_us = ekf.time_us

    def _start(self, height: float, variance: float, *, wanted: bool) -> None:
        ekf, aid, flags, bias = self._ekf, self.aid, self._ekf.flags, self._ekf.gnss_hgt_bias
        is_reference = int(ekf.settings["EKF2_HGT_REF"]) == GNSS
        recent = self._newest_recent()
        if not math.isfinite(ekf.origin_alt) and is_reference and recent:
            ekf.events.add("reset_hgt_to_gps")
            initialise_altitude(ekf, height, variance)
            bias.reset()
            if wanted:
                ekf.height_reference = GNSS
                aid.reset(ekf.time_us)
                flags.gps_hgt = True
            return
        if not wanted or not recent:
            return
        if flags.gnss_hgt_fault:
            if aid.innovation_rejected:
                self._rejected_us = ekf.time_us
            if not ekf.timed_out(self._rejected_us, HEIGHT_FUSION_TIMEOUT_US):
                return
        if is_reference:
            started = aid.test_ratio[0] < 1.0 and ekf.fuse_vertical_position(aid)
            if not started and self._reset_allowed():
                ekf.events.add("reset_hgt_to_gps")
                reset_altitude(ekf, height, variance)
                bias.reset()
                aid.reset(ekf.time_us)
                started = True
            if not started:
                return
            ekf.height_reference = GNSS
        else:
            bias.bias = height - ekf.state.alt
        aid.time_last_fuse = ekf.time_us
        flags.gps_hgt, flags.gnss_hgt_fault = True, False

    def _reset_allowed(self) -> bool:
        ekf = self._ekf
        others = ekf.flags.vertical_position_aids() > int(ekf.flags.gps_hgt)
        dead_reckoning = int(ekf.settings["EKF2_GPS_MODE"]) == DEAD_RECKONING
        return not (dead_reckoning and others) or not math.isfinite(ekf.origin_alt)

    def stop(self) -> None:
        """Its height is used no more."""
        ekf = self._ekf
        if ekf.flags.gps_hgt:
            if ekf.height_reference == GNSS:
                ekf.height_reference = UNKNOWN
            ekf.flags.gps_hgt = False
            self._predicted_us = 0
