"""Where the target of a precision landing is, by what is known and seen: PX4's vision_target_estimator (v1.18).

It runs while a precision landing is flown (VTE_EN, VTE_POS_EN, VTE_TASK_MASK 1), on a target that stands. That is where
TARGET_RELATIVE sees it (VTE_AID_MASK 4), and where the mission's landing is to be, seen from the receiver's position
(8), with the receiver's velocity (2). Where both are known, the receiver's bias against the camera is estimated, which
a mean of the first differences begins (VTE_BIA_AVG_…). Fifty times a second it says where the target is, in the same
topic as the targets that LANDING_TARGET tells of, and as it does so more often, a mission lands where this has it.
With neither, as in AUTO_PRECLAND after a takeoff, it says nothing; where a camera has led the vehicle to its descent, a
filter that begins anew lands on the place of that descent.

Left out: the target's own receiver (1, 16), its yaw (VTE_YAW_EN), and a receiver's antenna beside the centre of mass. A
measurement is fused as it comes: PX4 looks up the state of then where it is older than 20 ms, as it can be where
somebody answers its TIMESYNC.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import SetpointType
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import LandingTargetPose, SensorGps, Topics, Vector3
from sitl_emu.autopilot.vision_target_estimator.bias_average import BiasAverage
from sitl_emu.autopilot.vision_target_estimator.target_filter import TargetFilter
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import rotated, rotation
from sitl_emu.core.c_types import float32
from sitl_emu.core.geodesy import EARTH_RADIUS_M

LOOKS_EVERY_US: Final = 200_000
"""While there is nothing to do (VisionTargetEst::Run)."""
LONGEST_STEP_US: Final = 100_000
"""After a longer one the filter begins anew (VTEPosition::update)."""
PRECISION_LANDING, RECEIVER_VELOCITY, VISION, MISSION_POSITION = 1, 2, 4, 8
"""Bits of VTE_TASK_MASK and VTE_AID_MASK."""
PREC_LAND_STALE_US: Final = 500_000
"""A precision landing that has said nothing for so long is over; ours, PX4's says so."""
LEAST_VARIANCE, LEAST_NOISE, LEAST_THRESHOLD = 1e-6, 1e-2, 0.1
"""kMinVariance, kMinObservationNoise, kMinNisThreshold (common.h)."""
NOTHING: Final = (0.0, 0.0, 0.0)
Place = tuple[float, float, float]
"""Degrees and m AMSL."""


class Measurement(NamedTuple):
    """Where the target is from the vehicle, m along NED, by a camera or the receiver."""

    time_us: int
    distances: Vector3
    variances: Vector3


