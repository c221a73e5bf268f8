"""The estimator: attitude, velocity and position from noisy sensors alone.

An error-state Kalman filter with the behaviour and the parameters of PX4's EKF2 (src/modules/ekf2, v1.18): start at
rest, local origin at the first good GPS fix, GPS position and velocity, height from the source of EKF2_HGT_REF with the
other one's offset estimated, magnetic heading, zero velocity at rest, innovation gates, dead reckoning for
EKF2_NOAID_TOUT after the last horizontal aid, reset when aid comes back and disagrees; poses from outside
(external_vision.py) aid as EKF2_EV_CTRL says, their position only while GPS does not. The state is predicted at every
IMU sample (strapdown.py), the covariance only with each GPS fix, or after 140 ms without one (covariance.py).

Differs from EKF2: the filter runs on the newest sample instead of a delayed one, so sensor delays (EKF2_*_DELAY) do
not act; no magnetic field states, wind, several instances, or GPS heading; optical flow gives a velocity, whose noise
grows with the height.
"""

import math

import numpy as np

from autopilot.estimator import covariance as cov
from autopilot.estimator import external_vision
from autopilot.estimator.alignment import Alignment
from autopilot.estimator.gps_checks import LEAST_FIX, GpsChecks
from autopilot.estimator.height_bias import HeightBias
from autopilot.estimator.imu_filter import LowPass2p, alpha
from autopilot.estimator.strapdown import Strapdown
from autopilot.estimator.terrain import Terrain
from autopilot.parameters import Parameters
from autopilot.topics import (
    NAN,
    EstimatorInnovations,
    EstimatorStatus,
    Innovation,
    SensorGps,
    Topics,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLocalPosition,
)
from sitl_emu.core.geodesy import MapProjection, wrap_pi
from sitl_emu.core.geomagnetism import magnetic_field

IMU_HZ = 250.0
FUSE_EVERY_US = 140_000
"""A little more than the period of PX4's simulated GPS, with whose fixes everything else is fused as well."""
GPS_TIMEOUT_US = 1_000_000
REJECTED_TIMEOUT_US = 5_000_000
SENSOR_TIMEOUT_US = 1_000_000
FUSION_SOURCES = range(9)
"""MAV_CMD_ESTIMATOR_SENSOR_ENABLE, param1: these four; optical flow, vision, auxiliary position, airspeed, beacon."""
FUSION_SOURCE_GPS, FUSION_SOURCE_BARO, FUSION_SOURCE_RNG, FUSION_SOURCE_MAG = 0, 4, 5, 6
HGT_REF_BARO, HGT_REF_VISION = 0, 3
MAG_TYPE_NONE = 5
DECLINATION_BY_PLACE = 1
"""Bit of EKF2_DECL_TYPE; a declination in EKF2_MAG_DECL (PX4 saves one there) goes before."""
LEAST_HORIZONTAL_FIELD_GA = 0.02
ZERO_VELOCITY_VARIANCE = 1e-6
STILL_RAD_S = 0.05
STILL_M_S2 = 0.6
STILL_GPS_M_S = 0.6
FLOW_TILT_COSINE = math.cos(math.radians(45.0))
"""A camera that is tilted more does not see the ground below."""
UINT8_MAX = 255.0
EPH_UNKNOWN_M, EPV_UNKNOWN_M = 1.0, 1.5
SPEED_ACCURACY_M_S = 0.25
"""What PX4's simulator_mavlink says of HIL_GPS's speed accuracy."""
VARIANCE_FLOOR = np.array([1e-9] * 3 + [1e-8] * 3 + [1e-8] * 3 + [1e-14] * 3 + [1e-12] * 3)


