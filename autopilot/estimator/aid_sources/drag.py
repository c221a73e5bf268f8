"""Wind from the drag of a multirotor's body and rotors (EKF2_DRAG_CTRL).

PX4's EKF2 (EKF/aid_sources/drag/drag_fusion.cpp, v1.18): specific force along body x and y is drag of bluff bodies
(EKF2_BCOEF_X, _Y) and momentum drag of rotors (EKF2_MCOEF), both of the air that comes towards the vehicle.
"""

import math
from typing import Final

import numpy as np

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import INITIAL_WIND_VARIANCE, Ekf
from sitl_emu.autopilot.estimator.samples import DragSample, ImuSample, SampleBuffer

GATE: Final = 5.0
LEAST_VARIANCE: Final = 0.5
AIR_DENSITY_SEA_LEVEL_KG_M3: Final = 1.225
LEAST_SAMPLES: Final = 5
LEAST_BCOEF: Final = 1.0
LEAST_MCOEF: Final = 0.001


class Drag:
    """Fed with IMU samples of the present; `air_density_kg_m3` is the barometer's."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.buffer: SampleBuffer[DragSample] = SampleBuffer(ekf.observation_buffer_length)
        self.aid = AidSource(2)
        self.air_density_kg_m3 = AIR_DENSITY_SEA_LEVEL_KG_M3
        self.wind_told = False
        """A command has told the wind, and it was not estimated since."""
        self._x = self._y = self._dt_s = 0.0
        self._time_sum_us = self._count = 0

    def gather(self, time_us: int, vx: float, vy: float, dt_s: float) -> None:
        """Add up velocity changes (m/s) until they make a sample."""
        self._x += vx
        self._y += vy
        self._dt_s += dt_s
        self._time_sum_us += time_us
        self._count += 1
        if self._count >= LEAST_SAMPLES:
            sample = DragSample(self._time_sum_us // self._count, (self._x / self._dt_s, self._y / self._dt_s))
            self.buffer.push(time_us, sample, 0)
            self._x = self._y = self._dt_s = 0.0
            self._time_sum_us = self._count = 0

    def control(self, imu: ImuSample) -> None:
        """One step of the filter."""
        ekf, flags = self._ekf, self._ekf.flags
        if not int(ekf.settings["EKF2_DRAG_CTRL"]) or not self.buffer.pushed_us:
            return
        if not flags.wind and not flags.fake_pos and flags.in_air:
            flags.wind = True
            if not self.wind_told:
                cov.uncorrelate(ekf.p, cov.WIND, (INITIAL_WIND_VARIANCE, INITIAL_WIND_VARIANCE))
        sample = self.buffer.pop(imu.time_us)
        if sample is not None:
            self._fuse(sample)

    def forget_wind(self) -> None:
        """Nothing shows the wind without drag, nor while the vehicle is only taken to be where it was.

        Once it is estimated a told one is none any more (controlAirDataFusion in EKF/aid_sources/airspeed).
        """
        ekf, flags = self._ekf, self._ekf.flags
        if flags.fake_pos or not int(ekf.settings["EKF2_DRAG_CTRL"]):
            flags.wind = False
        self.wind_told = self.wind_told and not flags.wind

    def _fuse(self, sample: DragSample) -> None:
        ekf, flags, value, state = self._ekf, self._ekf.flags, self._ekf.settings, self._ekf.state
        variance = max(value["EKF2_DRAG_NOISE"], LEAST_VARIANCE)
        density = max(self.air_density_kg_m3, 0.1)
        momentum = max(value["EKF2_MCOEF"] * math.sqrt(density / AIR_DENSITY_SEA_LEVEL_KG_M3), 0.0)
        ballistic = (value["EKF2_BCOEF_X"], value["EKF2_BCOEF_Y"])
        uses = [coefficient > LEAST_BCOEF or value["EKF2_MCOEF"] > LEAST_MCOEF for coefficient in ballistic]
        if not any(uses):
            return
        air = (state.vn - state.wind[0], state.ve - state.wind[1], state.vd)
        body, speed = state.to_body(*air), math.hypot(*air)
        inverse = _inverse_ballistic(ballistic, body)
        observation, innovation, told = [0.0, 0.0], [0.0, 0.0], [variance, variance]
        for axis in range(2):
            factor = 0.5 * inverse[axis] * density
            observation[axis] = sample.accel_xy[axis] - state.accel_bias[axis]
            innovation[axis] = -body[axis] * (factor * speed + momentum) - observation[axis]
            h = _jacobian(state.rotation, axis, air, body[axis], (factor, momentum, speed))
            ph, told[axis] = ekf.innovation_variance(h, variance)
            ratio = innovation[axis] ** 2 / (GATE**2 * told[axis])
            fusable = flags.in_air and flags.wind and not flags.fake_pos
            if uses[axis] and fusable and ratio < 1.0:
                ekf.fuse(ph, innovation[axis], told[axis])
        self.aid.update(sample.time_us, observation, (variance, variance), innovation, told, GATE)
        self.aid.fused, self.aid.time_last_fuse = True, ekf.time_us


def _inverse_ballistic(ballistic: tuple[float, float], body: tuple[float, float, float]) -> tuple[float, float]:
    """By axis; where both are known, one of an ellipse between them."""
    x, y = (1.0 / coefficient if coefficient > LEAST_BCOEF else 0.0 for coefficient in ballistic)
    across = math.hypot(body[0], body[1])
    if x and y and across > 0.0:
        mixed = math.hypot(x * body[0], y * body[1]) / across
        return mixed, mixed
    return x, y


def _jacobian(
    rotation: tuple[float, ...],
    axis: int,
    air: tuple[float, float, float],
    along: float,
    coefficients: tuple[float, float, float],
) -> cov.Matrix:
    """Of the force along a body axis, by attitude, velocity and wind."""
    factor, momentum, speed = coefficients
    rx, ry, rz = rotation[axis], rotation[3 + axis], rotation[6 + axis]
    n, e, d = air
    slope = -(factor * speed + momentum)
    radial = -factor * along / max(speed, 1e-6)
    h = np.zeros(cov.STATES)
    h[0:3] = (slope * (ry * d - rz * e), slope * (rz * n - rx * d), slope * (rx * e - ry * n))
    h[3:6] = (slope * rx + radial * n, slope * ry + radial * e, slope * rz + radial * d)
    h[cov.WIND : cov.TERRAIN] = -h[3:5]
    return h
