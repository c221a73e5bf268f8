"""What the estimator tells the autopilot: rates, attitude, local and global position.

PX4's EKF2 (EKF2.cpp: PublishAttitude, PublishLocalPosition, PublishGlobalPosition, PublishWindEstimate) and
vehicle_angular_velocity (v1.18): rates are the raw gyro's, filtered (IMU_GYRO_NF*, _CUTOFF, IMU_DGYRO_CUTOFF), less the
bias.
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.fusion import Fusion
from sitl_emu.autopilot.estimator.imu_filter import LowPass2p, NotchedLowPass2p, alpha
from sitl_emu.autopilot.topics import (
    NAN,
    OdometryVariances,
    Topics,
    Vector3,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLocalPosition,
    WindEstimate,
)
from sitl_emu.core.attitude import rotated

IMU_HZ: Final = 250.0
SENSOR_RANGE: Final = 1
SENSOR_FLOW: Final = 2
"""vehicle_local_position.dist_bottom_sensor_bitfield."""
RANGE_MARGIN: Final = 0.9
FLOW_RATE_SHARE: Final = 0.5
ALIGNED_IN_FLIGHT_US: Final = 1_000_000
GYRO_FILTERS: Final = ("IMU_GYRO_CUTOFF", "IMU_GYRO_NF0_FRQ", "IMU_GYRO_NF0_BW", "IMU_GYRO_NF1_FRQ", "IMU_GYRO_NF1_BW")
SPREAD_EVERY_US: Final = 40_000
"""Accuracies are worked out so often (ours; PX4 does with each position)."""


class Publication:
    """Writer of vehicle_angular_velocity, vehicle_attitude, vehicle_local_position, vehicle_global_position, wind."""

    def __init__(self, topics: Topics, fusion: Fusion) -> None:
        self._topics, self._fusion, self._ekf = topics, fusion, fusion.ekf
        self._rates: Vector3 = (0.0, 0.0, 0.0)
        self._filtered: Vector3 = (0.0, 0.0, 0.0)
        """The rates before their bias is taken off."""
        self._rates_derivative: Vector3 = (0.0, 0.0, 0.0)
        self._spread = (NAN,) * 7
        """eph, epv, evh, evv, variances of heading, tilt and height above ground, as of a moment ago."""
        self._limited_to = (math.inf,) * 5
        self._spread_us = 0
        self._gyro_filters_hz: tuple[float, ...] = ()
        self._gyro_filter = LowPass2p(IMU_HZ, 0.0)
        self.refresh()

    def refresh(self) -> None:
        """Take over changed parameters."""
        value = self._ekf.settings
        filters_hz = tuple(float(value[name]) for name in GYRO_FILTERS)
        if filters_hz != self._gyro_filters_hz:
            self._gyro_filters_hz = filters_hz
            cutoff_hz, centre0_hz, width0_hz, centre1_hz, width1_hz = filters_hz
            notches = [(f, width) for f, width in ((centre0_hz, width0_hz), (centre1_hz, width1_hz)) if f > 0.0]
            self._gyro_filter = (
                NotchedLowPass2p(IMU_HZ, cutoff_hz, notches) if notches else LowPass2p(IMU_HZ, cutoff_hz)
            )
            self._gyro_filter.begin_at(*self._filtered)
        self._derivative_alpha = alpha(value["IMU_DGYRO_CUTOFF"], 1.0 / IMU_HZ)

    def rates(self, now_us: int, gyro: Vector3, dt: float) -> None:
        """Body rates of one raw gyro sample, filtered, and their derivative, which knows no bias."""
        bx, by, bz = self._ekf.state.gyro_bias
        x, y, z = filtered = self._gyro_filter.update(*gyro)
        lx, ly, lz = self._filtered
        dx, dy, dz = self._rates_derivative
        weight = self._derivative_alpha
        derivative = (
            dx + weight * ((x - lx) / dt - dx),
            dy + weight * ((y - ly) / dt - dy),
            dz + weight * ((z - lz) / dt - dz),
        )
        self._filtered, self._rates_derivative = filtered, derivative
        self._rates = rates = (x - bx, y - by, z - bz)
        self._topics.vehicle_angular_velocity = VehicleAngularVelocity(now_us, rates, derivative)

    def attitude(self, now_us: int) -> None:
        """Attitude, as a quaternion and in Euler angles."""
        output, resets = self._ekf.output, self._ekf.resets
        r00, _, _, r10, _, _, r20, r21, r22 = output.rotation
        pitch = math.asin(-r20 if -1.0 < r20 < 1.0 else math.copysign(1.0, -r20))
        euler = (math.atan2(r21, r22), pitch, math.atan2(r10, r00))
        self._topics.vehicle_attitude = VehicleAttitude(now_us, output.q, euler, resets.quat_change, resets.quat & 255)

    def local_position(self, now_us: int) -> None:
        """Position, velocity and acceleration in the local frame, with every step of the filter."""
        ekf, output, flags, resets = self._ekf, self._ekf.output, self._ekf.flags, self._ekf.resets
        x, y, down, vx, vy, vz, z_deriv = self._body_origin()
        ax, ay, az = output.acceleration
        valid = not ekf.horizontal_dead_reckoning_too_long
        z_valid = not (ekf.vertical_position_dead_reckoning_too_long and ekf.vertical_velocity_dead_reckoning_too_long)
        origin, ref_alt = ekf.origin, ekf.origin_alt
        has_origin = origin is not None
        z = down + (ref_alt if ref_alt == ref_alt else 0.0)
        if now_us >= self._spread_us:
            self._spread_us = now_us + SPREAD_EVERY_US
            p = ekf.p
            self._spread = (*self.accuracies(), float(p[2, 2]), ekf.tilt_variance(), ekf.hagl_variance())
            a, b, c, vn, ve, vd, n, e, d = p.diagonal()[: cov.GYRO_BIAS].tolist()
            self._topics.odometry_variances = OdometryVariances(now_us, (a, b, c), (vn, ve, vd), (n, e, d))
            self._limited_to = self._limits()
        eph, epv, evh, evv, heading_var, tilt_var, hagl_var = self._spread
        hagl_m = max(ekf.state.terrain - down, 0.0)
        (dw, _, _, dz) = resets.quat_change
        sensors = SENSOR_RANGE if flags.rng_terrain or flags.rng_hgt else 0
        sensors |= SENSOR_FLOW if flags.opt_flow_terrain else 0
        self._topics.vehicle_local_position = VehicleLocalPosition(
            now_us, now_us, valid, z_valid, valid, z_valid,
            x, y, z, resets.pos_ne_change, resets.pos_ne & 255, resets.pos_d_change, resets.pos_d & 255,
            vx, vy, vz, z_deriv, resets.vel_ne_change, resets.vel_ne & 255, resets.vel_d_change, resets.vel_d & 255,
            ax, ay, az,
            self._topics.vehicle_attitude.euler[2], heading_var, math.remainder(output.unaided_yaw, math.tau),
            2.0 * math.atan2(dz, dw), resets.quat & 255, self.heading_good_for_control(),
            tilt_var, has_origin, has_origin, ekf.origin_us if has_origin else 0,
            origin.lat0_deg if origin is not None else NAN, origin.lon0_deg if origin is not None else NAN,
            (ref_alt if ref_alt == ref_alt else 0.0) if has_origin else NAN,
            ekf.hagl_valid, hagl_m, hagl_var, resets.hagl_change, resets.hagl & 255, sensors,
            eph, epv, evh, evv, flags.inertial_dead_reckoning or flags.wind_dead_reckoning, *self._limited_to,
        )  # fmt: skip

    def _body_origin(self) -> tuple[float, float, float, float, float, float, float]:
        """Position (down: below sea level), velocity and z_deriv of the body's origin, which EKF2_IMU_POS_* tell."""
        output = self._ekf.output
        if not any(self._ekf.imu_position):
            return output.pn, output.pe, output.pd, output.vn, output.ve, output.vd, output.z_deriv
        place = x, y, z = self._ekf.imu_position
        gx, gy, gz = self._rates
        n, e, d = rotated(output.rotation, place)
        vn, ve, vd = rotated(output.rotation, (gy * z - gz * y, gz * x - gx * z, gx * y - gy * x))
        return (
            output.pn - n, output.pe - e, output.pd - d,
            output.vn - vn, output.ve - ve, output.vd - vd, output.z_deriv - vd,
        )  # fmt: skip

    def heading_good_for_control(self) -> bool:
        """Aligned; where a compass gives the heading, a second after that was done in flight."""
        ekf, flags = self._ekf, self._ekf.flags
        if not flags.yaw_align or not (flags.mag_hdg or flags.mag_3d):
            return flags.yaw_align
        aligned_us = self._fusion.magnetometer.aligned_us
        return flags.mag_aligned_in_flight and ekf.time_us - aligned_us > ALIGNED_IN_FLIGHT_US

    def accuracies(self) -> tuple[float, float, float, float]:
        """eph, epv, evh, evv; where nothing was fused for too long, innovations tell more than variances."""
        ekf, flags, fusion, p = self._ekf, self._ekf.flags, self._fusion, self._ekf.p
        eph, evh = math.sqrt(p[6, 6] + p[7, 7]), math.sqrt(p[3, 3] + p[4, 4])
        if ekf.horizontal_dead_reckoning_too_long:
            if flags.gnss_pos:
                eph = max(eph, math.hypot(*fusion.gnss.pos.innovation))
                evh = max(evh, math.hypot(*fusion.gnss.pos.innovation))
            if flags.ev_pos:
                eph = max(eph, math.hypot(*fusion.vision.pos.aid.innovation))
                evh = max(evh, math.hypot(*fusion.vision.pos.aid.innovation))
            if flags.gnss_vel:
                evh = max(evh, math.hypot(*fusion.gnss.vel.innovation))
            if flags.ev_vel:
                evh = max(evh, math.hypot(*fusion.vision.vel.aid.innovation))
            if flags.opt_flow:
                clearance = max(ekf.settings["EKF2_MIN_RNG"], 0.1)
                evh = max(evh, max(ekf.hagl_m, clearance) * math.hypot(*fusion.flow.aid.innovation))
        return eph, math.sqrt(p[cov.HEIGHT, cov.HEIGHT]), evh, math.sqrt(p[5, 5])

    def _limits(self) -> tuple[float, float, float, float, float]:
        """vxy_max, vz_max, hagl_min, hagl_max_z, hagl_max_xy: what sensors in use allow; infinite: anything."""
        ekf, flags = self._ekf, self._ekf.flags
        unlimited = (math.inf,) * 5
        relies_on_range = flags.rng_hgt and ekf.flags.vertical_position_aids() == 1
        relies_on_flow = flags.opt_flow and not ekf.flags.other_horizontal_aid(True)
        if not relies_on_range and not relies_on_flow:
            return unlimited
        range_min, range_max = self._fusion.range.sensor.limits_m
        hagl_min, hagl_max_z, hagl_max_xy, vxy_max = math.inf, math.inf, math.inf, math.inf
        if relies_on_range:
            hagl_min, hagl_max_z = range_min, RANGE_MARGIN * range_max
        if relies_on_flow:
            fastest, nearest, farthest = self._fusion.flow.limits
            if (not flags.opt_flow_terrain and flags.rng_terrain) or not ekf.terrain_valid:
                nearest, farthest = max(nearest, range_min), min(farthest, RANGE_MARGIN * range_max)
            vxy_max = FLOW_RATE_SHARE * fastest * min(max(ekf.hagl_m, nearest), farthest)
            hagl_min, hagl_max_xy = nearest, max(farthest * 0.9, farthest - 1.0)
        return vxy_max, math.inf, hagl_min, hagl_max_z, hagl_max_xy

    def global_position(self, now_us: int) -> None:
        """The last local position as a place on Earth."""
        ekf, origin = self._ekf, self._ekf.origin
        if origin is None or not ekf.flags.yaw_align:
            return
        local, resets = self._topics.vehicle_local_position, ekf.resets
        lat, lon = origin.reproject(local.x, local.y)
        alt = local.ref_alt - local.z
        alt_valid = math.isfinite(ekf.origin_alt) and not ekf.vertical_position_dead_reckoning_too_long
        self._topics.vehicle_global_position = VehicleGlobalPosition(
            now_us,
            now_us,
            lat,
            lon,
            alt,
            alt,
            local.xy_valid,
            alt_valid,
            eph=local.eph,
            epv=local.epv,
            terrain_alt=-ekf.state.terrain,
            terrain_alt_valid=ekf.terrain_valid,
            dead_reckoning=local.dead_reckoning,
            delta_alt=-resets.pos_d_change,
            delta_terrain=-resets.hagl_change,
            lat_lon_reset_counter=resets.pos_ne & 255,
            alt_reset_counter=resets.pos_d & 255,
            terrain_reset_counter=resets.hagl & 255,
        )

    def wind(self, now_us: int) -> None:
        """Wind, where it is estimated or was told."""
        ekf = self._ekf
        if ekf.flags.wind or self._fusion.drag.wind_told:
            north, east = ekf.state.wind
            self._topics.wind = WindEstimate(now_us, north, east, ekf.variance(cov.WIND), ekf.variance(cov.WIND + 1))
