"""Which sensor heights refer to, whether the accelerometer can be trusted, and for how long nothing has aided.

PX4's EKF2 (EKF/height_control.cpp; updateDeadReckoningStatus in EKF/ekf_helper.cpp, v1.18). Simulated accelerometers
don't clip: what PX4 does when one rails is left out.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import BARO, EV, GNSS, NO_AID_TIMEOUT_US, RANGE, UNKNOWN, Ekf

BAD_ACCEL_PROBATION_US: Final = 3_000_000
FAILS_BEYOND: Final = 3.0
CONFIRMS_BEYOND: Final = 1.0
"""Standard deviations of an innovation that says the filter falls."""
FALLBACKS = {
    BARO: (BARO, GNSS, EV, RANGE),
    GNSS: (GNSS, BARO, EV, RANGE),
    RANGE: (RANGE, EV, BARO, GNSS),
    EV: (EV, RANGE, BARO, GNSS),
}
PRESSURE: Final = 0
SATELLITES: Final = 1
GROUND: Final = 2


class VerticalAid(NamedTuple):
    """What tells of the height, by kind: kinds that agree can't both be wrong."""

    kind: int
    aid: AidSource
    axis: int = 0
    sign: float = 1.0
    """-1: it measures up."""


def check_vertical_acceleration(ekf: Ekf, aids: list[VerticalAid]) -> None:
    """An accelerometer that is wrong makes the filter fall: two kinds of height say so together."""
    ratios = []
    for kind, aid, axis, sign in aids:
        variance = aid.innovation_variance[axis]
        if variance > 0.0:
            ratios.append((kind, sign * aid.innovation[axis] / math.sqrt(variance)))
    falling = any(
        first > FAILS_BEYOND and second > CONFIRMS_BEYOND and kind != other
        for kind, first in ratios
        for other, second in ratios
    )
    if falling:
        ekf.bad_vertical_accel_us = ekf.time_us
    else:
        ekf.good_vertical_accel_us = ekf.time_us
    faults = ekf.faults
    if faults.bad_acc_vertical:
        faults.bad_acc_vertical = ekf.recent(ekf.bad_vertical_accel_us, BAD_ACCEL_PROBATION_US)
    else:
        faults.bad_acc_vertical = falling


def refer_heights_to(ekf: Ekf, sensor: int) -> None:
    """The height's reference becomes `sensor`. Steps not predicted yet were made under the old one, and under all but
    RANGE the ground gets more uncertain."""
    if ekf.height_reference != sensor and RANGE in (ekf.height_reference, sensor):
        ekf.predict_covariance()
    ekf.height_reference = sensor


def find_height_reference(ekf: Ekf) -> None:
    """Where the reference is lost, the next best that is in use takes over."""
    if ekf.height_reference != UNKNOWN:
        return
    flags = ekf.flags
    in_use = {BARO: flags.baro_hgt, GNSS: flags.gps_hgt, RANGE: flags.rng_hgt, EV: flags.ev_hgt}
    for sensor in FALLBACKS.get(int(ekf.settings["EKF2_HGT_REF"]), FALLBACKS[GNSS]):
        if in_use[sensor]:
            refer_heights_to(ekf, sensor)
            return


class DeadReckoning:
    """For how long nothing has held position and velocity: after EKF2_NOAID_TOUT they are not valid any more."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        self._horizontal_us = self._position_d_us = self._velocity_d_us = 0

    def update(self, flow: AidSource, *, flow_intended: bool, still_us: int) -> None:
        """One step; `still_us`: when standstill was last fused, which counts where flow will aid in the air."""
        self._update_horizontal(flow, flow_intended=flow_intended, still_us=still_us)
        self._update_vertical()

    def _update_horizontal(self, flow: AidSource, *, flow_intended: bool, still_us: int) -> None:
        ekf, flags, recent = self._ekf, self._ekf.flags, self._ekf.recent
        velocity = (flags.gnss_vel or flags.ev_vel) and recent(ekf.hor_vel_fused_us, NO_AID_TIMEOUT_US)
        places = flags.gnss_pos or flags.ev_pos or flags.aux_gpos
        position = places and recent(ekf.hor_pos_fused_us, NO_AID_TIMEOUT_US)
        lost = not velocity and not position
        if flags.opt_flow and recent(flow.time_last_fuse, NO_AID_TIMEOUT_US):
            lost = False
        elif lost and not flags.in_air and flow_intended and recent(flow.timestamp_sample, NO_AID_TIMEOUT_US):
            lost = not recent(still_us, NO_AID_TIMEOUT_US)
        if not lost:
            if ekf.time_us > NO_AID_TIMEOUT_US:
                self._horizontal_us = ekf.time_us - NO_AID_TIMEOUT_US
            ekf.horizontal_dead_reckoning_too_long = False
        elif ekf.timed_out(self._horizontal_us, ekf.settings["EKF2_NOAID_TOUT"]):
            ekf.horizontal_dead_reckoning_too_long = True
        flags.inertial_dead_reckoning = lost

    def _update_vertical(self) -> None:
        ekf = self._ekf
        timeout_us = ekf.settings["EKF2_NOAID_TOUT"]
        if ekf.flags.vertical_position_aids():
            self._position_d_us = ekf.hgt_fused_us
            ekf.vertical_position_dead_reckoning_too_long = False
        elif ekf.timed_out(self._position_d_us, timeout_us):
            ekf.vertical_position_dead_reckoning_too_long = True
        if ekf.flags.vertical_velocity_aiding:
            self._velocity_d_us = ekf.ver_vel_fused_us
            ekf.vertical_velocity_dead_reckoning_too_long = False
        elif ekf.timed_out(self._velocity_d_us, timeout_us) and ekf.vertical_position_dead_reckoning_too_long:
            ekf.vertical_velocity_dead_reckoning_too_long = True
