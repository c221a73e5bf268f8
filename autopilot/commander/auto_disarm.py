"""Disarming by itself: after a landing (COM_DISARM_LAND) and after arming without a takeoff (COM_DISARM_PRFLT).

PX4's Commander::handleAutoDisarm (v1.18). The first counts from landing, the second from arming and the spool-up
after it (COM_SPOOLUP_TIME); 0 and less turn them off. A mission that goes on is not disarmed, and nothing is counted
anew meanwhile: one that was flown from the ground and ends on it disarms at once.
"""

from enum import Enum


class Reason(Enum):
    """Why the vehicle disarmed itself, as PX4 tells it."""

    LANDING = "landing"
    PREFLIGHT = "auto preflight disarming"


class AutoDisarm:
    """Watches how long the vehicle has stood, armed; PX4's hysteresis `_auto_disarm_landed`."""

    def __init__(self) -> None:
        self._stands = self._due = False
        self._since_us = 0

    def reset(self) -> None:
        """Not armed."""
        self._stands = self._due = False

    def update(
        self,
        now_us: int,
        *,
        landed: bool,
        has_taken_off: bool,
        mission_in_progress: bool,
        after_landing_s: float,
        preflight_s: float,
        spoolup_s: float,
    ) -> Reason | None:
        """Armed: the reason to disarm now, or None."""
        if after_landing_s <= 0.0 and preflight_s <= 0.0:
            return None
        if has_taken_off and after_landing_s > 0.0 and not mission_in_progress:
            self._count(now_us, landed, after_landing_s)
        elif not has_taken_off and preflight_s > 0.0:
            self._count(now_us, True, spoolup_s + preflight_s)
        if not self._due:
            return None
        return Reason.LANDING if has_taken_off else Reason.PREFLIGHT

    def _count(self, now_us: int, stands: bool, after_s: float) -> None:
        if stands is not self._stands:
            self._stands, self._since_us = stands, now_us
        self._due = stands and (self._due or now_us - self._since_us >= after_s * 1e6)
