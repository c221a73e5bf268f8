"""The mode that the user wants, and the one to come back to after disarming.

PX4's UserModeIntention (src/modules/commander/UserModeIntention.cpp, v1.18): on the ground any mode may be chosen, in
flight only one that can run. Modes that prevent arming (LAND, RTL, ...) and take-offs are forgotten at disarming, but
no termination; who has booted into one of them comes back to POSCTL.
"""

from sitl_emu.autopilot.commander.arming_checks.checks import HealthAndArmingChecks
from sitl_emu.autopilot.commander.mode_requirements import PREVENT_ARMING
from sitl_emu.autopilot.constants import NavState

TAKEOFFS = (NavState.AUTO_TAKEOFF, NavState.AUTO_VTOL_TAKEOFF)


def boot_mode(com_fltmode_boot: int) -> NavState:
    """The mode of the parameter's eight lowest bits. PX4 takes any number; that all of no mode are one, is ours."""
    try:
        return NavState(com_fltmode_boot & 0xFF)
    except ValueError:
        return NavState.FREE1


class UserModeIntention:
    """What was asked for last."""

    def __init__(self, checks: HealthAndArmingChecks, mode: NavState) -> None:
        self._checks = checks
        self.mode = mode
        self.changes = 0
        """Counts every accepted request, also those for the mode that it is already."""
        self._mode_after_disarming = NavState.POSCTL
        self.follow(mode)

    def change(self, mode: NavState, *, armed: bool, force: bool = False, allow_fallback: bool = False) -> bool:
        """Ask for a mode; False where it cannot be flown now.

        `allow_fallback`: POSCTL may be asked for where ALTCTL alone can be flown; the failsafe flies that then.
        """
        if armed and not force and not self._checks.can_run(mode):
            falls_back = allow_fallback and mode is NavState.POSCTL and self._checks.can_run(NavState.ALTCTL)
            if not falls_back:
                return False
        self.changes += 1
        self.follow(mode)
        return True

    def follow(self, mode: NavState) -> None:
        """Take what a failsafe has made of it; nobody asked for that."""
        self.mode = mode
        if mode is NavState.TERMINATION or (mode not in PREVENT_ARMING and mode not in TAKEOFFS):
            self._mode_after_disarming = mode

    def on_disarm(self) -> None:
        """Back to the last mode in which one can arm."""
        self.mode = self._mode_after_disarming
