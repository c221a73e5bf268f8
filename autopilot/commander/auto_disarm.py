"""Disarming by itself: after a landing (COM_DISARM_LAND) and after arming without a takeoff (COM_DISARM_PRFLT).

PX4's Commander::handleAutoDisarm (v1.18). The first counts from landing, the second from arming and the spool-up
after it (COM_SPOOLUP_TIME); 0 and less turn them off.
"""

from enum import Enum


class Reason(Enum):
    """Why the vehicle disarmed itself, as PX4 tells it."""

    LANDING = "landing"
    PREFLIGHT = "auto preflight disarming"


class AutoDisarm:
    """Watches how long the vehicle has stood, armed."""

    def __init__(self) -> None:
        self._landed_since_us = -1

    def reset(self) -> None:
        """Not armed, or in the air."""
        self._landed_since_us = -1

    def update(
        self, now_us: int, *, has_taken_off: bool, after_landing_s: float, preflight_s: float, spoolup_s: float
    ) -> Reason | None:
        """Armed and on the ground: the reason to disarm now, or None."""
        if self._landed_since_us < 0:
            self._landed_since_us = now_us
        stood_s = (now_us - self._landed_since_us) * 1e-6
        if has_taken_off:
            return Reason.LANDING if 0.0 < after_landing_s <= stood_s else None
        return Reason.PREFLIGHT if preflight_s > 0.0 and preflight_s + spoolup_s <= stood_s else None
