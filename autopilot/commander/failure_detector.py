"""Attitudes that no flight needs: tilted further than FD_FAIL_R, FD_FAIL_P for FD_FAIL_R_TTRI, FD_FAIL_P_TTRI. A
multicopter that sinks where it ought to climb: by FD_ALT_LOSS (0: nobody looks) for FD_ALT_LOSS_T. An airframe that
shakes more sideways than up and down by FD_IMB_PROP_THR (0: nobody looks), as one with a propeller out of balance does.
And which motors an injected failure has stopped: the allocator learns it by this status.

PX4's FailureDetector and FailureInjector (src/modules/commander/failure_detector, v1.18). It looks in every mode that
controls attitude, on the ground as in the air. What follows is in arming_checks/failure_detector.py and failsafe.py.

Left out: an external trigger (FD_EXT_ATS_EN).
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.control_mode import asked_for
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import modes_where
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.system.failure_injection import MOTOR, OFF
from sitl_emu.autopilot.topics import FailureDetectorStatus, FailureInjection, Topics
from sitl_emu.autopilot.vehicle_kind import ROTARY_WING

STATUS_EVERY_US: Final = 500_000
MOTORS: Final = 12
"""esc_status's CONNECTED_ESC_MAX."""
IMBALANCE_TIME_CONSTANT_S: Final = 5.0
WITHOUT_ATTITUDE = modes_where(lambda mode: not mode.control.attitude)


class FailureDetector:
    """Writer of failure_detector_status."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._version = -1
        self._good_us = [0, 0, 0]
        """When roll, pitch and altitude were last within their limits."""
        self._highest_z = math.nan
        """Where a vehicle below its setpoint was highest, not above that."""
        self._z_resets = 0
        self._imbalance = 0.0
        self._imu_us = 0
        self._told_us = -STATUS_EVERY_US

    def update(self, now_us: int) -> None:
        """At the commander's rate."""
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._copy_parameters()
        topics = self._topics
        roll, pitch, _ = topics.vehicle_attitude.euler
        nav_state = topics.vehicle_status.nav_state
        in_offboard = nav_state is NavState.OFFBOARD
        watches = asked_for(topics.offboard_setpoint).attitude if in_offboard else nav_state not in WITHOUT_ATTITUDE
        roll_limit, pitch_limit = self._limits_rad
        fd_roll = self._failed(now_us, 0, watches and 0.0 < roll_limit < abs(roll))
        fd_pitch = self._failed(now_us, 1, watches and 0.0 < pitch_limit < abs(pitch))
        fd_alt = self._failed(now_us, 2, self._sinks(watches=watches))
        if self._imbalance_limit > 0.0:
            self._watch_balance()
        imbalanced = self._imbalance > self._imbalance_limit > 0.0
        status = topics.failure_detector_status
        found = (fd_roll, fd_pitch, fd_alt, imbalanced)
        if found != status[1:5] or now_us - self._told_us >= STATUS_EVERY_US:
            self._told_us = now_us
            flags = topics.failsafe_flags
            motors_failed = topics.esc_status.online_flags if flags.fd_motor_failure else 0
            topics.failure_detector_status = FailureDetectorStatus(
                now_us,
                *found,
                self._imbalance,
                flags.fd_esc_arming_failure or flags.fd_motor_failure,
                flags.fd_motor_failure,
                motors_failed,
                _stopped_motors(topics.failure_injection),
            )

    def _sinks(self, *, watches: bool) -> bool:
        """It has lost more height than it may, below a setpoint that controls its height."""
        topics = self._topics
        status, local = topics.vehicle_status, topics.vehicle_local_position
        wanted_z = topics.vehicle_local_position_setpoint.z
        multicopter = status.vehicle_kind.traits.vehicle_type == ROTARY_WING
        if not (watches and multicopter and status.control_mode.altitude and self._loss_limit_m > 0.0):
            self._highest_z = math.nan
            return False
        if local.z_reset_counter != self._z_resets:
            self._z_resets = local.z_reset_counter
            self._highest_z += local.delta_z
        if not local.z > wanted_z:
            self._highest_z = math.nan
            return False
        highest = self._highest_z if math.isfinite(self._highest_z) else local.z
        self._highest_z = max(wanted_z, min(local.z, highest))
        return local.z - self._highest_z > self._loss_limit_m

    def _watch_balance(self) -> None:
        imu = self._topics.vehicle_imu_status
        if imu.timestamp == self._imu_us:
            return
        dt_s = max(0.01, min(1.0, (imu.timestamp - self._imu_us) * 1e-6))
        self._imu_us = imu.timestamp
        x, y, z = map(math.sqrt, imu.var_accel)
        self._imbalance += dt_s / (IMBALANCE_TIME_CONSTANT_S + dt_s) * (0.5 * (x + y) - z - self._imbalance)

    def _copy_parameters(self) -> None:
        value = self._parameters
        self._imbalance_limit = float(value["FD_IMB_PROP_THR"])
        self._limits_rad = math.radians(abs(value["FD_FAIL_R"])), math.radians(abs(value["FD_FAIL_P"]))
        self._loss_limit_m = float(value["FD_ALT_LOSS"])
        times = ("FD_FAIL_R_TTRI", "FD_FAIL_P_TTRI", "FD_ALT_LOSS_T")
        self._times_us = tuple(int(value[name] * 1e6) for name in times)

    def _failed(self, now_us: int, which: int, beyond: bool) -> bool:
        if not beyond:
            self._good_us[which] = now_us
        return beyond and now_us - self._good_us[which] >= self._times_us[which]


def _stopped_motors(failures: FailureInjection) -> int:
    """Bit per motor."""
    return sum(1 << n for n in range(MOTORS) if failures.type_of(MOTOR, n + 1) == OFF) if failures.entries else 0
