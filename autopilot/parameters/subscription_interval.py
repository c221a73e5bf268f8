"""News at most so often: PX4's uORB::SubscriptionInterval (platforms/common/uORB, v1.18).

PX4's modules hear of changed parameters through one of a second: of several changes in a row the first is taken at
once, the others together when its second is over. After a pause of more than one interval two pass in a row.
"""

from typing import Final

PARAMETER_UPDATE_INTERVAL_US: Final = 1_000_000
"""Interval of the modules' parameter_update subscriptions: mavlink_parameters.h, MulticopterPositionControl.hpp,
LandDetector.h, VehicleIMU.hpp and others."""


class SubscriptionInterval:
    """What one reader of a topic has seen; a topic is known by a number that changes with it."""

    def __init__(self, interval_us: int, seen: int) -> None:
        """`seen` is the topic's number today."""
        self._interval_us = interval_us
        self._seen = seen
        self._last_us = -interval_us

    def updated(self, now_us: int, number: int) -> bool:
        """Whether there is news that may be taken now; if so, it is taken."""
        if number == self._seen or now_us - self._last_us < self._interval_us:
            return False
        self._seen = number
        self._last_us = min(max(self._last_us + self._interval_us, now_us - self._interval_us), now_us)
        return True
