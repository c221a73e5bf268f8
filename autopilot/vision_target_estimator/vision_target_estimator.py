"""Where the target of a precision landing is, by what the vehicle itself knows: PX4's vision_target_estimator (v1.18).

It runs while a precision landing is flown (VTE_EN, VTE_POS_EN, VTE_TASK_MASK 1), on a target that stands. That is where
the mission's landing is to be, seen from the receiver's position (VTE_AID_MASK 8), with the receiver's velocity (2).
Fifty times a second it says where the target is, in the same topic as the targets that LANDING_TARGET tells of, and as
it does so more often, a mission lands where its item says. Without a landing in navigator_mission_item, as in
AUTO_PRECLAND after a takeoff, it says nothing.

Left out: what a camera sees (TARGET_RELATIVE, 4), and so the receiver's bias; the target's own receiver (1, 16); its
yaw (VTE_YAW_EN). A measurement is fused as it comes: PX4 looks up the state of then where it is older than 20 ms.
"""

import math
from typing import Final

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import LandingTargetPose, SensorGps, Topics, Vector3
from sitl_emu.autopilot.vision_target_estimator.target_filter import TargetFilter
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32
from sitl_emu.core.geodesy import EARTH_RADIUS_M

LOOKS_EVERY_US: Final = 200_000
"""While there is nothing to do (VisionTargetEst::Run)."""
LONGEST_STEP_US: Final = 100_000
"""After a longer one the filter begins anew (VTEPosition::update)."""
PRECISION_LANDING, RECEIVER_VELOCITY, MISSION_POSITION = 1, 2, 8
"""Bits of VTE_TASK_MASK and VTE_AID_MASK."""
PREC_LAND_STALE_US: Final = 500_000
"""A precision landing that has said nothing for so long is over; ours, PX4's says so."""
LEAST_VARIANCE, LEAST_NOISE, LEAST_THRESHOLD = 1e-6, 1e-2, 0.1
"""kMinVariance, kMinObservationNoise, kMinNisThreshold (common.h)."""
Place = tuple[float, float, float]
"""Degrees and m AMSL."""


