"""The estimator: PX4's EKF2 (src/modules/ekf2, v1.18).

It hands samples of all sensors to the filter (fusion.py), which runs as far behind the present as EKF2_DELAY_MAX, and
publishes what the output predictor makes of it at present: the attitude with each IMU sample (250 Hz), the rest with
each step of the filter. The state is predicted with every second IMU sample (125 Hz), the covariance every 64 ms; what
is fused, and how, is a file for each sensor (aid_sources/).

Not here: airspeed and sideslip, GNSS heading, ranging beacons, several instances.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator.aid_sources.aux_global_position import SLOTS as AUXILIARY_SLOTS
from sitl_emu.autopilot.estimator.aid_sources.magnetometer import SAVE_GEO_DECL
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.fusion import Fusion
from sitl_emu.autopilot.estimator.publication import IMU_HZ, Publication
from sitl_emu.autopilot.estimator.records import ACCEL, GYRO, MAG, Records
from sitl_emu.autopilot.estimator.resets import reset_accel_bias, reset_gyro_bias
from sitl_emu.autopilot.estimator.samples import (
    AuxiliarySample,
    AuxiliaryVelocitySample,
    BaroSample,
    FlowSample,
    GnssSample,
    MagSample,
    RangeSample,
    SystemFlags,
    VisionSample,
)
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.distance_sensors import DownwardSensor, distance_sensors
from sitl_emu.autopilot.topics import (
    FRAME_FRD,
    FRAME_NED,
    NOT_NEW,
    DistanceSensorSample,
    Ekf2Timestamps,
    SensorCombined,
    Topics,
    Vector3,
    VehicleOdometry,
)

TENTH_MS_US: Final = 100
STATUS_TIMEOUT_US: Final = 3_000_000
RANGE_TIMEOUT_US: Final = 1_000_000
DECLINATION_CHANGE_DEG: Final = 0.1
LONGEST_DT_S: Final = 0.04
LONGEST_FLOW_S: Final = 1.0
FARTHEST_M: Final = 1e6
FASTEST_M_S: Final = 1e3
"""What is beyond these is no pose of a vehicle, and nothing to compute with."""
LARGEST_SETTING: Final = 1e9
"""More than this means nothing in any unit that parameters have, and its square would leave what a float can tell."""
QUATERNION_TOLERANCE: Final = 1e-5
KEPT_OF_SENS_EN: Final = 0b1_1111_1111_1101
"""PX4 keeps no bit of a second GNSS (EKF2.cpp, syncSensEnParam)."""
ANTENNA = ("SENS_GPS0_OFFX", "SENS_GPS0_OFFY", "SENS_GPS0_OFFZ")


class Settings(dict[str, float]):
    """Values of parameters by name, none beyond LARGEST_SETTING, read when they are first asked for; `clear` after a
    change."""

    def __init__(self, parameters: Parameters) -> None:
        super().__init__()
        self._parameters = parameters

    def __missing__(self, name: str) -> float:
        value = self[name] = min(max(float(self._parameters[name]), -LARGEST_SETTING), LARGEST_SETTING)
        return value


class Estimator:
    """Writer of vehicle_angular_velocity and vehicle_attitude (250 Hz), vehicle_local_position and _global_position
    (with each step of the filter, 125 Hz), wind, and all that records.py tells."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._settings = Settings(parameters)
        self.ekf = ekf = Ekf(self._settings)
        self.fusion = Fusion(ekf)
        self._publication = Publication(topics, self.fusion)
        self.records = Records(topics, self.fusion, self._publication)
        self._version = parameters.version
        self._enable_sensors()
        self._imu_us = 0
        self._mag, self._baro = topics.vehicle_magnetometer, topics.vehicle_air_data
        self._gps, self._range_finder = topics.sensor_gps, DownwardSensor()
        self._range, self._ranges_outside = topics.distance_sensor, topics.distance_sensors_outside
        self._flow, self._vision = topics.vehicle_optical_flow, topics.vehicle_visual_odometry
        self._auxiliary, self._target = topics.aux_global_position, topics.landing_target_pose
        self._status, self._land = topics.vehicle_status, topics.vehicle_land_detected
        self._mag_calibration = self._baro_calibration = -1
        self._accel_calibration = self._gyro_calibration = 0
        self._declination_saved = False
        self._range_us = 0

    def update(self, now_us: int) -> None:
        """One IMU sample, and whatever else has come in."""
        topics = self._topics
        imu = topics.sensor_combined
        if imu.timestamp == self._imu_us:
            return  # the IMU is silent
        dt_s = (imu.timestamp - self._imu_us) * 1e-6
        self._imu_us = imu.timestamp
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._settings.clear()
            self.ekf.refresh()
            self.ekf.down_sampler.target_us = self._settings["EKF2_PREDICT_US"]
            self._publication.refresh()
            self._enable_sensors()
        accel_calibration, gyro_calibration = imu.accel_calibration_count, imu.gyro_calibration_count
        if accel_calibration != self._accel_calibration or gyro_calibration != self._gyro_calibration:
            self._on_imu_calibration(imu)
        if not 0.0 < dt_s < LONGEST_DT_S:
            dt_s = 1.0 / IMU_HZ
        publication, fusion = self._publication, self.fusion
        publication.rates(now_us, topics.sensor_imu.gyro_rad_s, dt_s)
        # PX4 hands over the sample that has just come, then the others, then lets the filter run.
        self._feed(now_us, imu.timestamp)
        stepped = fusion.on_imu(now_us, imu.gyro_rad_s, imu.accelerometer_m_s2, dt_s)
        if self.ekf.flags.tilt_align:
            publication.attitude(now_us)
        if not stepped:
            return
        publication.local_position(now_us)
        publication.global_position(now_us)
        if not self._declination_saved:
            self._save_declination()
        self.records.update(now_us)

    def _enable_sensors(self) -> None:
        """EKF2_SENS_EN, which is not looked at in flight."""
        if not self._topics.vehicle_status.armed:
            self.ekf.sens_en = int(self._settings["EKF2_SENS_EN"])

    def keep_enabled(self) -> None:
        """EKF2_SENS_EN becomes what is enabled just now."""
        self._parameters.set("EKF2_SENS_EN", self.ekf.sens_en & KEPT_OF_SENS_EN, notify=False)

    # --- samples -------------------------------------------------------------------------------------------

    def _feed(self, now_us: int, imu_us: int) -> None:
        """What has come in since the last time; the log is told, by which PX4's replay does the same (EKF2.cpp:781)."""
        topics = self._topics
        distance_rel = flow_rel = baro_rel = mag_rel = vision_rel = NOT_NEW
        if topics.vehicle_air_data is not self._baro:
            self._on_baro(now_us)
            baro_rel = _relative(self._baro.timestamp, imu_us)
        if topics.vehicle_visual_odometry is not self._vision:
            self._vision = topics.vehicle_visual_odometry
            self._on_vision(now_us, self._vision)
            vision_rel = _relative(self._vision.told_us, imu_us)
        if topics.aux_global_position is not self._auxiliary:
            self._on_auxiliary(now_us)
        if topics.landing_target_pose is not self._target:
            self._on_landing_target(now_us)
        if topics.vehicle_optical_flow is not self._flow:
            self._on_flow(now_us)
            flow_rel = _relative(self._flow.timestamp, imu_us)
        if topics.sensor_gps is not self._gps:
            self._on_gps(now_us)
        if topics.vehicle_magnetometer is not self._mag:
            self._on_mag(now_us)
            mag_rel = _relative(self._mag.timestamp, imu_us)
        if topics.distance_sensor is not self._range or topics.distance_sensors_outside is not self._ranges_outside:
            self._range, self._ranges_outside = topics.distance_sensor, topics.distance_sensors_outside
            sample = self._range_finder.new_sample(now_us, distance_sensors(topics))
            if sample is not None:
                self._on_range(now_us, sample)
                distance_rel = _relative(sample.timestamp, imu_us)
        if topics.vehicle_land_detected is not self._land or topics.vehicle_status is not self._status:
            self._on_system(now_us)
        if self.records.logged:
            topics.ekf2_timestamps = Ekf2Timestamps(imu_us, distance_rel, flow_rel, baro_rel, mag_rel, vision_rel)

    def _on_imu_calibration(self, imu: SensorCombined) -> None:
        """What is calibrated anew loses its bias, and what was learnt of it."""
        if imu.accel_calibration_count != self._accel_calibration:
            self._accel_calibration = imu.accel_calibration_count
            reset_accel_bias(self.ekf)
            self.records.forget(ACCEL)
        if imu.gyro_calibration_count != self._gyro_calibration:
            self._gyro_calibration = imu.gyro_calibration_count
            reset_gyro_bias(self.ekf)
            self.records.forget(GYRO)

    def _due(self, time_us: int, delay: str) -> int:
        """When a sample that came at `time_us` is to be fused."""
        return time_us - int(self._settings[delay] * 1000.0) - self.fusion.half_step_us

    def _on_mag(self, now_us: int) -> None:
        self._mag = mag = self._topics.vehicle_magnetometer
        reset = mag.calibration_count != self._mag_calibration
        self._mag_calibration = mag.calibration_count
        if reset:
            self.records.forget(MAG)
        sample = MagSample(self._due(mag.timestamp_sample, "EKF2_MAG_DELAY"), mag.magnetometer_ga, reset)
        self.fusion.magnetometer.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _on_baro(self, now_us: int) -> None:
        self._baro = baro = self._topics.vehicle_air_data
        reset = baro.calibration_count != self._baro_calibration
        self._baro_calibration = baro.calibration_count
        self.fusion.drag.air_density_kg_m3 = baro.rho
        sample = BaroSample(self._due(baro.timestamp_sample, "EKF2_BARO_DELAY"), baro.baro_alt_meter, reset)
        self.fusion.baro.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _on_gps(self, now_us: int) -> None:
        """A fix; SENS_GPS0_DELAY says how late it is (VehicleGPSPosition.cpp)."""
        self._gps = gps = self._topics.sensor_gps
        antenna = tuple(float(self._settings[name]) for name in ANTENNA)
        sample = GnssSample(
            self._due(gps.timestamp_sample or gps.timestamp, "SENS_GPS0_DELAY"),
            gps.latitude_deg,
            gps.longitude_deg,
            gps.altitude_msl_m,
            (gps.vel_n_m_s, gps.vel_e_m_s, gps.vel_d_m_s),
            gps.eph,
            gps.epv,
            gps.s_variance_m_s,
            gps.fix_type,
            gps.satellites_used,
            math.hypot(gps.hdop, gps.vdop),
            antenna=(antenna[0], antenna[1], antenna[2]),
        )
        self.fusion.gnss.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _on_range(self, now_us: int, sensor: DistanceSensorSample) -> None:
        self._range_us = now_us
        distance_m, quality = sensor.current_distance, sensor.signal_quality
        if not math.isfinite(distance_m):
            distance_m, quality = math.inf, 0
        sample = RangeSample(self._due(sensor.timestamp, "EKF2_RNG_DELAY"), distance_m, quality)
        self.fusion.range.sensor.limits_m = (sensor.min_distance, sensor.max_distance)
        self.fusion.range.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _on_flow(self, now_us: int) -> None:
        """Rates of image and gyro, by what they turned in a time; signs are the reverse of the sensor's."""
        self._flow = flow = self._topics.vehicle_optical_flow
        dt_s = flow.integration_timespan_us * 1e-6
        (px, py), (gx, gy, gz) = flow.pixel_flow, flow.delta_angle
        if not math.isfinite(px + py) or not dt_s < LONGEST_FLOW_S:
            return
        rate, gyro = (0.0, 0.0), (0.0, 0.0, 0.0)
        if dt_s > 0.0:
            rate, gyro = (-px / dt_s, -py / dt_s), (-gx / dt_s, -gy / dt_s, -gz / dt_s)
        elif flow.quality:
            return
        middle_us = flow.timestamp - flow.integration_timespan_us // 2
        sample = FlowSample(self._due(middle_us, "EKF2_OF_DELAY"), rate, gyro, flow.quality)
        value, fusion = self._settings, self.fusion
        fusion.flow.limits = (value["SENS_FLOW_MAXR"], value["SENS_FLOW_MINHGT"], value["SENS_FLOW_MAXHGT"])
        fusion.flow.buffer.push(now_us, sample, fusion.observation_interval_us)
        if math.isfinite(flow.distance_m) and now_us > self._range_us + RANGE_TIMEOUT_US:
            quality = int(flow.quality / 255.0 * 100.0)
            ranged = RangeSample(self._due(flow.timestamp, "EKF2_RNG_DELAY"), flow.distance_m, quality)
            fusion.range.sensor.limits_m = fusion.flow.limits[1:]
            fusion.range.buffer.push(now_us, ranged, fusion.observation_interval_us)

    def _on_vision(self, now_us: int, odometry: VehicleOdometry) -> None:
        value = self._settings
        by_parameter = bool(int(value["EKF2_EV_NOISE_MD"]))
        nan3 = (math.nan,) * 3
        position = odometry.position if _within(odometry.position, FARTHEST_M) else nan3
        velocity = odometry.velocity if _within(odometry.velocity, FASTEST_M_S) else nan3
        q = odometry.q
        norm = math.sqrt(sum(part * part for part in q))
        if not abs(norm - 1.0) <= QUATERNION_TOLERANCE:
            q = (math.nan, math.nan, math.nan, math.nan)
        if not (math.isfinite(sum(position)) or math.isfinite(sum(velocity)) or math.isfinite(sum(q))):
            return
        sample = VisionSample(
            self._due(odometry.timestamp, "EKF2_EV_DELAY"),
            position,
            velocity,
            q,
            _variances(odometry.position_variance, value["EKF2_EVP_NOISE"], by_parameter=by_parameter),
            _variances(odometry.velocity_variance, value["EKF2_EVV_NOISE"], by_parameter=by_parameter),
            _variances(odometry.orientation_variance, value["EKF2_EVA_NOISE"], by_parameter=by_parameter),
            FRAME_NED if odometry.pose_frame == FRAME_NED else FRAME_FRD,
            odometry.velocity_frame,
            odometry.reset_counter,
            odometry.quality,
        )
        self.fusion.vision.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _on_auxiliary(self, now_us: int) -> None:
        """Those of the first sources that have come since; where no slot had an id at the start, nobody listens."""
        before, self._auxiliary = self._auxiliary, self._topics.aux_global_position
        if not self.fusion.auxiliary.sources:
            return
        for instance, told in enumerate(self._auxiliary[:AUXILIARY_SLOTS]):
            if told not in before:
                sample = AuxiliarySample(
                    told.timestamp_sample, told.lat, told.lon, told.alt, told.eph, told.epv, told.lat_lon_reset_counter
                )
                self.fusion.auxiliary.on_sample(now_us, instance, told.id, sample, self._claim)

    def _on_landing_target(self, now_us: int) -> None:
        """A target that is seen tells how fast the vehicle is."""
        self._target = target = self._topics.landing_target_pose
        if self._settings["EKF2_AVEL_EN"] and target.rel_vel_ekf2_valid:
            sample = AuxiliaryVelocitySample(
                self._due(target.timestamp, "EKF2_AVEL_DELAY"),
                (-target.vx_rel, -target.vy_rel),
                (target.cov_vx_rel, target.cov_vy_rel),
            )
            self.fusion.auxiliary_velocity.buffer.push(now_us, sample, self.fusion.observation_interval_us)

    def _claim(self, parameter: str, number: int) -> None:
        self._parameters.set(parameter, number, notify=False)

    def _on_system(self, now_us: int) -> None:
        """On the ground or in the air, at rest or not; EKF2_POS_LOCK holds the position of who is landed."""
        was_armed = self._status.armed
        self._status, self._land = status, land = self._topics.vehicle_status, self._topics.vehicle_land_detected
        if was_armed and not status.armed:
            self.keep_enabled()
        in_air, at_rest, effect = status.armed, False, False
        if land.timestamp and now_us < land.timestamp + STATUS_TIMEOUT_US:
            in_air, at_rest, effect = not land.landed, land.at_rest, land.in_ground_effect
        ekf = self.ekf
        lock = bool(int(self._settings["EKF2_POS_LOCK"]))
        held = lock and not in_air and ekf.local_horizontal_valid and ekf.origin is not None
        flags = SystemFlags(now_us - self.fusion.half_step_us, at_rest, in_air, effect, held)
        self.fusion.system_flags.push(now_us, flags, self.fusion.observation_interval_us)

    def _save_declination(self) -> None:
        """EKF2_MAG_DECL, once the place is known (EKF2_DECL_TYPE bit 1), as EKF2.cpp's UpdateMagCalibration does."""
        declination_deg = math.degrees(self.fusion.magnetometer.declination_rad)
        if not math.isfinite(declination_deg) or not int(self._settings["EKF2_DECL_TYPE"]) & SAVE_GEO_DECL:
            return
        self._declination_saved = True
        if abs(declination_deg - self._settings["EKF2_MAG_DECL"]) > DECLINATION_CHANGE_DEG:
            self._parameters.set("EKF2_MAG_DECL", declination_deg, notify=False)


def _relative(told_us: int, imu_us: int) -> int:
    return told_us // TENTH_MS_US - imu_us // TENTH_MS_US


def _within(vector: Vector3, largest: float) -> bool:
    return all(abs(part) < largest for part in vector)


def _variances(told: Vector3, noise: float, *, by_parameter: bool) -> Vector3:
    """The message's where EKF2_EV_NOISE_MD is 0 and it has them, but no less than the parameter's."""
    least = noise * noise
    if by_parameter or not all(math.isfinite(value) for value in told):
        return least, least, least
    x, y, z = (max(value, least) for value in told)
    return x, y, z
