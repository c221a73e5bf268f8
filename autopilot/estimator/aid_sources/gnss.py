"""Position, velocity and height from GPS: PX4's EKF2, aid_sources/gnss (v1.18). The first good fix is the origin."""

import math

from autopilot.estimator import covariance as cov
from autopilot.estimator.aid_sources import magnetometer
from autopilot.estimator.filter import (
    GPS_TIMEOUT_US,
    HEIGHT_RATIO,
    POSITION_RATIO,
    REJECTED_TIMEOUT_US,
    VELOCITY_RATIO,
    Filter,
)
from autopilot.estimator.gps_checks import LEAST_FIX, GpsChecks
from autopilot.estimator.height_bias import HeightBias
from autopilot.parameters import Parameters
from autopilot.topics import SensorGps, Topics

FUSION_SOURCE = 0
USE_POSITION, USE_HEIGHT, USE_VELOCITY = 1, 2, 4
"""Bits of EKF2_GPS_CTRL."""
HGT_REF_BARO = 0
EPH_UNKNOWN_M, EPV_UNKNOWN_M = 1.0, 1.5
SPEED_ACCURACY_M_S = 0.25
"""What PX4's simulator_mavlink says of HIL_GPS's speed accuracy."""


class GnssAid:
    """`fused`: the receiver is in use."""

    def __init__(self, topics: Topics, parameters: Parameters, kalman: Filter) -> None:
        self._topics, self._filter = topics, kalman
        self._checks = GpsChecks(parameters)
        self._bias = HeightBias()
        self.sample_us = 0
        self.fused = False

    def refresh(self) -> None:
        """Take over changed parameters."""
        settings = self._filter.settings
        self._control = int(settings["EKF2_GPS_CTRL"])
        self._height_by_baro = int(settings["EKF2_HGT_REF"]) == HGT_REF_BARO

    @property
    def gives_height(self) -> bool:
        """Heights are the receiver's at present, unless vision's are wanted."""
        return not self._height_by_baro and self.fused

    def update(self, now_us: int) -> None:
        """Fuse a fix that is new; none for long is noticed as well."""
        gps = self._topics.sensor_gps
        if gps.timestamp != self.sample_us:
            self.sample_us = gps.timestamp
            self._on_fix(now_us, gps)
        elif now_us - self.sample_us > GPS_TIMEOUT_US:
            self.fused = False
            self._checks.lost()

    def _on_fix(self, now_us: int, gps: SensorGps) -> None:
        kalman = self._filter
        self._checks.update(now_us, gps)
        enabled = self._control & USE_POSITION and FUSION_SOURCE not in kalman.disabled
        usable = gps.fix_type >= LEAST_FIX and enabled and kalman.yaw_aligned
        if not usable or (not self.fused and not self._checks.passed):
            self.fused = False
            return
        # A correction waiting from rest, mag or baro belongs to the state before a reset.
        kalman.apply()
        self.fused = True
        if kalman.origin is None:
            kalman.set_origin(now_us, gps.latitude_deg, gps.longitude_deg, gps.altitude_msl_m)
            self._bias.reset(0.0)
            self._reset(now_us, gps)
            magnetometer.turn_by_declination(kalman, gps.latitude_deg, gps.longitude_deg)
            return
        if kalman.xy_valid(now_us):
            self._fuse_horizontal(now_us, gps)
        else:
            self._reset(now_us, gps)
        self._fuse_height(now_us, gps)

    def _reset(self, now_us: int, gps: SensorGps) -> None:
        """Position and velocity as the receiver says."""
        kalman = self._filter
        assert kalman.origin is not None
        accuracy_m_s = max(SPEED_ACCURACY_M_S, kalman.settings["EKF2_GPS_V_NOISE"])
        kalman.reset_velocity((gps.vel_n_m_s, gps.vel_e_m_s), accuracy_m_s**2)
        place = kalman.origin.project(gps.latitude_deg, gps.longitude_deg)
        kalman.reset_position(place, self._position_noise(gps.eph) ** 2)
        kalman.horizontal_aid_us = kalman.horizontal_good_us = now_us
        kalman.xy_reset_counter += 1

    def _fuse_horizontal(self, now_us: int, gps: SensorGps) -> None:
        kalman = self._filter
        state, settings = kalman.state, kalman.settings
        assert kalman.origin is not None
        good = False
        if self._control & USE_VELOCITY:
            variance = max(SPEED_ACCURACY_M_S, settings["EKF2_GPS_V_NOISE"]) ** 2
            velocity = (
                (cov.VELOCITY, gps.vel_n_m_s - state.vn, variance),
                (cov.VELOCITY + 1, gps.vel_e_m_s - state.ve, variance),
                (cov.VELOCITY + 2, gps.vel_d_m_s - state.vd, 2.25 * variance),
            )
            good = kalman.gated(VELOCITY_RATIO, velocity, settings["EKF2_GPS_V_GATE"], "gps_vel")
        north, east = kalman.origin.project(gps.latitude_deg, gps.longitude_deg)
        variance = self._position_noise(gps.eph) ** 2
        position = ((cov.POSITION, north - state.pn, variance), (cov.POSITION + 1, east - state.pe, variance))
        if kalman.gated(POSITION_RATIO, position, settings["EKF2_GPS_P_GATE"], "gps_hpos"):
            kalman.horizontal_good_us = kalman.horizontal_aid_us = now_us
        elif good:
            kalman.horizontal_aid_us = now_us
        if now_us - kalman.horizontal_good_us > REJECTED_TIMEOUT_US:
            self._reset(now_us, gps)

    def _fuse_height(self, now_us: int, gps: SensorGps) -> None:
        if not self._control & USE_HEIGHT:
            return
        kalman, index = self._filter, cov.POSITION + 2
        settings, down_m = kalman.settings, kalman.state.pd
        variance = max(gps.epv if math.isfinite(gps.epv) else EPV_UNKNOWN_M, 1.5 * settings["EKF2_GPS_P_NOISE"]) ** 2
        height = gps.altitude_msl_m - kalman.ref_alt_m
        if self._height_by_baro:
            self._bias.update(height + down_m, variance + kalman.variance(index), 0.1)
        innovation = self._bias.bias_m - height - down_m
        slot = None if self._height_by_baro else HEIGHT_RATIO
        if kalman.gated(slot, ((index, innovation, variance),), settings["EKF2_GPS_P_GATE"], "gps_vpos"):
            kalman.height_aid_us = kalman.height_good_us = now_us
        elif now_us - kalman.height_good_us > REJECTED_TIMEOUT_US:
            kalman.reset_height(now_us, -height, variance)

    def _position_noise(self, accuracy_m: float) -> float:
        accuracy = accuracy_m if math.isfinite(accuracy_m) else EPH_UNKNOWN_M
        return max(accuracy, self._filter.settings["EKF2_GPS_P_NOISE"])
