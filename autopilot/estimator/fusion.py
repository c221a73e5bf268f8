"""One step of the filter: predict, then every aid in PX4's order, then the output follows.

PX4's EKF2 (EKF/control.cpp, controlFusionModes, and Ekf::update in EKF/ekf.cpp, v1.18).
"""

import math
from collections import deque
from typing import Final

from sitl_emu.autopilot.estimator.aid_sources.aux_global_position import AuxGlobalPosition
from sitl_emu.autopilot.estimator.aid_sources.auxiliary_velocity import AuxiliaryVelocity
from sitl_emu.autopilot.estimator.aid_sources.baro_height import BaroHeight
from sitl_emu.autopilot.estimator.aid_sources.drag import Drag
from sitl_emu.autopilot.estimator.aid_sources.external_vision import ExternalVision
from sitl_emu.autopilot.estimator.aid_sources.fake_height import FakeHeight
from sitl_emu.autopilot.estimator.aid_sources.fake_position import FakePosition
from sitl_emu.autopilot.estimator.aid_sources.gnss import Gnss
from sitl_emu.autopilot.estimator.aid_sources.gnss_height import GnssHeight
from sitl_emu.autopilot.estimator.aid_sources.gravity import Gravity
from sitl_emu.autopilot.estimator.aid_sources.magnetometer import Magnetometer
from sitl_emu.autopilot.estimator.aid_sources.optical_flow import OpticalFlow
from sitl_emu.autopilot.estimator.aid_sources.range_height import RangeHeight
from sitl_emu.autopilot.estimator.aid_sources.zero_velocity import ZeroGyro, ZeroVelocity
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.height_control import (
    GROUND,
    PRESSURE,
    SATELLITES,
    DeadReckoning,
    VerticalAid,
    check_vertical_acceleration,
    find_height_reference,
)
from sitl_emu.autopilot.estimator.samples import ImuSample, SampleBuffer, SystemFlags
from sitl_emu.autopilot.topics import Vector3

LOOK_AFTER_STEPS: Final = 4
"""What needs no sample is looked after every so many steps (ours; PX4 looks after all of it at each)."""
LATE_US: Final = 200_000
"""An aid without a sample for so long is looked after as well: time-outs of the aids are twice that and more."""
ALIGNED_RAD2: Final = math.radians(3.0) ** 2


