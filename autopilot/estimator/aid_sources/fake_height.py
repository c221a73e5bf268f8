"""Where nothing aids vertically: the height is taken to be what it was.

PX4's EKF2 (EKF/aid_sources/fake_height_control.cpp, v1.18).
"""

from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import Ekf
from sitl_emu.autopilot.estimator.resets import reset_altitude, reset_vertical_velocity_to_zero

EVERY_US: Final = 200_000
FAILING_US: Final = 400_000
GATE: Final = 3.0
LARGEST_TEST_RATIO: Final = (100.0 / GATE) ** 2


class FakeHeight:
    """Begins when neither height nor vertical velocity have been aided for EKF2_NOAID_TOUT."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self.aid = AidSource(1)

    def control(self) -> None:
        """One step of the filter."""
        ekf, flags, aid = self._ekf, self._ekf.flags, self.aid
        if ekf.flags.vertical_aiding:
            flags.fake_hgt = False
            return
        if not ekf.timed_out(aid.time_last_fuse, EVERY_US):
            return
        variance = ekf.settings["EKF2_NOAID_NOISE"] ** 2
        ekf.update_height_aid(aid, ekf.time_us, -ekf.last_known_alt, variance, GATE)
        if flags.fake_hgt:
            if aid.test_ratio[0] < LARGEST_TEST_RATIO and not aid.innovation_rejected:
                ekf.fuse_state(cov.HEIGHT, aid.innovation[0], aid.innovation_variance[0], variance)
                aid.fused, aid.time_last_fuse = True, ekf.time_us
                ekf.apply()
            if ekf.timed_out(aid.time_last_fuse, FAILING_US):
                self._reset()
        elif ekf.vertical_velocity_dead_reckoning_too_long and ekf.vertical_position_dead_reckoning_too_long:
            flags.fake_hgt = True
            self._reset()

    def _reset(self) -> None:
        ekf = self._ekf
        ekf.last_known_alt = ekf.state.alt
        reset_vertical_velocity_to_zero(ekf)
        ekf.events.add("reset_pos_to_last_known")
        reset_altitude(ekf, ekf.last_known_alt, ekf.settings["EKF2_NOAID_NOISE"] ** 2)
        self.aid.time_last_fuse = ekf.time_us
