"""What all aids of the estimator share: state, covariance, gates, and the ways in which the state is set anew.

PX4's EKF2 (src/modules/ekf2/EKF/ekf.cpp, ekf_helper.cpp, v1.18). Corrections of one fusion are collected and put into
the state together (`apply`); what is published follows them smoothly, which is what `smooth` is for.
"""

import math
from collections.abc import Callable

import numpy as np

from autopilot.estimator import covariance as cov
from autopilot.estimator.strapdown import Strapdown
from autopilot.topics import NAN, Innovation
from sitl_emu.core.geodesy import MapProjection

GPS_TIMEOUT_US = 1_000_000
REJECTED_TIMEOUT_US = 5_000_000
SENSOR_TIMEOUT_US = 1_000_000
VARIANCE_FLOOR = np.array([1e-9] * 3 + [1e-8] * 3 + [1e-8] * 3 + [1e-14] * 3 + [1e-12] * 3)
VELOCITY_RATIO, POSITION_RATIO, HEIGHT_RATIO, HEADING_RATIO = range(4)
Observation = tuple[int, float, float]
"""Index of the state, innovation, variance."""
BROKEN_RATIO = 1e12
"""Told of an observation that a broken filter could not weigh; ours: finite, as what is sent must be."""


class Filter:
    """The state in `state`, its covariance, the local frame, and since when what has aided it (µs)."""

    def __init__(self) -> None:
        self.state = Strapdown()
        self.covariance = np.identity(cov.STATES)
        self._correction = np.zeros(cov.STATES)
        self._transition = np.identity(cov.STATES)
        self._noise = np.zeros(cov.STATES)
        self.settings: dict[str, float] = {}
        """EKF2_* and IMU_* by name."""
        self.disabled: frozenset[int] = frozenset()
        """FUSION_SOURCEs that MAV_CMD_ESTIMATOR_SENSOR_ENABLE has switched off."""
        self.aligned = self.yaw_aligned = False
        self.declination_rad = 0.0
        self.origin: MapProjection | None = None
        self.origin_us = 0
        self.ref_alt_m = NAN
        self.counts_from_start = False
        """Vision or flow has given a position, whether or not there is an origin."""
        self.noaid_timeout_us = 0.0
        self.horizontal_aid_us = self.height_aid_us = 0
        self.horizontal_good_us = self.height_good_us = 0
        self.xy_reset_counter = self.z_reset_counter = 0
        self.ratios = [0.0, 0.0, 0.0, 0.0]
        """Innovations over their gates: velocity, position, height, heading."""
        self.innovations: dict[str, tuple[Innovation, ...]] = {}
        """The last of each sensor, under the names of uORB estimator_innovations."""
        self.smooth = [0.0] * 6
        """What published velocity and position (NED) still lack of the state's."""
        self.height_followers: list[Callable[[float], None]] = []
        """Told by how many metres down the height jumps: whoever keeps heights of the local frame."""

    def refresh(self, settings: dict[str, float]) -> None:
        """Take over changed parameters."""
        self.settings = settings
        self._noise = cov.noise_rates(
            settings["EKF2_GYR_NOISE"],
            settings["EKF2_ACC_NOISE"],
            settings["EKF2_GYR_B_NOISE"],
            settings["EKF2_ACC_B_NOISE"],
        )
        if settings["EKF2_MAG_DECL"] or self.origin is None:
            self.declination_rad = math.radians(settings["EKF2_MAG_DECL"])
        self.noaid_timeout_us = settings["EKF2_NOAID_TOUT"]

    def begin(self, now_us: int, q: tuple[float, float, float, float], *, heading_known: bool) -> None:
        """Tilt, and perhaps heading, are known: the filter runs from here on."""
        settings = self.settings
        self.aligned, self.yaw_aligned = True, heading_known
        self.state.q = q
        self.state.restart_sums()
        yaw_rad = 0.1 if heading_known else math.pi
        self.covariance = cov.initial(
            settings["EKF2_ANGERR_INIT"], yaw_rad, 0.5, 0.5, settings["EKF2_GBIAS_INIT"], settings["EKF2_ABIAS_INIT"]
        )
        self.horizontal_good_us = self.height_good_us = self.height_aid_us = now_us
        self.horizontal_aid_us = now_us - int(self.noaid_timeout_us) - 1

    # --- what is known -------------------------------------------------------------------------------------

    @property
    def xy_started(self) -> bool:
        """There is a local frame, with or without a place on Earth."""
        return self.origin is not None or self.counts_from_start

    def xy_valid(self, now_us: int) -> bool:
        """Horizontal position and velocity are aided, or were not long ago (EKF2_NOAID_TOUT)."""
        return self.xy_started and now_us - self.horizontal_aid_us < self.noaid_timeout_us

    def z_valid(self, now_us: int) -> bool:
        """Likewise the height."""
        return now_us - self.height_aid_us < self.noaid_timeout_us

    def variance(self, index: int) -> float:
        """Of one state."""
        return float(self.covariance[index, index])

    # --- fusion --------------------------------------------------------------------------------------------

    def predict_covariance(self) -> None:
        """The covariance up to now, from what the state has summed up since the last time."""
        state = self.state
        delta_velocity = (state.dvn, state.dve, state.dvd)
        self.covariance = cov.predict(
            self.covariance, list(state.rotation), delta_velocity, state.dt_s, self._noise, self._transition
        )

    def fuse(self, index: int, innovation: float, variance: float) -> None:
        """One observation of a state, whatever it says."""
        cov.fuse(self.covariance, self._correction, index, innovation, variance)

    def gated(
        self, ratio_slot: int | None, observations: tuple[Observation, ...], gate: float, field: str = ""
    ) -> bool:
        """Fuse the observations of one sensor together unless one lies outside the gate (1 σ at least).

        `field` is the name under which estimator_innovations tells them.
        """
        gate = max(gate, 1.0)
        p, correction = self.covariance, self._correction
        told = []
        for index, innovation, variance in observations:
            rest, innovation_variance = innovation - float(correction[index]), float(p[index, index]) + variance
            # A negative variance of the state is a filter that has broken: then nothing passes.
            healthy = innovation_variance > 0.0 and innovation_variance >= variance
            ratio = rest * rest / (gate * gate * innovation_variance) if healthy else BROKEN_RATIO
            told.append(Innovation(-rest, innovation_variance, ratio))
        ratio = max(each.test_ratio for each in told)
        if field:
            self.innovations[field] = tuple(told)
        if ratio_slot is not None:
            self.ratios[ratio_slot] = math.sqrt(ratio)
        if not ratio <= 1.0:
            return False
        for index, innovation, variance in observations:
            cov.fuse(p, correction, index, innovation, variance)
        return True

    def apply(self) -> None:
        """Put the collected correction into the state; published velocity and position follow smoothly."""
        values = self._correction.tolist()
        self._correction[:] = 0.0
        self.state.correct(values, self.settings["EKF2_GYR_B_LIM"], self.settings["EKF2_ABL_LIM"])
        self.smooth = [old - step for old, step in zip(self.smooth, values[3:9], strict=True)]

    def tidy(self) -> None:
        """Free the covariance of what rounding did."""
        self.covariance = cov.symmetric(self.covariance, VARIANCE_FLOOR)

    # --- resets --------------------------------------------------------------------------------------------

    def reset_yaw(self, turn_rad: float) -> None:
        """Turn the heading."""
        self.yaw_aligned = True
        self.state.correct([0.0, 0.0, turn_rad] + [0.0] * 12, math.inf, math.inf)
        cov.forget(self.covariance, 2, 1, 0.01)

    def reset_velocity(self, velocity: tuple[float, float], variance: float) -> None:
        """Horizontal velocity, m/s."""
        self.state.vn, self.state.ve = velocity
        self.smooth[0] = self.smooth[1] = 0.0
        cov.forget(self.covariance, cov.VELOCITY, 2, variance)

    def reset_position(self, place: tuple[float, float], variance: float) -> None:
        """Horizontal position, m in the local frame."""
        self.state.pn, self.state.pe = place
        self.smooth[3] = self.smooth[4] = 0.0
        cov.forget(self.covariance, cov.POSITION, 2, variance)

    def reset_height(self, now_us: int, down_m: float, variance: float) -> None:
        """Height, and with it what is kept relative to it."""
        shift_m = down_m - self.state.pd
        for follow in self.height_followers:
            follow(shift_m)
        self.state.pd = down_m
        self.smooth[5] = 0.0
        cov.forget(self.covariance, cov.POSITION + 2, 1, variance)
        self.height_aid_us = self.height_good_us = now_us
        self.z_reset_counter += 1

    # --- the local frame -----------------------------------------------------------------------------------

    def set_origin(self, now_us: int, latitude_deg: float, longitude_deg: float, altitude_amsl_m: float) -> None:
        """The vehicle is at this place: zero, or where it has counted to, is the origin that belongs to it."""
        here = MapProjection(latitude_deg, longitude_deg)
        if self.counts_from_start:
            here = MapProjection(*here.reproject(-self.state.pn, -self.state.pe))
        self.origin, self.origin_us = here, now_us
        self.ref_alt_m = altitude_amsl_m + self.state.pd

    def take_position(self, now_us: int, latitude_deg: float, longitude_deg: float, accuracy_m: float) -> bool:
        """Take over a position from outside; False before there is a local frame."""
        if self.origin is None:
            return False
        self.apply()
        self.reset_position(self.origin.project(latitude_deg, longitude_deg), accuracy_m**2)
        self.horizontal_aid_us = now_us
        self.xy_reset_counter += 1
        return True

    def move_origin(self, now_us: int, latitude_deg: float, longitude_deg: float, altitude_amsl_m: float) -> None:
        """The local frame begins elsewhere; the vehicle stays where it is on the globe. NaN keeps the altitude.

        Where nobody knows a place on the globe yet (vision alone), the vehicle stays where it is in the local frame.
        """
        if self.origin is None:
            if self.aligned:
                self.origin, self.origin_us = MapProjection(latitude_deg, longitude_deg), now_us
                self.ref_alt_m = altitude_amsl_m if math.isfinite(altitude_amsl_m) else 0.0
            return
        self.apply()
        state = self.state
        place = self.origin.reproject(state.pn, state.pe)
        self.origin, self.origin_us = MapProjection(latitude_deg, longitude_deg), now_us
        state.pn, state.pe = self.origin.project(*place)
        self.smooth[3] = self.smooth[4] = 0.0
        self.xy_reset_counter += 1
        if math.isfinite(altitude_amsl_m):
            down_m = altitude_amsl_m - self.ref_alt_m
            self.ref_alt_m = altitude_amsl_m
            state.pd += down_m
            for follow in self.height_followers:
                follow(down_m)
            self.z_reset_counter += 1