class Estimator:
    """Writer of vehicle_angular_velocity (250 Hz), vehicle_attitude and vehicle_local_position (125 Hz, on the ticks of
    position control), vehicle_global_position (62.5 Hz) and estimator_status (with each fusion)."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._state = Strapdown()
        self._alignment = Alignment()
        self._terrain = Terrain()
        self._gps_checks = GpsChecks(parameters)
        self._baro_bias, self._gps_bias = HeightBias(), HeightBias()
        self._aligned = self._yaw_aligned = False
        self._origin: MapProjection | None = None
        self._origin_us = 0
        self._ref_alt_m = NAN
        self._baro_ref_m = NAN
        self._ticks = 0
        self._imu_us = self._baro_us = self._mag_us = self._gps_us = self._range_us = self._fused_us = 0
        self._horizontal_aid_us = self._height_aid_us = 0
        self._horizontal_good_us = self._height_good_us = 0
        self._xy_reset_counter = self._z_reset_counter = 0
        self._ratios = [0.0, 0.0, 0.0, 0.0]
        self._innovations: dict[str, tuple[Innovation, ...]] = {}
        self._gps_fused = self._baro_fused = self._mag_fused = False
        self._flow = topics.vehicle_optical_flow
        self._vision = topics.vehicle_visual_odometry
        self._vision_us = self._flow_fused_us = 0
        self._vision_started = self._vision_yaw = self._vision_height = False
        """Vision has given a position, whether or not there is an origin; the heading; the reference of height."""
        self._vision_resets = 0
        self._vision_bias = HeightBias()
        self._eph = self._epv = self._evh = self._evv = NAN
        self._smooth = [0.0] * 6
        self._rates = self._rates_derivative = (0.0, 0.0, 0.0)
        self._vibration = (0.0, 0.0, 0.0)
        self._last_imu = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._sample_us = -1
        self.disabled: frozenset[int] = frozenset()
        """FUSION_SOURCEs that MAV_CMD_ESTIMATOR_SENSOR_ENABLE has switched off."""
        self._correction = np.zeros(cov.STATES)
        self._transition = np.identity(cov.STATES)
        self._covariance = np.identity(cov.STATES)
        self._gyro_cutoff_hz = 0.0
        self._gyro_filter = LowPass2p(IMU_HZ, self._gyro_cutoff_hz)
        self._version = -1
        self._refresh()

    def _refresh(self) -> None:
        p = {name: float(self._parameters[name]) for name in self._parameters if name.startswith(("EKF2_", "IMU_"))}
        self._version = self._parameters.version
        if p["IMU_GYRO_CUTOFF"] != self._gyro_cutoff_hz:
            self._gyro_cutoff_hz = p["IMU_GYRO_CUTOFF"]
            self._gyro_filter = LowPass2p(IMU_HZ, self._gyro_cutoff_hz)
        self._derivative_alpha = alpha(p["IMU_DGYRO_CUTOFF"], 1.0 / IMU_HZ)
        self._noise = cov.noise_rates(
            p["EKF2_GYR_NOISE"], p["EKF2_ACC_NOISE"], p["EKF2_GYR_B_NOISE"], p["EKF2_ACC_B_NOISE"]
        )
        self._p = p
        if p["EKF2_MAG_DECL"] or self._origin is None:
            self._declination_rad = math.radians(p["EKF2_MAG_DECL"])
        self._height_by_baro = int(p["EKF2_HGT_REF"]) == HGT_REF_BARO
        self._noaid_timeout_us = p["EKF2_NOAID_TOUT"]
        self._gps_control = int(p["EKF2_GPS_CTRL"])
        self._vision_settings = external_vision.settings_of(p)
        self._height_by_vision = int(p["EKF2_HGT_REF"]) == HGT_REF_VISION
        self._range_noise = (
            p["EKF2_RNG_NOISE"],
            p["EKF2_RNG_SFE"],
            p["EKF2_RNG_GATE"],
            p["EKF2_TERR_NOISE"],
            p["EKF2_TERR_GRAD"],
        )

    def update(self, now_us: int) -> None:
        """One IMU sample, and whatever else has come in."""
        topics = self._topics
        imu = topics.sensor_combined
        if imu.timestamp == self._sample_us:
            return  # the IMU is silent
        self._sample_us = imu.timestamp
        gyro, accel = imu.gyro_rad_s, imu.accelerometer_m_s2
        ticks = self._ticks = self._ticks + 1
        if self._parameters.version != self._version:
            self._refresh()
        dt = (now_us - self._imu_us) * 1e-6
        self._imu_us = now_us
        if not 0.0 < dt < 0.04:
            dt = 1.0 / IMU_HZ
        self._publish_rates(now_us, gyro, dt)
        if not self._aligned:
            self._align(now_us)
            self._last_imu = (gyro, accel)
            return
        state = self._state
        state.predict(gyro, accel, dt)
        if (
            topics.sensor_gps.timestamp != self._gps_us
            or now_us - self._fused_us >= FUSE_EVERY_US
            or topics.vehicle_visual_odometry is not self._vision
            or topics.vehicle_optical_flow is not self._flow
        ):
            self._fuse(now_us)
        self._last_imu = (gyro, accel)
        if not ticks & 1:
            self._publish_attitude(now_us)
            self._publish_local_position(now_us)
            if not ticks & 3:
                self._publish_global_position(now_us)

    # --- start ---------------------------------------------------------------------------------------------

    def _align(self, now_us: int) -> None:
        topics = self._topics
        imu = topics.sensor_combined
        self._alignment.on_imu(imu.gyro_rad_s, imu.accelerometer_m_s2)
        mag = topics.sensor_mag
        if mag.timestamp != self._mag_us:
            self._mag_us = mag.timestamp
            self._alignment.on_mag(mag.magnetometer_ga)
        baro = topics.sensor_baro
        heading = self._alignment.heading_ready()
        uses_mag = int(self._p["EKF2_MAG_TYPE"]) != MAG_TYPE_NONE
        height = math.isfinite(baro.baro_alt_m) or not int(self._p["EKF2_BARO_CTRL"])
        if not (self._alignment.tilt_ready() and height and (heading or not uses_mag)):
            return
        self._aligned, self._yaw_aligned = True, heading
        self._state.q = self._alignment.attitude(self._declination_rad)
        self._state.restart_sums()
        self._baro_ref_m, self._baro_us = baro.baro_alt_m, baro.timestamp
        yaw_rad = 0.1 if heading else math.pi
        p = self._p
        self._covariance = cov.initial(
            p["EKF2_ANGERR_INIT"], yaw_rad, 0.5, 0.5, p["EKF2_GBIAS_INIT"], p["EKF2_ABIAS_INIT"]
        )
        self._horizontal_good_us = self._height_good_us = self._height_aid_us = self._fused_us = now_us
        self._horizontal_aid_us = now_us - int(self._noaid_timeout_us) - 1

    def _set_origin(self, now_us: int, gps: SensorGps) -> None:
        """The first good fix is where the vehicle stands: zero, or where vision has counted to, at its height."""
        state, here = self._state, MapProjection(gps.latitude_deg, gps.longitude_deg)
        if self._vision_started:
            here = MapProjection(*here.reproject(-state.pn, -state.pe))
        self._origin, self._origin_us = here, now_us
        self._ref_alt_m = gps.altitude_msl_m + state.pd
        self._gps_bias.reset(0.0)
        self._reset_horizontal(now_us, gps)
        if self._p["EKF2_MAG_DECL"] == 0.0 and int(self._p["EKF2_DECL_TYPE"]) & DECLINATION_BY_PLACE:
            field = magnetic_field(gps.latitude_deg, gps.longitude_deg)
            self._reset_yaw(field.declination_rad - self._declination_rad)
            self._declination_rad = field.declination_rad

    # --- fusion --------------------------------------------------------------------------------------------

    def _fuse(self, now_us: int) -> None:
        """Predict the covariance up to now and fuse what is new."""
        topics, state = self._topics, self._state
        delta_velocity = (state.dvn, state.dve, state.dvd)
        dt_s = state.dt_s
        self._covariance = cov.predict(
            self._covariance, list(state.rotation), delta_velocity, dt_s, self._noise, self._transition
        )
        still = self._at_rest(dt_s)
        if still:
            self._fuse_rest(dt_s)
        state.restart_sums()
        self._fused_us = now_us
        self._fuse_mag(now_us)
        self._fuse_baro(now_us)
        if topics.vehicle_visual_odometry is not self._vision:
            self._vision = topics.vehicle_visual_odometry
            if self._vision_settings.control:
                self._fuse_vision(now_us)
        elif self._vision_us and now_us - self._vision_us > SENSOR_TIMEOUT_US:
            self._vision_us, self._vision_yaw, self._vision_height = 0, False, False
        if topics.vehicle_optical_flow is not self._flow:
            self._flow = topics.vehicle_optical_flow
            if int(self._p["EKF2_OF_CTRL"]):
                self._fuse_flow(now_us)
        gps = topics.sensor_gps
        if gps.timestamp != self._gps_us:
            self._gps_us = gps.timestamp
            self._on_gps(now_us, gps)
        elif now_us - self._gps_us > GPS_TIMEOUT_US:
            self._gps_fused = False
            self._gps_checks.lost()
        if not still and now_us - self._horizontal_good_us > GPS_TIMEOUT_US:
            self._fuse_fake_velocity()
        self._apply()
        self._covariance = cov.symmetric(self._covariance, VARIANCE_FLOOR)
        self._fuse_range(now_us)
        self._publish_status(now_us)

    def _at_rest(self, dt_s: float) -> bool:
        """Disarmed or not yet taken off, landed, and the IMU is quiet."""
        topics, state = self._topics, self._state
        if topics.vehicle_status.armed and topics.vehicle_status.vehicle_type != "multicopter":
            return False
        if not topics.vehicle_land_detected.landed or dt_s <= 0.0:
            return False
        gps = topics.sensor_gps
        if gps.fix_type >= LEAST_FIX and math.hypot(gps.vel_n_m_s, gps.vel_e_m_s) > STILL_GPS_M_S:
            return False
        quiet = STILL_RAD_S * dt_s
        if abs(state.turn_x) > quiet or abs(state.turn_y) > quiet or abs(state.turn_z) > quiet:
            return False
        force = math.hypot(state.dvn, state.dve, state.dvd) / dt_s
        return abs(force - 9.80665) < STILL_M_S2

    def _fuse_rest(self, dt_s: float) -> None:
        """Zero velocity, zero rotation; and before there is a GPS fix, zero motion from where it stands."""
        state, fuse, p = self._state, cov.fuse, self._covariance
        correction = self._correction
        for index, velocity in enumerate((state.vn, state.ve, state.vd), cov.VELOCITY):
            fuse(p, correction, index, -velocity, ZERO_VELOCITY_VARIANCE)
        variance = self._p["EKF2_GYR_NOISE"] ** 2
        turns = (state.turn_x, state.turn_y, state.turn_z)
        for index, (turn, bias) in enumerate(zip(turns, state.gyro_bias, strict=True), cov.GYRO_BIAS):
            fuse(p, correction, index, turn / dt_s - bias, variance)
        if self._origin is None and not self._vision_started:
            fuse(p, correction, cov.POSITION, -state.pn, 0.25)
            fuse(p, correction, cov.POSITION + 1, -state.pe, 0.25)

    def _fuse_fake_velocity(self) -> None:
        """Nothing aids: a very uncertain standstill keeps the tilt from wandering (EKF2's fake position fusion)."""
        state, p = self._state, self._covariance
        variance = self._p["EKF2_NOAID_NOISE"] ** 2
        if self._xy_valid(self._imu_us):
            return
        cov.fuse(p, self._correction, cov.VELOCITY, -state.vn, variance)
        cov.fuse(p, self._correction, cov.VELOCITY + 1, -state.ve, variance)

    def _fuse_mag(self, now_us: int) -> None:
        mag = self._topics.sensor_mag
        if mag.timestamp == self._mag_us:
            self._mag_fused = self._mag_fused and now_us - self._mag_us < SENSOR_TIMEOUT_US
            return
        self._mag_us = mag.timestamp
        if int(self._p["EKF2_MAG_TYPE"]) == MAG_TYPE_NONE or FUSION_SOURCE_MAG in self.disabled:
            self._mag_fused = False
            return
        x, y, z = mag.magnetometer_ga
        r00, r01, r02, r10, r11, r12, _, _, _ = self._state.rotation
        north = r00 * x + r01 * y + r02 * z
        east = r10 * x + r11 * y + r12 * z
        horizontal = math.hypot(north, east)
        if not horizontal > LEAST_HORIZONTAL_FIELD_GA:
            return
        innovation = wrap_pi(self._declination_rad - math.atan2(east, north))
        if not self._yaw_aligned:
            self._reset_yaw(innovation)
            return
        if self._vision_yaw:
            return
        variance = (self._p["EKF2_MAG_NOISE"] / horizontal) ** 2
        self._mag_fused = self._gated(3, ((2, innovation, variance),), self._p["EKF2_HDG_GATE"], "heading")

    def _reset_yaw(self, turn_rad: float) -> None:
        self._yaw_aligned = True
        self._state.correct([0.0, 0.0, turn_rad] + [0.0] * 12, math.inf, math.inf)
        cov.forget(self._covariance, 2, 1, 0.01)

    def _fuse_baro(self, now_us: int) -> None:
        baro, p = self._topics.sensor_baro, self._p
        if baro.timestamp == self._baro_us:
            self._baro_fused = self._baro_fused and now_us - self._baro_us < SENSOR_TIMEOUT_US
            return
        dt_s = min((now_us - self._baro_us) * 1e-6, 1.0)
        self._baro_us = baro.timestamp
        if not int(p["EKF2_BARO_CTRL"]) or not math.isfinite(baro.baro_alt_m) or FUSION_SOURCE_BARO in self.disabled:
            self._baro_fused = False
            return
        height, variance = baro.baro_alt_m - self._baro_ref_m, p["EKF2_BARO_NOISE"] ** 2
        index = cov.POSITION + 2
        reference_is_gps = self._vision_height or (not self._height_by_baro and self._gps_fused)
        if reference_is_gps:
            up_variance = float(self._covariance[index, index])
            self._baro_bias.update(height + self._state.pd, variance + up_variance, dt_s)
        innovation = self._baro_bias.bias_m - height - self._state.pd
        ratio_slot = None if reference_is_gps else 2
        observation = (index, innovation, variance)
        self._baro_fused = self._gated(ratio_slot, (observation,), p["EKF2_BARO_GATE"], "baro_vpos")
        if self._baro_fused:
            self._height_aid_us = now_us
            if not reference_is_gps:
                self._height_good_us = now_us

    def _on_gps(self, now_us: int, gps: SensorGps) -> None:
        self._gps_checks.update(now_us, gps)
        enabled = self._gps_control & 1 and FUSION_SOURCE_GPS not in self.disabled
        usable = gps.fix_type >= LEAST_FIX and enabled and self._yaw_aligned
        if not usable or (not self._gps_fused and not self._gps_checks.passed):
            self._gps_fused = False
            return
        # A correction waiting from rest, mag or baro belongs to the state before a reset.
        self._apply()
        if self._origin is None:
            self._set_origin(now_us, gps)
            self._gps_fused = True
            return
        was_valid = self._xy_valid(now_us)
        self._gps_fused = True
        if not was_valid:
            self._reset_horizontal(now_us, gps)
        else:
            self._fuse_gps_horizontal(now_us, gps)
        self._fuse_gps_height(now_us, gps)

    def _fuse_vision(self, now_us: int) -> None:
        seen = external_vision.observe(self._vision, self._state.rotation, self._vision_settings)
        if seen is None:
            return
        self._vision_us = now_us
        # A correction waiting from rest, mag or baro belongs to the state before a reset.
        self._apply()
        jumped = self._vision.reset_counter != self._vision_resets
        self._vision_resets = self._vision.reset_counter
        if seen.yaw is not None:
            rotation = self._state.rotation
            innovation = wrap_pi(seen.yaw - math.atan2(rotation[3], rotation[0]))
            if jumped or not self._yaw_aligned or not (self._vision_yaw or seen.north_aligned):
                self._reset_yaw(innovation)
            else:
                self._gated(3, ((2, innovation, seen.yaw_variance),), self._p["EKF2_HDG_GATE"])
            self._vision_yaw = True
        if not self._yaw_aligned:
            return
        if seen.horizontal is not None and not self._gps_fused:
            self._fuse_vision_position(now_us, seen.horizontal, seen, jumped=jumped)
        if seen.velocity is not None:
            state = self._state
            measured = zip(seen.velocity, (state.vn, state.ve, state.vd), seen.velocity_variance, strict=True)
            observations = tuple(
                (cov.VELOCITY + axis, told - known, variance) for axis, (told, known, variance) in enumerate(measured)
            )
            if self._gated(0, observations, self._vision_settings.velocity_gate, "ev_vel") and self._xy_started:
                self._horizontal_aid_us = now_us
        if seen.down is not None:
            self._fuse_vision_height(now_us, seen.down, seen.position_variance[2], jumped=jumped)

    def _fuse_flow(self, now_us: int) -> None:
        """Horizontal velocity from the ground's motion and its distance; noise as the quality says."""
        flow, state, p = self._flow, self._state, self._p
        landed = self._topics.vehicle_land_detected.landed
        least = p["EKF2_OF_QMIN_GND"] if landed else p["EKF2_OF_QMIN"]
        tilt_cos = state.rotation[8]
        if (
            flow.quality < least
            or not self._yaw_aligned
            or tilt_cos < FLOW_TILT_COSINE
            or not self._terrain.valid(now_us)
        ):
            return
        distance_m = max(self._terrain.down_m - state.pd, p["EKF2_MIN_RNG"]) / tilt_cos
        forward, right = flow.y * distance_m, -flow.x * distance_m
        if not abs(forward) + abs(right) < external_vision.FASTEST_M_S:
            return
        rotation = state.rotation
        heading = math.hypot(rotation[0], rotation[3]) or 1.0
        cosine, sine = rotation[0] / heading, rotation[3] / heading
        north, east = cosine * forward - sine * right, sine * forward + cosine * right
        share = min(max((flow.quality - least) / max(UINT8_MAX - least, 1.0), 0.0), 1.0)
        self._flow_fused_us = now_us
        noise = p["EKF2_OF_N_MAX"] + (p["EKF2_OF_N_MIN"] - p["EKF2_OF_N_MAX"]) * share
        variance = (noise * distance_m) ** 2
        self._apply()
        if not self._xy_valid(now_us):
            state.vn, state.ve = north, east
            self._smooth[0] = self._smooth[1] = 0.0
            cov.forget(self._covariance, cov.VELOCITY, 2, variance)
            self._vision_started = True
            self._horizontal_aid_us = now_us
            self._xy_reset_counter += 1
            return
        velocity = ((cov.VELOCITY, north - state.vn, variance), (cov.VELOCITY + 1, east - state.ve, variance))
        if self._gated(0, velocity, p["EKF2_OF_GATE"]):
            self._horizontal_aid_us = now_us

    def _fuse_vision_position(
        self, now_us: int, place: tuple[float, float], seen: external_vision.Observation, *, jumped: bool
    ) -> None:
        state = self._state
        variance_n, variance_e, _ = seen.position_variance
        if not jumped and self._xy_valid(now_us):
            position = (
                (cov.POSITION, place[0] - state.pn, variance_n),
                (cov.POSITION + 1, place[1] - state.pe, variance_e),
            )
            if self._gated(1, position, self._vision_settings.position_gate, "ev_hpos"):
                self._horizontal_aid_us = self._horizontal_good_us = now_us
                return
            if now_us - self._horizontal_good_us <= REJECTED_TIMEOUT_US:
                return
        state.pn, state.pe = place
        self._smooth[3] = self._smooth[4] = 0.0
        if seen.velocity is not None:
            state.vn, state.ve = seen.velocity[:2]
            self._smooth[0] = self._smooth[1] = 0.0
            cov.forget(self._covariance, cov.VELOCITY, 2, seen.velocity_variance[0])
        cov.forget(self._covariance, cov.POSITION, 2, max(variance_n, variance_e))
        self._horizontal_aid_us = self._horizontal_good_us = now_us
        self._vision_started = True
        self._xy_reset_counter += 1

    def _fuse_vision_height(self, now_us: int, down_m: float, variance: float, *, jumped: bool) -> None:
        state, index = self._state, cov.POSITION + 2
        if self._height_by_vision:
            if jumped or not self._vision_height or now_us - self._height_good_us > REJECTED_TIMEOUT_US:
                self._vision_height = True
                self._reset_height(now_us, down_m, variance)
            elif self._gated(
                2, ((index, down_m - state.pd, variance),), self._vision_settings.position_gate, "ev_vpos"
            ):
                self._height_aid_us = self._height_good_us = now_us
            return
        if jumped or not self._vision_bias.bias_m:
            self._vision_bias.reset(state.pd - down_m)
        up_variance = float(self._covariance[index, index])
        self._vision_bias.update(state.pd - down_m, variance + up_variance, 0.1)
        innovation = down_m + self._vision_bias.bias_m - state.pd
        if self._gated(None, ((index, innovation, variance),), self._vision_settings.position_gate, "ev_vpos"):
            self._height_aid_us = now_us

    def _gps_position_noise(self, accuracy_m: float) -> float:
        accuracy = accuracy_m if math.isfinite(accuracy_m) else EPH_UNKNOWN_M
        return max(accuracy, self._p["EKF2_GPS_P_NOISE"])

    def _fuse_gps_horizontal(self, now_us: int, gps: SensorGps) -> None:
        assert self._origin is not None
        state, p = self._state, self._p
        speed_noise = max(SPEED_ACCURACY_M_S, p["EKF2_GPS_V_NOISE"])
        good = False
        if self._gps_control & 4:
            variance = speed_noise**2
            velocity = (
                (cov.VELOCITY, gps.vel_n_m_s - state.vn, variance),
                (cov.VELOCITY + 1, gps.vel_e_m_s - state.ve, variance),
                (cov.VELOCITY + 2, gps.vel_d_m_s - state.vd, 2.25 * variance),
            )
            good = self._gated(0, velocity, p["EKF2_GPS_V_GATE"], "gps_vel")
        north, east = self._origin.project(gps.latitude_deg, gps.longitude_deg)
        variance = self._gps_position_noise(gps.eph) ** 2
        position = ((cov.POSITION, north - state.pn, variance), (cov.POSITION + 1, east - state.pe, variance))
        if self._gated(1, position, p["EKF2_GPS_P_GATE"], "gps_hpos"):
            self._horizontal_good_us = self._horizontal_aid_us = now_us
        elif good:
            self._horizontal_aid_us = now_us
        if now_us - self._horizontal_good_us > REJECTED_TIMEOUT_US:
            self._reset_horizontal(now_us, gps)

    def _fuse_gps_height(self, now_us: int, gps: SensorGps) -> None:
        if not self._gps_control & 2:
            return
        state, index = self._state, cov.POSITION + 2
        variance = max(gps.epv if math.isfinite(gps.epv) else EPV_UNKNOWN_M, 1.5 * self._p["EKF2_GPS_P_NOISE"]) ** 2
        height = gps.altitude_msl_m - self._ref_alt_m
        if self._height_by_baro:
            up_variance = float(self._covariance[index, index])
            self._gps_bias.update(height + state.pd, variance + up_variance, 0.1)
        innovation = self._gps_bias.bias_m - height - state.pd
        slot = None if self._height_by_baro else 2
        if self._gated(slot, ((index, innovation, variance),), self._p["EKF2_GPS_P_GATE"], "gps_vpos"):
            self._height_aid_us = self._height_good_us = now_us
        elif now_us - self._height_good_us > REJECTED_TIMEOUT_US:
            self._reset_height(now_us, -height, variance)

    def _gated(
        self,
        ratio_slot: int | None,
        observations: tuple[tuple[int, float, float], ...],
        gate: float,
        field: str = "",
    ) -> bool:
        """Fuse (state, innovation, variance) of one sensor together unless one lies outside the gate (1 σ at least).

        `field` is the name under which estimator_innovations tells them.
        """
        gate = max(gate, 1.0)
        p, correction = self._covariance, self._correction
        told = []
        for index, innovation, variance in observations:
            rest, innovation_variance = innovation - float(correction[index]), float(p[index, index]) + variance
            told.append(Innovation(-rest, innovation_variance, rest * rest / (gate * gate * innovation_variance)))
        ratio = max(each.test_ratio for each in told)
        if field:
            self._innovations[field] = tuple(told)
        if ratio_slot is not None:
            self._ratios[ratio_slot] = math.sqrt(ratio)
        if not ratio <= 1.0:
            return False
        for index, innovation, variance in observations:
            cov.fuse(p, correction, index, innovation, variance)
        return True

    def _apply(self) -> None:
        """Put the collected correction into the state; published velocity and position follow smoothly."""
        values = self._correction.tolist()
        self._correction[:] = 0.0
        self._state.correct(values, self._p["EKF2_GYR_B_LIM"], self._p["EKF2_ABL_LIM"])
        self._smooth = [old - step for old, step in zip(self._smooth, values[3:9], strict=True)]

    def _fuse_range(self, now_us: int) -> None:
        own, state = self._topics.distance_sensor, self._state
        sample = own if own.timestamp else self._topics.distance_sensor_outside
        if sample.timestamp == self._range_us or not int(self._p["EKF2_RNG_CTRL"]):
            return
        self._range_us = sample.timestamp
        if FUSION_SOURCE_RNG in self.disabled:
            return
        speed = math.hypot(state.vn, state.ve)
        tilt_cos = state.rotation[8]
        self._terrain.update(now_us, sample.current_distance, tilt_cos, state.pd, speed, self._range_noise)

    # --- resets --------------------------------------------------------------------------------------------

    def _reset_horizontal(self, now_us: int, gps: SensorGps) -> None:
        """Position and velocity as the receiver says."""
        assert self._origin is not None
        state = self._state
        state.pn, state.pe = self._origin.project(gps.latitude_deg, gps.longitude_deg)
        state.vn, state.ve = gps.vel_n_m_s, gps.vel_e_m_s
        self._smooth[0] = self._smooth[1] = self._smooth[3] = self._smooth[4] = 0.0
        cov.forget(self._covariance, cov.VELOCITY, 2, max(SPEED_ACCURACY_M_S, self._p["EKF2_GPS_V_NOISE"]) ** 2)
        cov.forget(self._covariance, cov.POSITION, 2, self._gps_position_noise(gps.eph) ** 2)
        self._horizontal_aid_us = self._horizontal_good_us = now_us
        self._xy_reset_counter += 1

    def reset_position(self, now_us: int, latitude_deg: float, longitude_deg: float, accuracy_m: float) -> bool:
        """Take over a position from outside; False before there is a local frame."""
        if self._origin is None:
            return False
        self._apply()
        self._state.pn, self._state.pe = self._origin.project(latitude_deg, longitude_deg)
        self._smooth[3] = self._smooth[4] = 0.0
        cov.forget(self._covariance, cov.POSITION, 2, accuracy_m**2)
        self._horizontal_aid_us = now_us
        self._xy_reset_counter += 1
        return True

    def move_origin(self, now_us: int, latitude_deg: float, longitude_deg: float, altitude_amsl_m: float) -> None:
        """The local frame begins elsewhere; the vehicle stays where it is on the globe. NaN keeps the altitude.

        Where nobody knows a place on the globe yet (vision alone), the vehicle stays where it is in the local frame.
        """
        if self._origin is None:
            if self._aligned:
                self._origin, self._origin_us = MapProjection(latitude_deg, longitude_deg), now_us
                self._ref_alt_m = altitude_amsl_m if math.isfinite(altitude_amsl_m) else 0.0
            return
        self._apply()
        state = self._state
        place = self._origin.reproject(state.pn, state.pe)
        self._origin, self._origin_us = MapProjection(latitude_deg, longitude_deg), now_us
        state.pn, state.pe = self._origin.project(*place)
        self._smooth[3] = self._smooth[4] = 0.0
        self._xy_reset_counter += 1
        if math.isfinite(altitude_amsl_m):
            down_m = altitude_amsl_m - self._ref_alt_m
            self._ref_alt_m = altitude_amsl_m
            state.pd += down_m
            self._terrain.shift(down_m)
            self._baro_bias.reset(self._baro_bias.bias_m + down_m)
            self._z_reset_counter += 1

    def _reset_height(self, now_us: int, down_m: float, variance: float) -> None:
        state = self._state
        self._terrain.shift(down_m - state.pd)
        self._baro_bias.reset(self._baro_bias.bias_m + (down_m - state.pd))
        state.pd = down_m
        self._smooth[5] = 0.0
        cov.forget(self._covariance, cov.POSITION + 2, 1, variance)
        self._height_aid_us = self._height_good_us = now_us
        self._z_reset_counter += 1

    # --- publication ---------------------------------------------------------------------------------------

    def _xy_valid(self, now_us: int) -> bool:
        return self._xy_started and now_us - self._horizontal_aid_us < self._noaid_timeout_us

    @property
    def _xy_started(self) -> bool:
        """There is a local frame, with or without a place on Earth."""
        return self._origin is not None or self._vision_started

    def _publish_rates(self, now_us: int, gyro: tuple[float, float, float], dt: float) -> None:
        bx, by, bz = self._state.gyro_bias
        x, y, z = self._gyro_filter.update(*gyro)
        x -= bx
        y -= by
        z -= bz
        lx, ly, lz = self._rates
        dx, dy, dz = self._rates_derivative
        weight = self._derivative_alpha
        derivative = (
            dx + weight * ((x - lx) / dt - dx),
            dy + weight * ((y - ly) / dt - dy),
            dz + weight * ((z - lz) / dt - dz),
        )
        self._rates, self._rates_derivative = (x, y, z), derivative
        self._topics.vehicle_angular_velocity = VehicleAngularVelocity(now_us, (x, y, z), derivative)

    def _publish_attitude(self, now_us: int) -> None:
        state = self._state
        r00, _, _, r10, _, _, r20, r21, r22 = state.rotation
        pitch = math.asin(-r20 if -1.0 < r20 < 1.0 else math.copysign(1.0, -r20))
        euler = (math.atan2(r21, r22), pitch, math.atan2(r10, r00))
        self._topics.vehicle_attitude = VehicleAttitude(now_us, state.q, euler)

    def _publish_local_position(self, now_us: int) -> None:
        state, origin = self._state, self._origin
        an, ae, ad = state.accel
        valid = self._xy_valid(now_us)
        z_valid = now_us - self._height_aid_us < self._noaid_timeout_us
        # Corrections of velocity (first three) and position fade in with EKF2_TAU_VEL and EKF2_TAU_POS of 0.25 s.
        keep = 1.0 - 0.008 / 0.25
        svn, sve, svd, spn, spe, spd = self._smooth
        svn *= keep
        sve *= keep
        svd *= keep
        spn *= keep
        spe *= keep
        spd *= keep
        self._smooth = [svn, sve, svd, spn, spe, spd]
        down = state.pd + spd
        dist_bottom, dist_bottom_valid = NAN, False
        if self._terrain.valid(now_us):
            dist_bottom, dist_bottom_valid = max(self._terrain.down_m - down, self._p["EKF2_MIN_RNG"]), True
        lat, lon = (origin.lat0_deg, origin.lon0_deg) if origin is not None else (NAN, NAN)
        self._topics.vehicle_local_position = VehicleLocalPosition(
            now_us,
            valid,
            z_valid,
            valid,
            z_valid,
            state.pn + spn,
            state.pe + spe,
            down,
            state.vn + svn,
            state.ve + sve,
            state.vd + svd,
            an,
            ae,
            ad,
            self._topics.vehicle_attitude.euler[2],
            lat,
            lon,
            self._ref_alt_m,
            self._origin_us,
            dist_bottom,
            dist_bottom_valid,
            self._eph,
            self._epv,
            self._evh,
            self._evv,
            self._xy_reset_counter,
            self._z_reset_counter,
        )

    def _publish_global_position(self, now_us: int) -> None:
        origin = self._origin
        if origin is None:
            return
        local = self._topics.vehicle_local_position
        lat, lon = origin.reproject(local.x, local.y)
        terrain_alt = self._ref_alt_m - self._terrain.down_m
        self._topics.vehicle_global_position = VehicleGlobalPosition(
            now_us, local.xy_valid, lat, lon, self._ref_alt_m - local.z, terrain_alt, self._eph, self._epv
        )

    def _publish_status(self, now_us: int) -> None:
        variances = self._covariance.diagonal()
        vn, ve, vd, pn, pe, pd = variances[3:9].tolist()
        self._eph, self._epv = math.sqrt(pn + pe), math.sqrt(pd)
        self._evh, self._evv = math.sqrt(vn + ve), math.sqrt(vd)
        self._topics.estimator_innovations = EstimatorInnovations(now_us, self._innovations.copy())
        self._topics.estimator_status = EstimatorStatus(
            now_us,
            True,
            self._yaw_aligned,
            self._ratios[0],
            self._ratios[1],
            self._ratios[2],
            self._ratios[3],
            self._gps_fused,
            self._baro_fused,
            self._mag_fused,
            self._origin is not None and now_us - self._horizontal_aid_us > GPS_TIMEOUT_US,
            self._state.gyro_bias,
            self._state.accel_bias,
            self._measure_vibration(),
            self._horizontal_good_us,
            bool(self._flow_fused_us) and now_us - self._flow_fused_us < SENSOR_TIMEOUT_US,
            bool(self._vision_us),
            self.disabled,
        )

    def _measure_vibration(self) -> tuple[float, float, float]:
        """EKF2's three: coning, high-frequency gyro and accelerometer, from neighbouring samples."""
        imu = self._topics.sensor_combined
        (gx, gy, gz), (ax, ay, az) = self._last_imu
        x, y, z = imu.gyro_rad_s
        cone = math.hypot(gy * z - gz * y, gz * x - gx * z, gx * y - gy * x)
        spin = math.hypot(x - gx, y - gy, z - gz)
        x, y, z = imu.accelerometer_m_s2
        shake = math.hypot(x - ax, y - ay, z - az)
        old_cone, old_spin, old_shake = self._vibration
        self._vibration = (
            old_cone + 0.1 * (cone - old_cone),
            old_spin + 0.1 * (spin - old_spin),
            old_shake + 0.1 * (shake - old_shake),
        )
        return self._vibration
