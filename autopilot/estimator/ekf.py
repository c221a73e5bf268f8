"""The filter itself: state and covariance at the fusion horizon, and how measurements get in.

PX4's EKF2 (src/modules/ekf2/EKF: ekf.cpp, ekf_helper.cpp, position_fusion.cpp, velocity_fusion.cpp, yaw_fusion.cpp,
covariance.cpp, v1.18). What aids it, and when, is in aid_sources/, a file each; how the state is set anew, in
resets.py. Numbers are PX4's unless said otherwise.
"""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.bias_estimator import POSITION_VARIANCE, BiasEstimator
from sitl_emu.autopilot.estimator.flags import ControlStatus, FaultStatus
from sitl_emu.autopilot.estimator.imu_down_sampler import ImuDownSampler
from sitl_emu.autopilot.estimator.output_predictor import OutputPredictor
from sitl_emu.autopilot.estimator.samples import SENSOR_POSITION, ImuSample
from sitl_emu.autopilot.estimator.state import LARGEST_VELOCITY_M_S, Resets, State, shortest_turn_to_level
from sitl_emu.autopilot.topics import NAN, Quaternion, Vector3
from sitl_emu.core.geodesy import MapProjection

RESET_TIMEOUT_US: Final = 7_000_000
NO_AID_TIMEOUT_US: Final = 1_000_000
HEIGHT_FUSION_TIMEOUT_US: Final = 5_000_000
BAD_ACCEL_RESET_US: Final = 500_000
BAD_ACCEL_NOISE_M_S2: Final = 4.9
GYRO_BIAS: Final = 1
ACCEL_BIAS: Final = 2
GRAVITY_VECTOR: Final = 4
"""Bits of EKF2_IMU_CTRL."""
SENSOR_WEIGHT: Final = 0.1
"""Of a new sample in PX4's sensor low-passes: 0.01 s over 0.01 + 0.09 s, whatever the sample's interval."""
ALIGNED_WITH_GRAVITY: Final = 0.966
COVARIANCE_STEPS: Final = 8
"""The covariance is predicted after so many steps, of 8 ms (ours; PX4 predicts at each), and when the state is set."""
OPTIMAL_WITHIN: Final = 1e-6
INITIAL_WIND_VARIANCE: Final = 1.0
WIND_NOISE_WITH_CLIMB: Final = 0.5
CLIMB_RATE_S: Final = 10.0
BARO: Final = 0
GNSS: Final = 1
RANGE: Final = 2
EV: Final = 3
UNKNOWN: Final = 4
"""EKF2_HGT_REF."""


