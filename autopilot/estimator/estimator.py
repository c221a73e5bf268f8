"""The estimator: attitude, velocity and position from noisy sensors alone.

An error-state Kalman filter with the behaviour and the parameters of PX4's EKF2 (src/modules/ekf2, v1.18): start at
rest, local origin at the first good GPS fix, GPS position and velocity, height from the source of EKF2_HGT_REF with the
other one's offset estimated, magnetic heading, zero velocity at rest, innovation gates, dead reckoning for
EKF2_NOAID_TOUT after the last horizontal aid, reset when aid comes back and disagrees. The state is predicted at every
IMU sample (strapdown.py), the covariance only with each GPS fix, or after 140 ms without one (covariance.py); what then
is fused, and how, is a file for each sensor (aid_sources/).

Differs from EKF2: the filter runs on the newest sample instead of a delayed one, so sensor delays (EKF2_*_DELAY) do
not act; no magnetic field states, wind, several instances, or GPS heading.
"""

import math

from autopilot.estimator.aid_sources import rest
from autopilot.estimator.aid_sources.barometer import BarometerAid
from autopilot.estimator.aid_sources.gnss import GnssAid
from autopilot.estimator.aid_sources.magnetometer import MAG_TYPE_NONE, MagnetometerAid
from autopilot.estimator.aid_sources.optical_flow import OpticalFlowAid
from autopilot.estimator.aid_sources.range_finder import RangeFinderAid
from autopilot.estimator.aid_sources.vision import VisionAid
from autopilot.estimator.alignment import Alignment
from autopilot.estimator.filter import GPS_TIMEOUT_US, Filter
from autopilot.estimator.publication import IMU_HZ, Fused, Publication
from autopilot.estimator.terrain import Terrain
from autopilot.parameters import Parameters
from autopilot.topics import Topics

FUSE_EVERY_US = 140_000
"""A little more than the period of PX4's simulated GPS, with whose fixes everything else is fused as well."""


class Estimator:
    """Writer of vehicle_angular_velocity (250 Hz), vehicle_attitude and vehicle_local_position (125 Hz, on the ticks of
    position control), vehicle_global_position (62.5 Hz), estimator_status and
    estimator_innovations (with each fusion)."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self.filter = kalman = Filter()
        terrain = Terrain()
        self._state = kalman.state
        self._alignment = Alignment()
        self._magnetometer = MagnetometerAid(topics, kalman)
        self._barometer = BarometerAid(topics, kalman)
        self._vision = VisionAid(topics, kalman)
        self._optical_flow = OpticalFlowAid(topics, kalman, terrain)
        self._gnss = GnssAid(topics, parameters, kalman)
        self._range_finder = RangeFinderAid(topics, kalman, terrain)
        self._publication = Publication(topics, kalman, terrain)
        self._ticks = 0
        self._imu_us = self._fused_us = 0
        self._sample_us = -1
        self._version = -1
        self._refresh()

    def _refresh(self) -> None:
        self._version = self._parameters.version
        names = (name for name in self._parameters if name.startswith(("EKF2_", "IMU_")))
        self.filter.refresh({name: float(self._parameters[name]) for name in names})
        for part in (self._gnss, self._vision, self._range_finder, self._publication):
            part.refresh()

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
        publication = self._publication
        publication.rates(now_us, gyro, dt)
        if not self.filter.aligned:
            self._align(now_us)
            publication.last_imu = (gyro, accel)
            return
        self._state.predict(gyro, accel, dt)
        if (
            topics.sensor_gps.timestamp != self._gnss.sample_us
            or now_us - self._fused_us >= FUSE_EVERY_US
            or topics.vehicle_visual_odometry is not self._vision.sample
            or topics.vehicle_optical_flow is not self._optical_flow.sample
        ):
            self._fuse(now_us)
        publication.last_imu = (gyro, accel)
        if not ticks & 1:
            publication.attitude(now_us)
            publication.local_position(now_us)
            if not ticks & 3:
                publication.global_position(now_us)

    def _align(self, now_us: int) -> None:
        """Collect samples until tilt and heading are known: then the filter begins."""
        topics, kalman, alignment = self._topics, self.filter, self._alignment
        imu, mag = topics.sensor_combined, topics.sensor_mag
        alignment.on_imu(imu.gyro_rad_s, imu.accelerometer_m_s2)
        if mag.timestamp != self._magnetometer.sample_us:
            self._magnetometer.sample_us = mag.timestamp
            alignment.on_mag(mag.magnetometer_ga)
        heading = alignment.heading_ready()
        uses_mag = int(kalman.settings["EKF2_MAG_TYPE"]) != MAG_TYPE_NONE
        height = math.isfinite(topics.sensor_baro.baro_alt_m) or not int(kalman.settings["EKF2_BARO_CTRL"])
        if not (alignment.tilt_ready() and height and (heading or not uses_mag)):
            return
        kalman.begin(now_us, alignment.attitude(kalman.declination_rad), heading_known=heading)
        self._barometer.begin()
        self._fused_us = now_us

    def _fuse(self, now_us: int) -> None:
        """Predict the covariance up to now and fuse what is new."""
        kalman, vision, gnss = self.filter, self._vision, self._gnss
        kalman.predict_covariance()
        still = rest.at_rest(self._topics, kalman)
        if still:
            rest.fuse_rest(kalman)
        kalman.state.restart_sums()
        self._fused_us = now_us
        self._magnetometer.update(now_us, other_heading=vision.gives_heading)
        self._barometer.update(now_us, other_reference=vision.gives_height or gnss.gives_height)
        vision.update(now_us, gps_fused=gnss.fused)
        self._optical_flow.update(now_us)
        gnss.update(now_us)
        if not still and now_us - kalman.horizontal_good_us > GPS_TIMEOUT_US:
            rest.fuse_fake_velocity(now_us, kalman)
        kalman.apply()
        kalman.tidy()
        self._range_finder.update(now_us)
        flow_fused = self._optical_flow.fused(now_us)
        fused = Fused(gnss.fused, self._barometer.fused, self._magnetometer.fused, flow_fused, vision.fused)
        self._publication.status(now_us, fused)
