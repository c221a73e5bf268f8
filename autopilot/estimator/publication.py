"""What the estimator tells: rates, attitude, local and global position, status.

PX4's EKF2 (EKF2.cpp, output_predictor) and vehicle_angular_velocity (v1.18). Corrections of velocity and position fade
in with EKF2_TAU_VEL and EKF2_TAU_POS of 0.25 s.
"""

import math
from typing import NamedTuple

from autopilot.estimator.filter import (
    GPS_TIMEOUT_US,
    HEADING_RATIO,
    HEIGHT_RATIO,
    POSITION_RATIO,
    VELOCITY_RATIO,
    Filter,
)
from autopilot.estimator.imu_filter import LowPass2p, alpha
from autopilot.estimator.terrain import Terrain
from autopilot.topics import (
    NAN,
    EstimatorInnovations,
    EstimatorStatus,
    Topics,
    Vector3,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLocalPosition,
)

IMU_HZ = 250.0
KEEP = 1.0 - 0.008 / 0.25
"""Share of a correction that is still to come after the 8 ms between two local positions."""


class Fused(NamedTuple):
    """Which sensors aid at present."""

    gps: bool
    baro: bool
    mag: bool
    flow: bool
    vision: bool


class Publication:
    """Writer of vehicle_angular_velocity, vehicle_attitude, vehicle_local_position, vehicle_global_position,
    estimator_status and estimator_innovations, each when asked."""

    def __init__(self, topics: Topics, kalman: Filter, terrain: Terrain) -> None:
        self._topics, self._filter, self._terrain = topics, kalman, terrain
        self._eph = self._epv = self._evh = self._evv = NAN
        self._rates = self._rates_derivative = (0.0, 0.0, 0.0)
        self._vibration = (0.0, 0.0, 0.0)
        self.last_imu = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        """Gyro and accelerometer of the sample before."""
        self._gyro_cutoff_hz = 0.0
        self._gyro_filter = LowPass2p(IMU_HZ, self._gyro_cutoff_hz)

    def refresh(self) -> None:
        """Take over changed parameters."""
        settings = self._filter.settings
        if settings["IMU_GYRO_CUTOFF"] != self._gyro_cutoff_hz:
            self._gyro_cutoff_hz = settings["IMU_GYRO_CUTOFF"]
            self._gyro_filter = LowPass2p(IMU_HZ, self._gyro_cutoff_hz)
        self._derivative_alpha = alpha(settings["IMU_DGYRO_CUTOFF"], 1.0 / IMU_HZ)
        self._least_range_m = settings["EKF2_MIN_RNG"]

    def rates(self, now_us: int, gyro: Vector3, dt: float) -> None:
        """Body rates of one IMU sample, filtered, and their derivative."""
        bx, by, bz = self._filter.state.gyro_bias
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

    def attitude(self, now_us: int) -> None:
        """Attitude, as a quaternion and in Euler angles."""
        state = self._filter.state
        r00, _, _, r10, _, _, r20, r21, r22 = state.rotation
        pitch = math.asin(-r20 if -1.0 < r20 < 1.0 else math.copysign(1.0, -r20))
        euler = (math.atan2(r21, r22), pitch, math.atan2(r10, r00))
        self._topics.vehicle_attitude = VehicleAttitude(now_us, state.q, euler)

    def local_position(self, now_us: int) -> None:
        """Position, velocity and acceleration in the local frame, every 8 ms."""
        kalman = self._filter
        state, origin = kalman.state, kalman.origin
        an, ae, ad = state.accel
        valid, z_valid = kalman.xy_valid(now_us), kalman.z_valid(now_us)
        keep = KEEP
        svn, sve, svd, spn, spe, spd = kalman.smooth
        svn *= keep
        sve *= keep
        svd *= keep
        spn *= keep
        spe *= keep
        spd *= keep
        kalman.smooth = [svn, sve, svd, spn, spe, spd]
        down = state.pd + spd
        dist_bottom, dist_bottom_valid = NAN, False
        if self._terrain.valid(now_us):
            dist_bottom, dist_bottom_valid = max(self._terrain.down_m - down, self._least_range_m), True
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
            kalman.ref_alt_m,
            kalman.origin_us,
            dist_bottom,
            dist_bottom_valid,
            self._eph,
            self._epv,
            self._evh,
            self._evv,
            kalman.xy_reset_counter,
            kalman.z_reset_counter,
        )

    def global_position(self, now_us: int) -> None:
        """The last local position as a place on Earth."""
        origin = self._filter.origin
        if origin is None:
            return
        ref_alt_m = self._filter.ref_alt_m
        local = self._topics.vehicle_local_position
        lat, lon = origin.reproject(local.x, local.y)
        terrain_alt = ref_alt_m - self._terrain.down_m
        self._topics.vehicle_global_position = VehicleGlobalPosition(
            now_us, local.xy_valid, lat, lon, ref_alt_m - local.z, terrain_alt, self._eph, self._epv
        )

    def status(self, now_us: int, fused: Fused) -> None:
        """How the filter does, after a fusion."""
        kalman = self._filter
        vn, ve, vd, pn, pe, pd = kalman.covariance.diagonal()[3:9].tolist()
        self._eph, self._epv = math.sqrt(pn + pe), math.sqrt(pd)
        self._evh, self._evv = math.sqrt(vn + ve), math.sqrt(vd)
        self._topics.estimator_innovations = EstimatorInnovations(now_us, kalman.innovations.copy())
        ratios = kalman.ratios
        self._topics.estimator_status = EstimatorStatus(
            now_us,
            True,
            kalman.yaw_aligned,
            ratios[VELOCITY_RATIO],
            ratios[POSITION_RATIO],
            ratios[HEIGHT_RATIO],
            ratios[HEADING_RATIO],
            fused.gps,
            fused.baro,
            fused.mag,
            kalman.origin is not None and now_us - kalman.horizontal_aid_us > GPS_TIMEOUT_US,
            kalman.state.gyro_bias,
            kalman.state.accel_bias,
            self._measure_vibration(),
            kalman.horizontal_good_us,
            fused.flow,
            fused.vision,
            kalman.disabled,
        )

    def _measure_vibration(self) -> Vector3:
        """EKF2's three: coning, high-frequency gyro and accelerometer, from neighbouring samples."""
        imu = self._topics.sensor_combined
        (gx, gy, gz), (ax, ay, az) = self.last_imu
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