class VisionTargetEstimator:
    """Writer of landing_target_pose, beside LANDING_TARGET."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self.was_started = bool(parameters["VTE_EN"])
        """By PX4's start-up script (rc.mc_apps)."""
        self._is_enabled = self.was_started and bool(parameters["VTE_POS_EN"])
        self._looked_us = 0
        self.runs = False
        """A precision landing is flown."""
        self._landing: Place | None = None
        """Where the vehicle is to land, since it is known; `_place`: the one that the filter began with."""
        self._place: Place | None = None
        self._gps, self._report = topics.sensor_gps, topics.fiducial_marker_pos_report
        self._axes: list[TargetFilter] = []
        """North, east, down; none before the first measurement."""
        self._predicted_us = self._fused_us = self._seen_us = 0
        """When the last step was, when a place was fused, and when one that a camera saw."""
        self._by_receiver: Measurement | None = None
        """The last one, fused or not."""
        self._bias_is_known = False
        self._average: BiasAverage | None = None
        self._relies_on = 0
        """The aid that the distances are by, as long as the bias is not known; then the other one waits."""

    def update(self, now_us: int) -> None:
        """At 50 Hz, after the navigator."""
        if not self._is_enabled or (not self.runs and now_us - self._looked_us < LOOKS_EVERY_US):
            return
        self._looked_us = now_us
        if not self._is_wanted(now_us):
            self.runs = False
            self._forget()
            return
        begins = not self.runs
        if begins:
            self.runs, self._landing, self._by_receiver = True, None, None
            self._gps, self._report = self._topics.sensor_gps, self._topics.fiducial_marker_pos_report
        self._landing = self._landing or self._item_place() or self._setpoint_place()
        if begins or (self._axes and now_us - self._fused_us >= self._us("VTE_BTOUT")):
            self._forget()
            self._place = self._landing
        if self._axes:
            self._predict(now_us)
        self._measure(now_us)
        if self._axes:
            self._tell(now_us)

    def _is_wanted(self, now_us: int) -> bool:
        status, topics = self._topics.prec_land_status, self._topics
        is_flown = status.runs and now_us - status.timestamp < PREC_LAND_STALE_US
        is_task = int(self._parameters["VTE_TASK_MASK"]) & PRECISION_LANDING
        return bool(is_task and is_flown and not topics.vehicle_land_detected.landed)

    def _forget(self) -> None:
        """The filter is to begin anew."""
        self._axes, self._average = [], None
        self._bias_is_known, self._relies_on, self._seen_us = False, 0, 0

    def _item_place(self) -> Place | None:
        """Of the item that was flown last, however long ago; its place comes as float32, 0.4 m beside it at worst."""
        item, home = self._topics.navigator_mission_item, self._topics.home_position
        alt_m = item.altitude + (home.alt if item.altitude_is_relative else 0.0)
        if item.nav_cmd != mavlink.MAV_CMD_NAV_LAND or not math.isfinite(item.latitude + item.longitude + alt_m):
            return None
        return float32(item.latitude), float32(item.longitude), float32(alt_m)

    def _setpoint_place(self) -> Place | None:
        """Of the landing that is flown or comes next."""
        triplet = self._topics.position_setpoint_triplet
        for setpoint in (triplet.next, triplet.current):
            if setpoint.valid and setpoint.type == SetpointType.LAND:
                return setpoint.lat, setpoint.lon, setpoint.alt
        return None

    def _predict(self, now_us: int) -> None:
        dt_us, self._predicted_us = now_us - self._predicted_us, now_us
        if dt_us > LONGEST_STEP_US:
            self._forget()
            return
        local = self._topics.vehicle_local_position
        noise, bias_noise = self._variance("VTE_ACC_D_UNC"), self._variance("VTE_BIAS_UNC")
        for axis, acceleration in zip(self._axes, (local.ax, local.ay, local.az), strict=True):
            axis.predict(dt_us * 1e-6, acceleration, noise, bias_noise)

    # --- what is measured ----------------------------------------------------------------------------------

    def _measure(self, now_us: int) -> None:
        """Take in what has come: the place by the receiver, then by the camera, then the receiver's velocity."""
        aids = int(self._parameters["VTE_AID_MASK"])
        is_biased = self._bias_is_known
        seen = self._seen(now_us) if aids & VISION else None
        given = velocity = None
        if self._topics.sensor_gps is not self._gps:
            self._gps = self._topics.sensor_gps
            given = self._given(self._gps) if aids & MISSION_POSITION else None
            velocity = _velocity(self._gps) if aids & RECEIVER_VELOCITY else None
        if not self._axes and not self._begin(now_us, seen, given):
            return
        if seen is not None and not self._bias_is_known:
            self._learn_bias(now_us, seen)
        if given is not None and (self._bias_is_known or self._relies_on != VISION):
            self._fuse(now_us, MISSION_POSITION, given, is_biased=is_biased)
        if seen is not None and (self._bias_is_known or self._relies_on != MISSION_POSITION):
            self._fuse(now_us, VISION, seen, is_biased=False)
        if velocity is not None:
            variance = max(LEAST_NOISE, float(self._parameters["VTE_GPS_V_NOISE"]), self._gps.s_variance_m_s) ** 2
            for axis, speed in zip(self._axes, velocity, strict=True):
                axis.fuse_speed(speed, variance, self._threshold())

    def _seen(self, now_us: int) -> Measurement | None:
        """By a camera: a new report that is recent and whole."""
        report = self._topics.fiducial_marker_pos_report
        if report is self._report:
            return None
        self._report = report
        numbers = (*report.rel_pos, *report.cov_rel_pos, *report.q)
        if now_us - report.timestamp >= self._us("VTE_M_REC_TOUT") or not math.isfinite(sum(numbers)):
            return None
        r = rotation(report.q)
        least = max(float(self._parameters["VTE_EVP_NOISE"]), LEAST_NOISE) ** 2
        x, y, z = (max(variance, least) for variance in report.cov_rel_pos)
        north, east, down = (r[i] ** 2 * x + r[i + 1] ** 2 * y + r[i + 2] ** 2 * z for i in (0, 3, 6))
        return Measurement(report.timestamp, rotated(r, report.rel_pos), (north, east, down))

    def _given(self, gps: SensorGps) -> Measurement | None:
        """By the receiver's position and the place of the mission's landing."""
        distances = way_to(gps, self._place) if self._place is not None else (math.nan,) * 3
        if not math.isfinite(sum(distances)):
            return None
        least = max(float(self._parameters["VTE_GPS_P_NOISE"]), LEAST_NOISE)
        horizontal, vertical = max(least, gps.eph) ** 2, max(least, gps.epv) ** 2  # NaN counts as the least
        self._by_receiver = Measurement(gps.timestamp, distances, (horizontal, horizontal, vertical))
        return self._by_receiver

    def _fuse(self, now_us: int, aid: int, measured: Measurement, *, is_biased: bool) -> None:
        threshold = self._threshold()
        fused = [
            axis.fuse_distance(distance, variance, threshold, is_biased=is_biased)
            for axis, distance, variance in zip(self._axes, measured.distances, measured.variances, strict=True)
        ]
        if any(fused):
            self._fused_us = now_us
            self._relies_on = 0 if self._bias_is_known else aid
            self._seen_us = now_us if aid == VISION else self._seen_us

    # --- beginning, and the receiver's bias ------------------------------------------------------------------

    def _begin(self, now_us: int, seen: Measurement | None, given: Measurement | None) -> bool:
        """With the first place and a velocity; False where one of them is missing."""
        local, gps = self._topics.vehicle_local_position, self._gps
        velocity = _velocity(gps) if now_us - gps.timestamp < self._us("VTE_M_REC_TOUT") else None
        if velocity is None and local.v_xy_valid and local.v_z_valid:
            velocity = (local.vx, local.vy, local.vz)
        first = seen or given
        if velocity is None or first is None:
            return False
        both = seen is not None and self._receivers_recent(now_us) is not None
        averages = both and given is not None and self._averages()
        if given is not None and averages:
            first = given
        self._relies_on = VISION if first is seen else MISSION_POSITION
        bias: Vector3 = NOTHING
        if seen is not None and both and not averages:
            bias = self._difference(now_us, seen) or NOTHING
            self._bias_is_known, self._relies_on = True, 0
        variances = [self._variance(name) for name in ("VTE_POS_UNC_IN", "VTE_VEL_UNC_IN", "VTE_BIA_UNC_IN")]
        self._axes = [TargetFilter(*state, *variances) for state in zip(first.distances, velocity, bias, strict=True)]
        self._predicted_us = self._fused_us = now_us
        return True

    def _learn_bias(self, now_us: int, seen: Measurement) -> None:
        """A camera sees the target: as soon as the receiver's difference is known, distances are by the camera."""
        difference = self._difference(now_us, seen)
        if difference is None:
            if self._average is not None:
                self._restart(seen.distances, self._average.bias)
            elif self._relies_on == MISSION_POSITION:
                self._restart(seen.distances, NOTHING)
            return
        if self._average is None:
            if self._relies_on == MISSION_POSITION and self._averages():
                self._average = BiasAverage(seen.time_us, difference)
            else:
                self._restart(seen.distances, difference)
            return
        threshold_m, timeout_us = float(self._parameters["VTE_BIA_AVG_THR"]), self._us("VTE_BIA_AVG_TOUT")
        if self._average.is_done(seen.time_us, difference, threshold_m, timeout_us):
            bias = self._average.bias
            n, e, d = (
                seen_m + found - mean for seen_m, found, mean in zip(seen.distances, difference, bias, strict=True)
            )
            self._restart((n, e, d), bias)

    def _restart(self, distances: Vector3, bias: Vector3) -> None:
        variances = self._variance("VTE_POS_UNC_IN"), self._variance("VTE_BIA_UNC_IN")
        for axis, distance, its_bias in zip(self._axes, distances, bias, strict=True):
            axis.restart(distance, its_bias, *variances)
        self._bias_is_known, self._relies_on, self._average = True, 0, None

    def _receivers_recent(self, now_us: int) -> Measurement | None:
        given = self._by_receiver
        return given if given is not None and now_us - given.time_us < self._us("VTE_M_REC_TOUT") else None

    def _difference(self, now_us: int, seen: Measurement) -> Vector3 | None:
        """How much farther away the receiver has the target than the camera does, at the moment that it was seen."""
        given, local = self._receivers_recent(now_us), self._topics.vehicle_local_position
        if given is None:
            return None
        velocity = (local.vx, local.vy, local.vz) if local.v_xy_valid and local.v_z_valid else _velocity(self._gps)
        dt_s = (seen.time_us - given.time_us) * 1e-6
        n, e, d = (
            there - speed * dt_s - here
            for there, speed, here in zip(given.distances, velocity or NOTHING, seen.distances, strict=True)
        )
        return n, e, d

    def _averages(self) -> bool:
        return self._parameters["VTE_BIA_AVG_THR"] > 0.0 and self._parameters["VTE_BIA_AVG_TOUT"] > 0.0

    # --- out -----------------------------------------------------------------------------------------------

    def _tell(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        if now_us - self._fused_us < self._us("VTE_TGT_TOUT") and local.xy_valid and local.z_valid:
            north, east, down = self._axes
            self._topics.landing_target_pose = LandingTargetPose(
                now_us,
                local.x + north.distance_m,
                local.y + east.distance_m,
                local.z + down.distance_m,
                -north.speed_m_s,
                -east.speed_m_s,
                north.speed_variance,
                east.speed_variance,
                rel_vel_ekf2_valid=bool(self._seen_us) and now_us - self._seen_us < self._us("VTE_M_REC_TOUT"),
                x_rel=north.distance_m,
                y_rel=east.distance_m,
                z_rel=down.distance_m,
                rel_pos_valid=True,
            )

    def _variance(self, name: str) -> float:
        return max(float(self._parameters[name]), LEAST_VARIANCE)

    def _threshold(self) -> float:
        return max(float(self._parameters["VTE_POS_NIS_THRE"]), LEAST_THRESHOLD)

    def _us(self, name: str) -> float:
        return float(self._parameters[name]) * 1e6


def _velocity(gps: SensorGps) -> Vector3 | None:
    velocity = (gps.vel_n_m_s, gps.vel_e_m_s, gps.vel_d_m_s)
    return velocity if math.isfinite(sum(velocity)) else None


def way_to(gps: SensorGps, place: Place) -> Vector3:
    """Metres north, east and down to a place (get_vector_to_next_waypoint of PX4's geo.cpp)."""
    lat, lon, alt_m = place
    north = math.radians(lat - gps.latitude_deg) * EARTH_RADIUS_M
    east = math.radians(lon - gps.longitude_deg) * math.cos(math.radians(gps.latitude_deg)) * EARTH_RADIUS_M
    return north, east, gps.altitude_msl_m - alt_m