class Ekf:
    """`state` and `p` at `time_us`, the fusion horizon; `latest_us` is the present. Times in µs; 0: never."""

    def __init__(self, settings: Mapping[str, float]) -> None:
        """`settings`: values of parameters by name; buffers get their length now, as in PX4 at boot."""
        self.settings = settings
        self.state = State()
        self.p = np.zeros((cov.STATES, cov.STATES))
        self._variances = cov.variances(self.p)
        self._transition = cov.transition()
        self._growth, self._caps = np.zeros(cov.STATES), np.zeros(cov.STATES)
        self.imu_position: Vector3 = (0.0, 0.0, 0.0)
        self.offsets: dict[str, Vector3] = {}
        """Sensors (SENSOR_POSITION) as seen from the IMU, in the body's axes (m)."""
        self.refresh()
        self._correction = np.zeros(cov.STATES)
        self._corrected = False
        self.flags = ControlStatus()
        self.was_in_air, self.was_at_rest = True, False
        self.was_yaw_aligned = self.was_ev_yaw = False
        """Flags at the step before; those of the line above when the aids were last looked after."""
        self.faults = FaultStatus()
        self.events: set[str] = set()
        """What happened since somebody told it, by the fields of uORB estimator_event_flags."""
        self.resets = Resets()
        self.down_sampler = ImuDownSampler(settings["EKF2_PREDICT_US"])
        step_ms = max(settings["EKF2_PREDICT_US"] * 1e-3, 1.0)
        delay_ms = min(max(settings["EKF2_DELAY_MAX"], 0.0), 1000.0)
        self.imu_buffer_length = max(2, math.ceil(delay_ms / step_ms))
        self.observation_buffer_length = max(2, min(math.floor(delay_ms * 1.5 / step_ms + 0.5), self.imu_buffer_length))
        self.output = OutputPredictor(self.imu_buffer_length)
        self.initialised = False
        self.time_us = self.latest_us = 0
        self.dt_s = step_ms * 1e-3
        """Mean step of the filter."""
        self.accel_mean: Vector3 | None = None
        self._gyro_mean: Vector3 = (0.0, 0.0, 0.0)
        self._rate_peak = self._accel_peak = 0.0
        self.accel_inhibited = [False, False, False]
        self.gyro_inhibited = False
        self._climb_rate = 0.0
        self.origin: MapProjection | None = None
        self.origin_us = 0
        self.origin_alt = NAN
        self.last_known_position = (0.0, 0.0)
        self.last_known_alt = 0.0
        self.hor_pos_fused_us = self.hgt_fused_us = self.hor_vel_fused_us = self.ver_vel_fused_us = 0
        self.heading_fused_us = self.terrain_fused_us = 0
        self.in_air_us = self.on_ground_us = 0
        self.good_vertical_accel_us = self.bad_vertical_accel_us = 0
        self.horizontal_dead_reckoning_too_long = True
        self.vertical_position_dead_reckoning_too_long = True
        self.vertical_velocity_dead_reckoning_too_long = True
        self.terrain_valid = False
        self.height_reference = UNKNOWN
        self.counts = (0,) * 6
        """Counters of resets at the beginning of this step: several resets in it tell one change."""
        self.ne_vision_pos = self.ne_vision_vel = False
        """Vision's position gives north, and so does its velocity: each in NED."""
        self.baro_bias, self.gnss_hgt_bias, self.ev_hgt_bias = BiasEstimator(), BiasEstimator(), BiasEstimator()
        self.ev_pos_bias = (BiasEstimator(POSITION_VARIANCE), BiasEstimator(POSITION_VARIANCE))
        self.on_yaw_change: Quaternion | None = None
        self.sens_en = 0
        """Sensors that are on, by the bits of EKF2_SENS_EN; MAV_CMD_ESTIMATOR_SENSOR_ENABLE switches them."""

    # --- time ----------------------------------------------------------------------------------------------

    def timed_out(self, since_us: int, period_us: float) -> bool:
        """At the horizon, `since_us` is longer ago than that, or was never."""
        return since_us == 0 or since_us + period_us < self.time_us

    def recent(self, since_us: int, period_us: float) -> bool:
        """At the horizon, `since_us` is not that long ago."""
        return since_us != 0 and since_us + period_us > self.time_us

    def newest_recent(self, pushed_us: int, period_us: float) -> bool:
        """At present, a sample came in not that long ago."""
        return pushed_us != 0 and pushed_us + period_us > self.latest_us

    # --- prediction ----------------------------------------------------------------------------------------

    def begin_step(self, imu: ImuSample) -> bool:
        """Take the delayed sample and predict the state; False before the tilt is known."""
        dt = imu.dt_s
        predict_s = self.settings["EKF2_PREDICT_US"] * 1e-6
        if self.accel_mean is None:
            self.dt_s = min(max(dt, 0.5 * predict_s), 2.0 * predict_s)
        else:
            self.dt_s += 0.01 * (min(max(dt, 0.5 * predict_s), 2.0 * predict_s) - self.dt_s)
        self.time_us = imu.time_us
        self._filter_imu(imu)
        if not self.initialised and not self._initialise_tilt():
            return False
        self.was_yaw_aligned, self.was_ev_yaw = self.flags.yaw_align, self.flags.ev_yaw
        resets = self.resets
        self.counts = (resets.vel_ne, resets.vel_d, resets.pos_ne, resets.pos_d, resets.quat, resets.hagl)
        self._inhibit_biases(imu)
        self.state.predict(imu, min(LARGEST_VELOCITY_M_S, abs(self.settings["EKF2_VEL_LIM"])))
        if self.state.steps >= COVARIANCE_STEPS:
            self.predict_covariance()
        return True

    def refresh(self) -> None:
        """Take over changed parameters: where sensors sit, what a second of unit steps adds to variances, and up to
        which these grow."""
        value = self.settings

        def square(name: str) -> float:
            return min(max(value[name], 0.0), 1.0) ** 2

        self.imu_position = x, y, z = self._position_of("IMU")
        for sensor in SENSOR_POSITION:
            sx, sy, sz = self._position_of(sensor)
            self.offsets[sensor] = (sx - x, sy - y, sz - z)
        gyro, accel, field = square("EKF2_GYR_NOISE"), square("EKF2_ACC_NOISE"), value["EKF2_MAG_NOISE"] ** 2
        self._growth = np.array(
            [gyro] * 3 + [accel] * 3 + [0.0] * 3 + [square("EKF2_GYR_B_NOISE")] * 3 + [square("EKF2_ACC_B_NOISE")] * 3
            + [square("EKF2_MAG_E_NOISE")] * 3 + [square("EKF2_MAG_B_NOISE")] * 3 + [0.0] * 3
        )  # fmt: skip
        self._caps = np.array(
            [math.inf] * 9 + [gyro] * 3 + [accel] * 3 + [field] * 6 + [INITIAL_WIND_VARIANCE] * 2 + [math.inf]
        )

    def _position_of(self, sensor: str) -> Vector3:
        """Where a sensor sits in the body."""
        x, y, z = (self.settings[name] for name in SENSOR_POSITION[sensor])
        return x, y, z

    def _filter_imu(self, imu: ImuSample) -> None:
        """Low-passes of accelerometer and, until the tilt is known, gyro."""
        _, (gx, gy, gz), (vx, vy, vz), dt = imu
        ax, ay, az = vx / dt, vy / dt, vz / dt
        if self.accel_mean is None:
            self.accel_mean, self._gyro_mean = (ax, ay, az), (gx / dt, gy / dt, gz / dt)
            return
        mx, my, mz = self.accel_mean
        weight = SENSOR_WEIGHT
        self.accel_mean = (mx + weight * (ax - mx), my + weight * (ay - my), mz + weight * (az - mz))
        if not self.initialised:
            mx, my, mz = self._gyro_mean
            self._gyro_mean = (mx + weight * (gx / dt - mx), my + weight * (gy / dt - my), mz + weight * (gz / dt - mz))

    def _initialise_tilt(self) -> bool:
        """Roll and pitch from where gravity seems to be, once the vehicle is quiet."""
        accel = self.accel_mean
        assert accel is not None
        gravity = math.hypot(*accel)
        quiet = math.hypot(*self._gyro_mean) <= math.radians(15.0)
        if not (0.8 * 9.80665 <= gravity <= 1.2 * 9.80665 and quiet):
            return False
        self.initialised = True
        self.state.set_attitude(shortest_turn_to_level(accel))
        self._initialise_covariance()
        self.output.align(self.state.q, (0.0, 0.0, 0.0), self._position())
        return True

    def _initialise_covariance(self) -> None:
        value = self.settings
        self.p[:] = 0.0
        tilt = max(value["EKF2_ANGERR_INIT"], 0.01) ** 2
        velocity = max(value["EKF2_GPS_V_NOISE"], 0.01) ** 2
        position = max(value["EKF2_GPS_P_NOISE"], 0.01) ** 2
        height = max(value["EKF2_BARO_NOISE"], 0.01) ** 2
        if self.flags.gps_hgt:
            height = max(1.5 * value["EKF2_GPS_P_NOISE"], 0.01) ** 2
        if self.flags.rng_hgt:
            height = max(value["EKF2_RNG_NOISE"], 0.01) ** 2
        gyro_bias, accel_bias = value["EKF2_GBIAS_INIT"] ** 2, value["EKF2_ABIAS_INIT"] ** 2
        field = value["EKF2_MAG_NOISE"] ** 2
        diagonal = [tilt, tilt, 0.0, velocity, velocity, 2.25 * velocity, position, position, height]
        diagonal += [gyro_bias] * 3 + [accel_bias] * 3 + [field] * 6 + [INITIAL_WIND_VARIANCE] * 2
        diagonal.append(value["EKF2_MIN_RNG"] ** 2)
        np.fill_diagonal(self.p, diagonal)
        self.state.restart_sums()

    def predict_covariance(self) -> None:
        """The covariance up to the horizon, from what the state has summed up."""
        state = self.state
        if not state.steps:
            return
        p, total_s = self.p, state.dt_s
        cov.predict(p, self._transition, state.rotation, (state.dvn, state.dve, state.dvd), total_s)
        # Every step adds the square of noise times step.
        spread = total_s * total_s / state.steps
        diagonal = self._variances
        diagonal += self._growth * spread * (diagonal < self._caps)
        if self.faults.bad_acc_vertical:
            diagonal[cov.VELOCITY : cov.POSITION] += BAD_ACCEL_NOISE_M_S2**2 * spread
        if self.height_reference != RANGE:
            diagonal[cov.TERRAIN] += self.terrain_growth() * spread
        if self.flags.wind:
            self._predict_wind(diagonal)
        state.restart_sums()
        self._constrain_variances()
        for index in cov.too_large(p):
            # Clipped, it would be correlated too much with the others: PX4 fuses that nothing was found, a little.
            own = self.variance(index)
            self.fuse_state(index, 0.0, 11.0 * own, 10.0 * own)

    def terrain_growth(self) -> float:
        """What a step of one second adds to the variance of the ground's height."""
        value, state = self.settings, self.state
        return value["EKF2_TERR_NOISE"] ** 2 + value["EKF2_TERR_GRAD"] ** 2 * (state.vn**2 + state.ve**2)

    def _predict_wind(self, diagonal: cov.Matrix) -> None:
        noise = self._wind_noise() * self.state.dt_s
        wind = diagonal[cov.WIND : cov.TERRAIN]
        wind += noise * (wind < INITIAL_WIND_VARIANCE)

    def _wind_noise(self) -> float:
        """Variance that wind gains a second; more while climbing. Its low-pass is fed here, not at every step."""
        dt_s = self.state.dt_s
        self._climb_rate += dt_s / (dt_s + CLIMB_RATE_S) * (self.state.vd - self._climb_rate)
        density = min(max(self.settings["EKF2_WIND_NSD"], 0.0), 1.0)
        return (density * (1.0 + WIND_NOISE_WITH_CLIMB * abs(self._climb_rate))) ** 2

    def _constrain_variances(self) -> None:
        cov.raise_to_floor(self._variances, mag=self.flags.mag, wind=self.flags.wind)
        if not self.flags.heading_observable:
            heading = min(float(self.p[cov.YAW, cov.YAW]), self.settings["EKF2_HEAD_NOISE"] ** 2)
            cov.uncorrelate(self.p, cov.YAW, (heading,))

    def _inhibit_biases(self, imu: ImuSample) -> None:
        """Which biases may not be learnt: those that this motion does not show."""
        value, dt, flags, state = self.settings, imu.dt_s, self.flags, self.state
        control = int(value["EKF2_IMU_CTRL"])
        keep = 1.0 - min(max(dt / max(value["EKF2_ABL_TAU"], 1e-6), 0.0), 1.0)
        x, y, z = imu.delta_angle
        bx, by, bz = state.gyro_bias
        x, y, z = x / dt - bx, y / dt - by, z / dt - bz
        self._rate_peak = max(math.sqrt(x * x + y * y + z * z), keep * self._rate_peak)
        x, y, z = imu.delta_velocity
        bx, by, bz = state.accel_bias
        x, y, z = x / dt - bx, y / dt - by, z / dt - bz
        self._accel_peak = max(math.sqrt(x * x + y * y + z * z), keep * self._accel_peak)
        wild = self._rate_peak > value["EKF2_ABL_GYRLIM"] or self._accel_peak > value["EKF2_ABL_ACCLIM"]
        self.gyro_inhibited = not control & GYRO_BIAS
        if not control & ACCEL_BIAS or wild or self.faults.bad_acc_vertical:
            self.accel_inhibited = [True, True, True]
        elif flags.vehicle_at_rest:
            self.accel_inhibited = [False, False, False]
        elif flags.fake_hgt:
            self.accel_inhibited = [True, True, True]
        elif flags.fake_pos or flags.gravity_vector:
            self.accel_inhibited = [abs(part) <= ALIGNED_WITH_GRAVITY for part in state.rotation[6:9]]
        else:
            self.accel_inhibited = [False, False, False]

    # --- fusion --------------------------------------------------------------------------------------------

    def fuse_state(self, index: int, innovation: float, innovation_variance: float, variance: float) -> None:
        """Fuse a direct measurement of state `index`. The correction waits for `apply`: one sensor, one correction."""
        p = self.p
        row = p[index].copy()
        own = float(row[index]) + variance
        if not 0.0 < own < math.inf or not 0.0 < innovation_variance < math.inf:
            self._start_covariance_anew()
            return
        gain = row / innovation_variance
        if self._inhibit(gain) or abs(own - innovation_variance) > OPTIMAL_WITHIN * own:
            cov.update(p, gain, row, own)
        else:
            cov.update_optimal(p, gain, row)
        self._correction -= gain * innovation
        self._corrected = True

    def fuse(self, ph: cov.Matrix, innovation: float, innovation_variance: float) -> None:
        """Fuse a measurement, given its P·H and H·P·H + R (`innovation_variance`), and correct the state."""
        if not 0.0 < innovation_variance < math.inf:
            self._start_covariance_anew()
            return
        gain = ph / innovation_variance
        if self._inhibit(gain):
            cov.update(self.p, gain, ph, innovation_variance)
        else:
            cov.update_optimal(self.p, gain, ph)
        self._correct(gain * -innovation)

    def fuse_by(self, gain: cov.Matrix, ph: cov.Matrix, innovation: float, innovation_variance: float) -> None:
        """The same by another gain than Kalman's, which is P·H / innovation variance."""
        if not 0.0 < innovation_variance < math.inf:
            self._start_covariance_anew()
            return
        self._inhibit(gain)
        cov.update(self.p, gain, ph, innovation_variance)
        self._correct(gain * -innovation)

    def correct(self, gain: cov.Matrix, innovation: float) -> None:
        """Correct the state alone, and leave the covariance."""
        self._inhibit(gain)
        self._correct(gain * -innovation)

    def innovation_variance(self, h: cov.Matrix, variance: float) -> tuple[cov.Matrix, float]:
        """(P·H, H·P·H + R) of a measurement."""
        ph = self.p @ h
        return ph, float(ph @ h) + variance

    def apply(self) -> None:
        """Put what was fused into the state."""
        if self._corrected:
            correction = self._correction
            self._correction, self._corrected = np.zeros(cov.STATES), False
            self._correct(correction)

    def _correct(self, correction: cov.Matrix) -> None:
        values = correction.tolist()
        if not math.isfinite(sum(values)):
            self._start_covariance_anew()
            return
        self._constrain_variances()
        value, flags = self.settings, self.flags
        limits = abs(value["EKF2_GYR_B_LIM"]), abs(value["EKF2_ABL_LIM"])
        self.state.correct(values, *limits, mag=flags.mag, wind=flags.wind)

    def _start_covariance_anew(self) -> None:
        """It can't be computed with any more: what is known of the state is that it is uncertain."""
        self._correction, self._corrected = np.zeros(cov.STATES), False
        self._initialise_covariance()

    def _inhibit(self, gain: cov.Matrix) -> bool:
        """Zero the gains of what may not be corrected; True: something was."""
        flags, changed = self.flags, False
        if not flags.heading_observable:
            gain[cov.YAW] = 0.0
            changed = True
        if self.gyro_inhibited:
            gain[cov.GYRO_BIAS : cov.ACCEL_BIAS] = 0.0
            changed = True
        if True in self.accel_inhibited:
            changed = True
            for axis, inhibited in enumerate(self.accel_inhibited, cov.ACCEL_BIAS):
                if inhibited:
                    gain[axis] = 0.0
        if not flags.mag:
            gain[cov.MAG_I : cov.WIND] = 0.0
            changed = True
        return changed

    def variance(self, index: int) -> float:
        """Of one state."""
        return float(self.p[index, index])

    def tilt_variance(self) -> float:
        """Roll's and pitch's together, rad²."""
        return float(self.p[0, 0]) + float(self.p[1, 1])

    def fuse_velocity(self, aid: AidSource) -> bool:
        """North and east, and down where it is told, unless one was rejected."""
        if aid.innovation_rejected:
            return False
        self._fuse_axes(cov.VELOCITY, aid)
        self.hor_vel_fused_us = self.time_us
        if len(aid.innovation) == 3:
            self.ver_vel_fused_us = self.time_us
        return True

    def fuse_horizontal_position(self, aid: AidSource) -> bool:
        """North and east, unless one was rejected."""
        if aid.innovation_rejected:
            return False
        self._fuse_axes(cov.POSITION, aid)
        self.hor_pos_fused_us = self.time_us
        return True

    def fuse_vertical_position(self, aid: AidSource) -> bool:
        """Down, unless it was rejected."""
        if aid.innovation_rejected:
            return False
        self._fuse_axes(cov.HEIGHT, aid)
        self.hgt_fused_us = self.time_us
        return True

    def _fuse_axes(self, first: int, aid: AidSource) -> None:
        measured = zip(aid.innovation, aid.innovation_variance, aid.observation_variance, strict=True)
        for index, (innovation, innovation_variance, variance) in enumerate(measured, first):
            self.fuse_state(index, innovation, innovation_variance, variance)
        aid.fused, aid.time_last_fuse = True, self.time_us

    def update_height_aid(self, aid: AidSource, time_us: int, down_m: float, variance: float, gate: float) -> None:
        """A sample of the vertical position, with zero at sea level. Bad accelerometers make it be taken anyway."""
        innovation = -self.state.alt - down_m
        aid.update(time_us, (down_m,), (variance,), (innovation,), (self.variance(cov.HEIGHT) + variance,), gate)
        if self.faults.bad_acc_vertical and aid.innovation_rejected:
            aid.clip(0)

    def fuse_yaw(self, aid: AidSource) -> bool:
        """A heading; on the ground a wrong one is drawn near all the same, as it may be due to a wrong gyro bias."""
        h = np.zeros(cov.STATES)
        h[cov.YAW] = 1.0
        ph, innovation_variance = self.innovation_variance(h, aid.observation_variance[0])
        aid.innovation_variance[0] = innovation_variance
        if aid.innovation_rejected:
            on_ground = not self.flags.in_air and self.timed_out(self.in_air_us, 5e6)
            if not on_ground or not self.timed_out(aid.time_last_fuse, 1e6):
                return False
            aid.clip(0)
            self.forget_gyro_bias_z()
        self.fuse(ph, aid.innovation[0], innovation_variance)
        self.heading_fused_us = aid.time_last_fuse = self.time_us
        aid.fused = True
        self.faults.bad_hdg = False
        return True

    def forget_gyro_bias_z(self) -> None:
        """The yaw gyro's bias may be anything again."""
        cov.uncorrelate(self.p, cov.GYRO_BIAS + 2, (self.settings["EKF2_GBIAS_INIT"] ** 2,))

    @property
    def north_east_aiding(self) -> bool:
        """What aids horizontally knows where north is."""
        flags = self.flags
        vision = (self.ne_vision_pos and flags.ev_pos) or (self.ne_vision_vel and flags.ev_vel)
        return flags.gnss_pos or flags.gnss_vel or vision or flags.aux_gpos

    # --- what is known -------------------------------------------------------------------------------------

    @property
    def local_horizontal_valid(self) -> bool:
        """Horizontal position and velocity may be used."""
        return not self.horizontal_dead_reckoning_too_long

    @property
    def local_vertical_valid(self) -> bool:
        """The height may be used."""
        return not self.vertical_position_dead_reckoning_too_long

    @property
    def hagl_m(self) -> float:
        """Height above the ground."""
        return self.state.terrain + self.state.alt

    @property
    def hagl_valid(self) -> bool:
        """The height above the ground may be used."""
        return self.terrain_valid or self.height_reference == RANGE

    def hagl_variance(self) -> float:
        """Of the height above the ground."""
        p = self.p
        return max(
            float(p[cov.TERRAIN, cov.TERRAIN] + p[cov.HEIGHT, cov.HEIGHT] - 2.0 * p[cov.TERRAIN, cov.HEIGHT]), 0.0
        )

    def height_reset_required(self) -> bool:
        """Heights were refused for too long, or the accelerometer was bad for too long."""
        bad_accel = self.timed_out(self.good_vertical_accel_us, BAD_ACCEL_RESET_US)
        return bad_accel or self.timed_out(self.hgt_fused_us, HEIGHT_FUSION_TIMEOUT_US)

    def _position(self) -> Vector3:
        return (self.state.pn, self.state.pe, -self.state.alt)
