"""Home and down."""

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.steps.commanding import StepFailed
from sitl_emu.missions.companion.steps.moving import Motion

LANDING_TIMEOUT_S = 300.0
GOING_HOME = frozenset({"return", "land"})
"""Modes that are ours on the way: PX4 lands at a Return's end."""


def until_landed(onboard: Onboard, timeout_s: float = LANDING_TIMEOUT_S) -> Script:
    """Until it has landed and disarmed by itself. Raises StepFailed where it does not, or lies somewhere, armed.

    Once it stands, Hold is expected too, which PX4 may go back to when it disarms (UserModeIntention.cpp, onDisarm); in
    the air somebody else has chosen it.
    """
    since_us, motion, began = onboard.own_us, Motion(), onboard.telemetry.place
    while onboard.telemetry.armed:
        if onboard.own_us - since_us > timeout_s * 1e6:
            raise StepFailed("did not land and disarm")
        if onboard.telemetry.landed and onboard.yielding.expected:
            onboard.yielding.expect(onboard.yielding.expected | {"hold"})
        place = onboard.telemetry.place
        if began is not None and place is not None:
            here_m = to_metres(place.lat_deg, place.lon_deg, began.lat_deg, began.lon_deg)
            if motion.is_stuck(onboard.own_us, (*here_m, place.alt_amsl_m)):
                raise StepFailed(onboard.silence or "does not move, and is armed")
        yield


def return_home(onboard: Onboard, timeout_s: float = LANDING_TIMEOUT_S) -> Script:
    """After a failure in the air: home, down, off; a vehicle that is disarmed stays where it is."""
    if onboard.telemetry.armed:
        asked = yield from onboard.do(AUTOPILOT_LINK, set_mode(onboard.system_id, "return"))
        is_taken = asked.outcome is not None and asked.outcome.accepted
        onboard.yielding.expect(GOING_HOME if is_taken else ())
        yield from until_landed(onboard, timeout_s)