class VisionTargetEstimator:
    """Writer of landing_target_pose, beside LANDING_TARGET."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._is_enabled = bool(parameters["VTE_EN"]) and bool(parameters["VTE_POS_EN"])
        self._looked_us = 0
        self._runs = False
        self._place: Place | None = None
        self._gps = topics.sensor_gps
        self._axes: list[TargetFilter] = []
        """North, east, down; none before the first measurement."""
        self._predicted_us = self._fused_us = 0

    def update(self, now_us: int) -> None:
        """At 50 Hz, after the navigator."""
        if not self._is_enabled or (not self._runs and now_us - self._looked_us < LOOKS_EVERY_US):
            return
        self._looked_us = now_us
        if not self._is_wanted(now_us):
            self._runs, self._axes = False, []
            return
        if not self._runs:
            self._runs, self._place, self._gps = True, None, self._topics.sensor_gps
        self._place = self._place or self._landing()
        if self._axes:
            self._predict(now_us)
        if self._topics.sensor_gps is not self._gps:
            self._gps = self._topics.sensor_gps
            self._fuse(now_us, self._gps)
        if self._axes:
            self._tell(now_us)

    def _is_wanted(self, now_us: int) -> bool:
        status, topics = self._topics.prec_land_status, self._topics
        is_flown = status.runs and now_us - status.timestamp < PREC_LAND_STALE_US
        is_task = int(self._parameters["VTE_TASK_MASK"]) & PRECISION_LANDING
        return bool(is_task and is_flown and not topics.vehicle_land_detected.landed)

    def _landing(self) -> Place | None:
        """Of the item that was flown last, however long ago; its place comes as float32, 0.4 m beside it at worst."""
        item, home = self._topics.navigator_mission_item, self._topics.home_position
        alt_m = item.altitude + (home.alt if item.altitude_is_relative else 0.0)
        if item.nav_cmd != mavlink.MAV_CMD_NAV_LAND or not math.isfinite(item.latitude + item.longitude + alt_m):
            return None
        return float32(item.latitude), float32(item.longitude), float32(alt_m)

    def _predict(self, now_us: int) -> None:
        dt_us, self._predicted_us = now_us - self._predicted_us, now_us
        timeout_us = float(self._parameters["VTE_BTOUT"]) * 1e6
        if dt_us > LONGEST_STEP_US or now_us - self._fused_us >= timeout_us:
            self._axes = []
            return
        local = self._topics.vehicle_local_position
        noise = max(float(self._parameters["VTE_ACC_D_UNC"]), LEAST_VARIANCE)
        for axis, acceleration in zip(self._axes, (local.ax, local.ay, local.az), strict=True):
            axis.predict(dt_us * 1e-6, acceleration, noise)

    def _fuse(self, now_us: int, gps: SensorGps) -> None:
        aids, get = int(self._parameters["VTE_AID_MASK"]), self._parameters
        velocity = (gps.vel_n_m_s, gps.vel_e_m_s, gps.vel_d_m_s)
        knows_velocity = math.isfinite(sum(velocity))
        threshold = max(float(get["VTE_POS_NIS_THRE"]), LEAST_THRESHOLD)
        if aids & MISSION_POSITION and self._place is not None:
            distances = way_to(gps, self._place)
            if not math.isfinite(sum(distances)):
                return
            if not self._axes:
                if not knows_velocity:
                    return
                self._begin(now_us, distances, velocity)
            least = max(float(get["VTE_GPS_P_NOISE"]), LEAST_NOISE)
            horizontal, vertical = max(least, gps.eph) ** 2, max(least, gps.epv) ** 2  # NaN counts as the least
            variances = (horizontal, horizontal, vertical)
            fused = [
                axis.fuse_distance(distance, variance, threshold)
                for axis, distance, variance in zip(self._axes, distances, variances, strict=True)
            ]
            self._fused_us = now_us if any(fused) else self._fused_us
        if aids & RECEIVER_VELOCITY and knows_velocity:
            variance = max(LEAST_NOISE, float(get["VTE_GPS_V_NOISE"]), gps.s_variance_m_s) ** 2
            for axis, speed in zip(self._axes, velocity, strict=False):
                axis.fuse_speed(speed, variance, threshold)

    def _begin(self, now_us: int, distances: Vector3, velocity: Vector3) -> None:
        get = self._parameters
        of_distance = max(float(get["VTE_POS_UNC_IN"]), LEAST_VARIANCE)
        of_speed = max(float(get["VTE_VEL_UNC_IN"]), LEAST_VARIANCE)
        self._axes = [
            TargetFilter(distance, speed, of_distance, of_speed)
            for distance, speed in zip(distances, velocity, strict=True)
        ]
        self._predicted_us = self._fused_us = now_us

    def _tell(self, now_us: int) -> None:
        local = self._topics.vehicle_local_position
        is_recent = now_us - self._fused_us < float(self._parameters["VTE_TGT_TOUT"]) * 1e6
        if is_recent and local.xy_valid and local.z_valid:
            north, east, down = (axis.distance_m for axis in self._axes)
            pose = LandingTargetPose(now_us, local.x + north, local.y + east, local.z + down)
            self._topics.landing_target_pose = pose


def way_to(gps: SensorGps, place: Place) -> Vector3:
    """Metres north, east and down to a place (get_vector_to_next_waypoint of PX4's geo.cpp)."""
    lat, lon, alt_m = place
    north = math.radians(lat - gps.latitude_deg) * EARTH_RADIUS_M
    east = math.radians(lon - gps.longitude_deg) * math.cos(math.radians(gps.latitude_deg)) * EARTH_RADIUS_M
    return north, east, gps.altitude_msl_m - alt_m
