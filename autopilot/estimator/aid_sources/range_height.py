"""Height of the ground from the range finder, and the vehicle's own height where that is wanted.

PX4's EKF2 (EKF/aid_sources/range_finder/range_height_control.cpp and range_height_fusion.cpp, terrain_control.cpp,
v1.18). EKF2_RNG_CTRL 1 lets it aid the height while low and slow, 2 always; as reference (EKF2_HGT_REF 2) heights are
those above the ground.
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.aid_sources.range_finder import MAX_INTERVAL_US, RangeFinder
from sitl_emu.autopilot.estimator.ekf import HEIGHT_FUSION_TIMEOUT_US, RANGE, UNKNOWN, Ekf
from sitl_emu.autopilot.estimator.height_control import refer_heights_to
from sitl_emu.autopilot.estimator.resets import count_terrain_reset, reset_altitude, reset_vertical_velocity_to_zero
from sitl_emu.autopilot.estimator.samples import RangeSample, SampleBuffer
from sitl_emu.autopilot.topics import NAN

SENS_EN: Final = 1 << 9
"""Its bit of EKF2_SENS_EN."""
CONDITIONAL: Final = 1
ENABLED: Final = 2
"""EKF2_RNG_CTRL."""
BEGIN_SHARE: Final = 0.7
"""Of EKF2_RNG_A_HMAX and EKF2_RNG_A_VMAX, below which conditional aiding begins."""
BEGIN_TEST_RATIO: Final = 0.01
LEAST_MOTION_VARIANCE: Final = 0.1
LEAST_RANGE_VARIANCE: Final = 0.001
TERRAIN_TIMEOUT_US: Final = 1_000_000
H_HAGL = np.zeros(cov.STATES)
H_HAGL[cov.HEIGHT], H_HAGL[cov.TERRAIN] = -1.0, 1.0
"""Jacobian of the height above the ground."""


class RangeHeight:
    """Owner of the terrain's state."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[RangeSample] = SampleBuffer(ekf.observation_buffer_length)
        self.sensor = RangeFinder(ekf)
        self.aid = AidSource(1)

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return bool(int(self._ekf.settings["EKF2_RNG_CTRL"])) and bool(self._ekf.sens_en & SENS_EN)

    def control(self, time_us: int) -> None:
        """One step of the filter, at `time_us` of the delayed IMU."""
        ekf, flags = self._ekf, self._ekf.flags
        if not self.buffer.pushed_us:
            return
        sample = self.buffer.pop(time_us)
        self.sensor.look(sample)
        if sample is not None:
            self._prepare()
            flags.rng_kin_consistent = self.sensor.consistency.consistent
            self._on_sample()
            ekf.apply()
        elif (flags.rng_hgt or flags.rng_terrain) and not self._newest_recent():
            self.stop_height()
            flags.rng_terrain = False

    def _newest_recent(self) -> bool:
        return self._ekf.newest_recent(self.buffer.pushed_us, 2 * MAX_INTERVAL_US)

    def _prepare(self) -> None:
        """Correct a good sample for where the sensor sits; on the ground a bad one means the least distance."""
        ekf, flags, sensor, value = self._ekf, self._ekf.flags, self.sensor, self._ekf.settings
        if not sensor.healthy:
            if not flags.in_air and flags.vehicle_at_rest and sensor.regular:
                sensor.sample = sensor.sample._replace(rng=value["EKF2_MIN_RNG"])
                sensor.healthy = True
            return
        _, _, below = ekf.state.to_earth(*ekf.offsets["RNG"])
        if below:
            sensor.sample = sensor.sample._replace(rng=sensor.sample.rng + below / sensor.cos_tilt)
        if flags.in_air:
            state = ekf.state
            uncertain = max(ekf.variance(cov.VELOCITY) + ekf.variance(cov.VELOCITY + 1), LEAST_MOTION_VARIANCE)
            variance = value["EKF2_RNG_NOISE"] ** 2 + (value["EKF2_RNG_SFE"] * sensor.distance_m) ** 2
            sensor.consistency.update(
                ekf.time_us,
                (sensor.distance_m, max(variance, LEAST_RANGE_VARIANCE)),
                (state.vd, ekf.variance(cov.VELOCITY + 2)),
                value["EKF2_RNG_K_GATE"],
                moving=state.vn**2 + state.ve**2 > uncertain,
            )

    def _on_sample(self) -> None:
        ekf, flags, aid, sensor, value = self._ekf, self._ekf.flags, self.aid, self.sensor, self._ekf.settings
        measured = max(sensor.distance_m, value["EKF2_MIN_RNG"])
        noise = value["EKF2_RNG_NOISE"] ** 2 + (value["EKF2_RNG_SFE"] * sensor.sample.rng) ** 2
        variance = ekf.variance(cov.HEIGHT) + noise
        told = ekf.hagl_variance() + variance
        gate = max(value["EKF2_RNG_GATE"], 1.0)
        aid.update(sensor.sample.time_us, (measured,), (variance,), (ekf.hagl_m - measured,), (told,), gate)
        valid = math.isfinite(measured) and math.isfinite(variance)
        if ekf.faults.bad_acc_vertical and aid.innovation_rejected and valid and sensor.healthy:
            aid.clip(0)
        usable = self.intended and flags.tilt_align and valid
        startable = usable and self._newest_recent() and sensor.regular and sensor.healthy
        aids = flags.rng_terrain or flags.rng_hgt
        control = int(value["EKF2_RNG_CTRL"])
        conditional = aids and control == CONDITIONAL and self._low_and_slow()
        always = aids and control == ENABLED
        self._switch_height(conditional=conditional, always=always, startable=startable)
        if flags.rng_hgt or flags.rng_terrain:
            if usable:
                self._continue(conditional=conditional, startable=startable)
            else:
                self.stop_height()
                flags.rng_terrain = False
        elif startable:
            self._start_terrain()

    # --- the vehicle's height ------------------------------------------------------------------------------

    def _switch_height(self, *, conditional: bool, always: bool, startable: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if flags.rng_hgt:
            if not (conditional or always):
                self.stop_height()
            return
        if not startable or not (conditional or always):
            return
        if int(ekf.settings["EKF2_HGT_REF"]) != RANGE:
            flags.rng_hgt = True
            self._fit_terrain()
        elif conditional:
            refer_heights_to(ekf, RANGE)
            flags.rng_hgt, flags.rng_terrain = True, False
            self._fit_terrain()
        else:
            # The ground is where heights count from.
            refer_heights_to(ekf, RANGE)
            ekf.events.add("reset_hgt_to_rng")
            reset_altitude(ekf, aid.observation[0], aid.observation_variance[0])
            ekf.state.terrain = 0.0
            aid.reset(ekf.time_us)
            flags.rng_hgt, flags.rng_terrain = True, False

    def _fit_terrain(self) -> None:
        if not self._ekf.flags.opt_flow_terrain and self.aid.innovation_rejected:
            self._reset_terrain()
            self.aid.reset(self._ekf.time_us)

    def _low_and_slow(self) -> bool:
        """Low and slow enough to aid the height, with hysteresis."""
        ekf, value, ratio = self._ekf, self._ekf.settings, self.aid.test_ratio[0]
        highest, fastest, stable = value["EKF2_RNG_A_HMAX"], value["EKF2_RNG_A_VMAX"], ratio < 1.0
        if not ekf.flags.rng_hgt:
            highest, fastest, stable = BEGIN_SHARE * highest, BEGIN_SHARE * fastest, ratio < BEGIN_TEST_RATIO
        slow = not ekf.flags.horizontal_aiding or math.hypot(ekf.state.vn, ekf.state.ve) <= fastest
        return ekf.hagl_m < highest and stable and slow

    def stop_height(self) -> None:
        """The vehicle's height comes from elsewhere."""
        ekf = self._ekf
        if ekf.flags.rng_hgt:
            if ekf.height_reference == RANGE:
                refer_heights_to(ekf, UNKNOWN)
            ekf.flags.rng_hgt = False

    # --- fusion --------------------------------------------------------------------------------------------

    def _continue(self, *, conditional: bool, startable: bool) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if conditional:
            refer_heights_to(ekf, RANGE)
        elif ekf.height_reference == RANGE:
            refer_heights_to(ekf, UNKNOWN)  # the fallback takes it again where it is EKF2_HGT_REF
        if self.sensor.healthy and flags.rng_kin_consistent:
            self._fuse(height=flags.rng_hgt, terrain=flags.rng_terrain)
        failing = ekf.timed_out(aid.time_last_fuse, HEIGHT_FUSION_TIMEOUT_US)
        if ekf.height_reset_required() and flags.rng_hgt and ekf.height_reference == RANGE and startable:
            # All height sources are failing.
            ekf.events.add("reset_hgt_to_rng")
            reset_altitude(ekf, aid.observation[0] - ekf.state.terrain, NAN)
            aid.reset(ekf.time_us)
            if not ekf.flags.vertical_velocity_aiding:
                reset_vertical_velocity_to_zero(ekf)
        elif failing:
            if flags.opt_flow_terrain and ekf.terrain_valid:
                self.stop_height()
                flags.rng_terrain = False
            elif startable:
                self._reset_terrain()
                aid.reset(ekf.time_us)

    def _start_terrain(self) -> None:
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if flags.opt_flow_terrain:
            if not aid.innovation_rejected:
                flags.rng_terrain = True
                self._fuse(height=flags.rng_hgt, terrain=True)
            return
        if self._ground_is_assumed:
            # Up to the step before; this one has made it uncertain as any.
            ekf.predict_covariance()
            self._ground_is_below()
            ekf.p[cov.TERRAIN, cov.TERRAIN] += ekf.terrain_growth() * ekf.dt_s**2
        if aid.innovation_rejected:
            self._reset_terrain()
            aid.reset(ekf.time_us)
        flags.rng_terrain = True

    def _fuse(self, *, height: bool, terrain: bool) -> None:
        ekf, aid = self._ekf, self.aid
        if aid.innovation_rejected:
            return
        p = ekf.p
        ph = p[cov.TERRAIN] - p[cov.HEIGHT]
        innovation_variance = float(ph[cov.TERRAIN] - ph[cov.HEIGHT]) + aid.observation_variance[0]
        if height and terrain:
            ekf.fuse(ph, aid.innovation[0], innovation_variance)
        elif height:
            gain = ph / innovation_variance
            gain[cov.TERRAIN] = 0.0
            ekf.fuse_by(gain, ph, aid.innovation[0], innovation_variance)
        else:
            gain_terrain = float(ph[cov.TERRAIN]) / innovation_variance
            cov.update_one(p, cov.TERRAIN, gain_terrain, ph, innovation_variance)
            ekf.state.terrain -= gain_terrain * aid.innovation[0]
        aid.fused, aid.time_last_fuse = True, ekf.time_us
        if terrain:
            ekf.terrain_fused_us = ekf.time_us

    def _reset_terrain(self) -> None:
        """The ground is where it was measured, as uncertain as the vehicle's own height."""
        ekf, aid = self._ekf, self.aid
        ekf.predict_covariance()
        before = ekf.state.terrain
        cov.uncorrelate(ekf.p, cov.TERRAIN, (0.0,))
        gain = np.zeros(cov.STATES)
        gain[cov.TERRAIN] = 1.0
        ph, innovation_variance = ekf.innovation_variance(H_HAGL, aid.observation_variance[0])
        ekf.fuse_by(gain, ph, aid.innovation[0], innovation_variance)
        count_terrain_reset(ekf, ekf.state.terrain - before)
        aid.time_last_fuse = ekf.time_us

    # --- the terrain without it ----------------------------------------------------------------------------

    def control_terrain(self) -> None:
        """On the ground, and at take-off, the ground is right below; nothing else is known without the sensor."""
        ekf, flags = self._ekf, self._ekf.flags
        if flags.in_air:
            if not ekf.was_in_air:
                ekf.predict_covariance()
                self._ground_is_below()
            return
        flags.rng_fault = False
        if self._ground_is_assumed:
            self._ground_is_below()

    @property
    def _ground_is_assumed(self) -> bool:
        """On the ground, and nothing has measured where that is."""
        ekf, flags = self._ekf, self._ekf.flags
        measured = flags.rng_terrain or flags.opt_flow_terrain
        unknown = not measured and ekf.timed_out(ekf.terrain_fused_us, TERRAIN_TIMEOUT_US)
        return unknown and not flags.in_air and ekf.height_reference != RANGE

    def _ground_is_below(self) -> None:
        ekf = self._ekf
        clearance_m = ekf.settings["EKF2_MIN_RNG"]
        ekf.state.terrain = clearance_m - ekf.state.alt
        cov.uncorrelate(ekf.p, cov.TERRAIN, (clearance_m**2,))

    def update_terrain_validity(self, flow_fused_us: int) -> None:
        """Is the height above the ground worth telling? `flow_fused_us`: when optical flow was last fused."""
        ekf, flags = self._ekf, self._ekf.flags
        flow = flags.opt_flow_terrain and ekf.recent(flow_fused_us, HEIGHT_FUSION_TIMEOUT_US)
        ranged = flags.rng_terrain and ekf.recent(self.aid.time_last_fuse, HEIGHT_FUSION_TIMEOUT_US)
        hagl_m = ekf.hagl_m
        known = certain = False
        if ekf.terrain_fused_us:
            variance = ekf.hagl_variance()
            known = variance > 0.0
            certain = known and variance < max(0.1 * hagl_m, 0.5) ** 2
        above = hagl_m >= 0.0 and known
        ekf.terrain_valid = above and (certain if ekf.terrain_valid else ranged or (flow and certain))
