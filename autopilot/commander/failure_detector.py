"""Attitudes that no flight needs: tilted further than FD_FAIL_R, FD_FAIL_P for FD_FAIL_R_TTRI, FD_FAIL_P_TTRI.

PX4's FailureDetector (src/modules/commander/failure_detector, v1.18). It looks in every mode that controls attitude, on
the ground as in the air. What follows is in arming_checks/failure_detector.py and failsafe.py.

Left out: loss of altitude (FD_ALT_LOSS, off by default), an external trigger (FD_EXT_ATS_EN), imbalanced propellers.
"""

import math

from autopilot.constants import NavState
from autopilot.parameters import Parameters
from autopilot.topics import FailureDetectorStatus, Topics

WITHOUT_ATTITUDE = frozenset((NavState.ACRO, NavState.TERMINATION))


class FailureDetector:
    """Writer of failure_detector_status."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._version = -1
        self._good_us = [0, 0]
        """When roll and pitch were last within their limits."""

    def update(self, now_us: int) -> None:
        """At the commander's rate."""
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._copy_parameters()
        topics = self._topics
        roll, pitch, _ = topics.vehicle_attitude.euler
        watches = topics.vehicle_status.nav_state not in WITHOUT_ATTITUDE
        roll_limit, pitch_limit = self._limits_rad
        fd_roll = self._failed(now_us, 0, watches and 0.0 < roll_limit < abs(roll))
        fd_pitch = self._failed(now_us, 1, watches and 0.0 < pitch_limit < abs(pitch))
        status = topics.failure_detector_status
        if (status.fd_roll, status.fd_pitch) != (fd_roll, fd_pitch):
            topics.failure_detector_status = FailureDetectorStatus(now_us, fd_roll, fd_pitch)

    def _copy_parameters(self) -> None:
        value = self._parameters
        self._limits_rad = math.radians(abs(value["FD_FAIL_R"])), math.radians(abs(value["FD_FAIL_P"]))
        self._times_us = tuple(int(value[name] * 1e6) for name in ("FD_FAIL_R_TTRI", "FD_FAIL_P_TTRI"))

    def _failed(self, now_us: int, axis: int, beyond: bool) -> bool:
        if not beyond:
            self._good_us[axis] = now_us
        return beyond and now_us - self._good_us[axis] >= self._times_us[axis]
