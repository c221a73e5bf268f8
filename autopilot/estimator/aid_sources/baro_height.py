"""Height from the barometer: the reference, or beside another one with its offset estimated (EKF2_HGT_REF).

PX4's EKF2 (EKF/aid_sources/barometer/baro_height_control.cpp, v1.18). The pressure error of airflow (EKF2_PCOEF_*) acts
while wind is estimated, as there.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import BARO, HEIGHT_FUSION_TIMEOUT_US, SENSOR_WEIGHT, UNKNOWN, Ekf
from sitl_emu.autopilot.estimator.resets import initialise_altitude, reset_altitude, reset_vertical_velocity_to_zero
from sitl_emu.autopilot.estimator.samples import BaroSample, SampleBuffer

SENS_EN: Final = 1 << 8
"""Its bit of EKF2_SENS_EN."""
MAX_INTERVAL_US: Final = 200_000
BIAS_NOISE_M_SQRT_S: Final = 0.13
GRAVITY_M_S2: Final = 9.80665
GROUND_EFFECT_TIMEOUT_US: Final = 10_000_000


class BaroHeight:
    """Pressure altitudes."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[BaroSample] = SampleBuffer(ekf.observation_buffer_length)
        self.aid = AidSource(1)
        self._count = 0
        self._mean_m = 0.0
        self._predicted_us = 0
        self.ground_effect_us = 0
        """When ground effect was last expected."""

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return bool(int(self._ekf.settings["EKF2_BARO_CTRL"])) and bool(self._ekf.sens_en & SENS_EN)

    def control(self, time_us: int) -> None:
        """One step of the filter, at `time_us` of the delayed IMU."""
        self.update_ground_effect()
        sample = self.buffer.pop(time_us)
        if sample is not None:
            self._on_sample(sample)
        elif self._ekf.flags.baro_hgt and not self._newest_recent():
            self.stop()

    def _newest_recent(self) -> bool:
        return self._ekf.newest_recent(self.buffer.pushed_us, 2 * MAX_INTERVAL_US)

    def update_ground_effect(self) -> None:
        """It is where the ground is near, if its height is known; else for a while after it was told to be."""
        ekf, flags = self._ekf, self._ekf.flags
        if not flags.in_air:
            flags.gnd_effect = False
        elif ekf.hagl_valid:
            flags.gnd_effect = ekf.hagl_m < ekf.settings["EKF2_GND_MAX_HGT"]
        elif flags.gnd_effect and ekf.timed_out(self.ground_effect_us, GROUND_EFFECT_TIMEOUT_US):
            flags.gnd_effect = False

    def _on_sample(self, sample: BaroSample) -> None:
        ekf, flags, aid, bias = self._ekf, self._ekf.flags, self.aid, self._ekf.baro_bias
        value = ekf.settings
        other = flags.baro_hgt and ekf.height_reference != BARO
        if other and self._predicted_us:
            bias.predict(BIAS_NOISE_M_SQRT_S, (ekf.time_us - self._predicted_us) * 1e-6)
        self._predicted_us = ekf.time_us
        height = sample.hgt + self._pressure_error_m()
        variance = value["EKF2_BARO_NOISE"] ** 2
        valid = math.isfinite(height + variance)
        if valid:
            self._average(height, begins=sample.reset)
            if self._count <= ekf.observation_buffer_length:
                bias.bias = self._mean_m - ekf.state.alt
        gate = max(value["EKF2_BARO_GATE"], 1.0)
        ekf.update_height_aid(aid, sample.time_us, -(height - bias.bias), variance + bias.variance, gate)
        dead_zone = value["EKF2_GND_EFF_DZ"]
        if flags.gnd_effect and dead_zone > 0.0 and aid.innovation[0] < 0.0:
            # Rotor wash on the ground raises the pressure: an innovation up to that is no innovation.
            aid.innovation[0] = min(aid.innovation[0] + dead_zone, 0.0)
        if valid and other:
            measured = height - ekf.state.alt
            bias.fuse(measured, variance + ekf.variance(cov.HEIGHT), math.sqrt(variance), ekf.dt_s)
        usable = self.intended and valid and self._count > ekf.observation_buffer_length and not flags.baro_fault
        if flags.baro_hgt:
            if usable:
                self._continue(variance)
            else:
                self.stop()
        elif usable and self._newest_recent():
            self._start(height, variance)
        ekf.apply()

    def _average(self, height: float, *, begins: bool) -> None:
        if not self._count or begins:
            self._mean_m, self._count = height, 1
            self._ekf.flags.baro_fault = False
        else:
            self._mean_m += SENSOR_WEIGHT * (height - self._mean_m)
            self._count += 1

    def _continue(self, variance: float) -> None:
        ekf, aid, bias = self._ekf, self.aid, self._ekf.baro_bias
        ekf.fuse_vertical_position(aid)
        if ekf.height_reset_required() and ekf.height_reference == BARO:
            # All height sources are failing.
            ekf.events.add("reset_hgt_to_baro")
            reset_altitude(ekf, self._mean_m - bias.bias, variance)
            bias.bias = self._mean_m - ekf.state.alt
            aid.reset(ekf.time_us)
            if not ekf.flags.vertical_velocity_aiding:
                reset_vertical_velocity_to_zero(ekf)
        elif ekf.timed_out(aid.time_last_fuse, HEIGHT_FUSION_TIMEOUT_US):
            self.stop()
            if ekf.recent(ekf.hgt_fused_us, HEIGHT_FUSION_TIMEOUT_US):
                ekf.flags.baro_fault = True

    def _start(self, height: float, variance: float) -> None:
        ekf, aid, bias = self._ekf, self.aid, self._ekf.baro_bias
        if int(ekf.settings["EKF2_HGT_REF"]) == BARO:
            ekf.height_reference = BARO
            ekf.events.add("reset_hgt_to_baro")
            initialise_altitude(ekf, height, variance)
            bias.reset()
            aid.reset(ekf.time_us)
        else:
            bias.bias = self._mean_m - ekf.state.alt
        aid.time_last_fuse = ekf.time_us
        ekf.flags.baro_hgt = True

    def _pressure_error_m(self) -> float:
        """What the airflow adds to the static pressure, as height."""
        ekf, value = self._ekf, self._ekf.settings
        if not ekf.flags.wind or not ekf.local_horizontal_valid:
            return 0.0
        state = ekf.state
        x, y, z = state.to_body(state.vn - state.wind[0], state.ve - state.wind[1], state.vd)
        largest = value["EKF2_ASPD_MAX"] ** 2
        along = value["EKF2_PCOEF_XP"] if x >= 0.0 else value["EKF2_PCOEF_XN"]
        across = value["EKF2_PCOEF_YP"] if y >= 0.0 else value["EKF2_PCOEF_YN"]
        error = along * min(x * x, largest) + across * min(y * y, largest)
        error += value["EKF2_PCOEF_Z"] * min(z * z, largest)
        return 0.5 * error / GRAVITY_M_S2

    def stop(self) -> None:
        """Its height is used no more."""
        ekf = self._ekf
        if ekf.flags.baro_hgt:
            if ekf.height_reference == BARO:
                ekf.height_reference = UNKNOWN
            ekf.flags.baro_hgt = False
            self._predicted_us = 0
