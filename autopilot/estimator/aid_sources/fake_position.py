"""Where nothing aids horizontally: the vehicle is taken to be where it was, loosely in flight, firmly at rest.

PX4's EKF2 (EKF/aid_sources/fake_pos_control.cpp, v1.18).
"""

import math
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.resets import reset_horizontal_position, reset_horizontal_velocity
from sitl_emu.core.geodesy import MapProjection

EVERY_US: Final = 200_000
FAILING_US: Final = 400_000
GATE: Final = 3.0
REST_NOISE_M: Final = 0.01
MOVING_NOISE_M: Final = 0.5
LEAST_FLYING_NOISE_M: Final = 1.0
WELL_ALIGNED_RAD2: Final = math.radians(3.0) ** 2
UNKNOWN_VELOCITY_VARIANCE: Final = 25.0
FROM_ZERO: Final = MapProjection(0.0, 0.0)
"""Where places are counted from before there is an origin (getLocalHorizontalPosition in EKF/position_fusion.cpp)."""


class FakePosition:
    """Two flags share it: `valid_fake_pos` while it is known to be at rest, `fake_pos` otherwise."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(2)

    def control(self) -> None:
        """One step of the filter."""
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if ekf.flags.horizontal_aiding:
            flags.fake_pos = flags.valid_fake_pos = False
            return
        if not ekf.timed_out(aid.time_last_fuse, EVERY_US):
            return
        noise = MOVING_NOISE_M
        if flags.in_air and flags.tilt_align:
            noise = max(ekf.settings["EKF2_NOAID_NOISE"], LEAST_FLYING_NOISE_M)
        elif not flags.in_air and flags.vehicle_at_rest:
            noise = REST_NOISE_M
        variance, state, known = noise * noise, ekf.state, ekf.last_known_position
        innovation = (state.pn - known[0], state.pe - known[1])
        variances = (ekf.variance(cov.POSITION) + variance, ekf.variance(cov.POSITION + 1) + variance)
        place = (ekf.origin or FROM_ZERO).reproject(state.pn, state.pe)
        aid.update(ekf.time_us, place, (variance, variance), innovation, variances, GATE)
        valid = flags.constant_pos or flags.vehicle_at_rest
        loose = (
            not valid
            and ekf.tilt_variance() > WELL_ALIGNED_RAD2
            and not flags.gravity_vector
            and ekf.horizontal_dead_reckoning_too_long
        )
        flags.fake_pos = self._run(loose, flags.fake_pos)
        flags.valid_fake_pos = self._run(valid, flags.valid_fake_pos)
        ekf.apply()

    def _run(self, enabled: bool, running: bool) -> bool:
        ekf, aid = self._ekf, self.aid
        if not enabled:
            return False
        if not running:
            self._reset()
            return True
        if not aid.innovation_rejected:
            measured = zip(aid.innovation, aid.innovation_variance, aid.observation_variance, strict=True)
            for index, (innovation, innovation_variance, variance) in enumerate(measured, cov.POSITION):
                ekf.fuse_state(index, innovation, innovation_variance, variance)
            aid.fused, aid.time_last_fuse = True, ekf.time_us
        if ekf.timed_out(aid.time_last_fuse, FAILING_US):
            self._reset()
        return True

    def _reset(self) -> None:
        ekf = self._ekf
        ekf.apply()
        ekf.last_known_position = (ekf.state.pn, ekf.state.pe)
        ekf.events.add("reset_pos_to_last_known")
        variance = ekf.settings["EKF2_NOAID_NOISE"] ** 2
        reset_horizontal_position(ekf, ekf.last_known_position, (variance, variance))
        ekf.events.add("reset_vel_to_zero")
        reset_horizontal_velocity(ekf, (0.0, 0.0), (UNKNOWN_VELOCITY_VARIANCE, UNKNOWN_VELOCITY_VARIANCE))
        self.aid.time_last_fuse = ekf.time_us