class Fusion:
    """The filter and all that aids it."""

    def __init__(self, ekf: Ekf) -> None:
        self.ekf = ekf
        self._imu: deque[ImuSample] = deque(maxlen=ekf.imu_buffer_length)
        self.system_flags: SampleBuffer[SystemFlags] = SampleBuffer(ekf.observation_buffer_length)
        self.magnetometer, self.flow, self.gnss = Magnetometer(ekf), OpticalFlow(ekf), Gnss(ekf)
        self.auxiliary, self.drag, self.baro = AuxGlobalPosition(ekf), Drag(ekf), BaroHeight(ekf)
        self.gnss_height, self.range = GnssHeight(ekf, self.gnss), RangeHeight(ekf)
        self.gravity, self.vision = Gravity(ekf), ExternalVision(ekf)
        self.auxiliary_velocity = AuxiliaryVelocity(ekf)
        self.zero_velocity, self.zero_gyro = ZeroVelocity(ekf), ZeroGyro(ekf)
        self.fake_position, self.fake_height = FakePosition(ekf), FakeHeight(ekf)
        self._dead_reckoning = DeadReckoning(ekf)
        self._observation_interval_us = 0
        self._angle: Vector3 = (0.0, 0.0, 0.0)
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        self._dt_s, self._steps = 0.0, 0

    def on_imu(self, time_us: int, gyro: Vector3, accel: Vector3, dt_s: float) -> bool:
        """One sample of the present: rad/s, m/s². True: the filter has made a step."""
        ekf = self.ekf
        ekf.latest_us = time_us
        gx, gy, gz = gyro
        ax, ay, az = accel
        if int(ekf.settings["EKF2_DRAG_CTRL"]):
            self.drag.gather(time_us, ax * dt_s, ay * dt_s, dt_s)
        gx, gy, gz, ax, ay, az = gx * dt_s, gy * dt_s, gz * dt_s, ax * dt_s, ay * dt_s, az * dt_s
        ekf.output.update(gx, gy, gz, ax, ay, az, dt_s)
        sampler = ekf.down_sampler
        if not sampler.update(time_us, gx, gy, gz, ax, ay, az, dt_s):
            return False
        imu = self._imu
        imu.append(sampler.take())
        if len(imu) < ekf.imu_buffer_length:
            return False
        self._observation_interval_us = (time_us - imu[0].time_us) // (ekf.observation_buffer_length - 1)
        return self._step(imu[0])

    @property
    def observation_interval_us(self) -> int:
        """Samples of one sensor that follow each other faster can't be kept."""
        return self._observation_interval_us

    @property
    def half_step_us(self) -> int:
        """A sample is fused with the step in whose middle it lies."""
        return int(self.ekf.dt_s * 5e5)

    def _step(self, imu: ImuSample) -> bool:
        ekf = self.ekf
        if not ekf.begin_step(imu):
            return False
        self._control(imu)
        ekf.apply()
        state, value = ekf.state, ekf.settings
        ekf.output.correct(
            (ekf.latest_us - ekf.time_us) * 1e-6,
            imu.dt_s,
            state.q,
            (state.vn, state.ve, state.vd),
            (state.pn, state.pe, -state.alt),
            (state.gyro_bias, state.accel_bias),
            (value["EKF2_TAU_VEL"], value["EKF2_TAU_POS"]),
        )
        return True

    def _control(self, imu: ImuSample) -> None:
        """An aid is looked after when a sample of it has come to the horizon, and when its samples stay away."""
        ekf, time_us, flags = self.ekf, imu.time_us, self.ekf.flags
        self._gather(imu)
        looks_after = self._steps >= LOOK_AFTER_STEPS
        late_us = time_us - LATE_US if looks_after else 0
        if time_us >= self.system_flags.next_us:
            system = self.system_flags.pop(time_us)
            if system is not None:
                self._take_system_flags(system)
        if self.magnetometer.buffer.due(time_us, late_us):
            self.magnetometer.control(time_us)
        if self.flow.buffer.due(time_us, late_us):
            self.flow.control(imu)
        if self.gnss.buffer.due(time_us, late_us):
            self.gnss.control(imu)
            self.gnss_height.control()
        if self.auxiliary.sources:
            self.auxiliary.control(imu)
        if time_us >= self.drag.buffer.next_us:
            self.drag.control(imu)
        if self.baro.buffer.due(time_us, late_us):
            self.baro.control(time_us)
        if self.range.buffer.due(time_us, late_us):
            self.range.control(time_us)
        find_height_reference(ekf)
        if self.vision.buffer.due(time_us, late_us):
            self.vision.control(imu)
        if time_us >= self.auxiliary_velocity.buffer.next_us:
            self.auxiliary_velocity.control(time_us)
        if looks_after:
            self._look_after(imu)
        yaw_aiding = flags.mag_hdg or flags.mag_3d or flags.ev_yaw
        flags.heading_observable = yaw_aiding or ekf.north_east_aiding

    def _gather(self, imu: ImuSample) -> None:
        """Add up the IMU since the aids were last looked after."""
        (ax, ay, az), (vx, vy, vz) = imu.delta_angle, imu.delta_velocity
        x, y, z = self._angle
        self._angle = (x + ax, y + ay, z + az)
        x, y, z = self._velocity
        self._velocity = (x + vx, y + vy, z + vz)
        self._dt_s += imu.dt_s
        self._steps += 1

    def _look_after(self, imu: ImuSample) -> None:
        """What needs no sample: alignment, checks, what stands in for sensors, and for how long nothing has aided."""
        ekf, flags = self.ekf, self.ekf.flags
        gathered = ImuSample(imu.time_us, self._angle, self._velocity, self._dt_s)
        self._angle = self._velocity = (0.0, 0.0, 0.0)
        self._dt_s, steps, self._steps = 0.0, self._steps, 0
        if not flags.tilt_align:
            ekf.predict_covariance()
            flags.tilt_align = ekf.tilt_variance() < ALIGNED_RAD2
        self.gnss.follow(gathered, steps)
        check_vertical_acceleration(ekf, self._vertical_aids())
        self.drag.forget_wind()
        self.gravity.control(gathered, steps)
        self.range.control_terrain()
        self.range.update_terrain_validity(self.flow.aid.time_last_fuse)
        self.zero_velocity.control(imu.time_us)
        self.zero_gyro.control(gathered)
        self.fake_position.control()
        self.fake_height.control()
        still_us = max(self.zero_velocity.fused_us, self.fake_position.aid.time_last_fuse * flags.valid_fake_pos)
        self._dead_reckoning.update(self.flow.aid, flow_intended=self.flow.intended, still_us=still_us)
        ekf.was_in_air, ekf.was_at_rest = flags.in_air, flags.vehicle_at_rest

    def _take_system_flags(self, system: SystemFlags) -> None:
        ekf, flags = self.ekf, self.ekf.flags
        if system.in_air and not flags.in_air:
            flags.mag_aligned_in_flight = False
        flags.vehicle_at_rest, flags.in_air = system.at_rest, system.in_air
        if system.in_air:
            ekf.in_air_us = ekf.time_us
        else:
            ekf.on_ground_us = ekf.time_us
        if system.gnd_effect:
            flags.gnd_effect = True
            self.baro.ground_effect_us = ekf.time_us
            self.baro.update_ground_effect()
        flags.constant_pos = system.constant_pos

    def _vertical_aids(self) -> list[VerticalAid]:
        flags, aids = self.ekf.flags, []
        if flags.baro_hgt:
            aids.append(VerticalAid(PRESSURE, self.baro.aid))
        if flags.gps_hgt:
            aids.append(VerticalAid(SATELLITES, self.gnss_height.aid))
        if flags.gnss_vel:
            aids.append(VerticalAid(SATELLITES, self.gnss.vel, 2))
        if flags.rng_hgt:
            aids.append(VerticalAid(GROUND, self.range.aid, 0, -1.0))
        if flags.ev_hgt:
            aids.append(VerticalAid(GROUND, self.vision.height.aid))
        if flags.ev_vel:
            aids.append(VerticalAid(GROUND, self.vision.vel.aid, 2))
        return aids
