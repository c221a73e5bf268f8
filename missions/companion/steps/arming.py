"""From the first heartbeat to armed motors, and back."""

from sitl_emu.gcs import command as commands
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.steps.commanding import NO_ANSWER, StepFailed
from sitl_emu.missions.companion.steps.moving import pause

ARM_TRIES = 20
ARM_PAUSE_S = 1.5
"""Longer than the second between two heartbeats, which say whether the vehicle is armed."""
DISARM_S = 3.0


def heard(onboard: Onboard) -> Script:
    """Until the autopilot was heard."""
    while not onboard.system_id:
        yield


def ready(onboard: Onboard, timeout_s: float) -> Script:
    """Until pre-arm checks pass, and position and home are known."""
    since_us = onboard.now_us
    while not onboard.telemetry.ready:
        if onboard.now_us - since_us > timeout_s * 1e6:
            raise StepFailed(f"autopilot not ready after {timeout_s:.0f} s")
        yield


def arm(onboard: Onboard, tries: int = ARM_TRIES) -> Script:
    """Until the vehicle says that it is armed; a refusal is asked again after a while."""
    text = NO_ANSWER
    for _ in range(tries):
        asked = yield from onboard.do(AUTOPILOT_LINK, commands.arm(onboard.system_id))
        if asked.outcome is not None and not asked.outcome.accepted:
            text = asked.outcome.text
        since_us = onboard.now_us
        while onboard.now_us - since_us < ARM_PAUSE_S * 1e6 and not onboard.telemetry.armed:
            yield
        if onboard.telemetry.armed:
            return
    raise StepFailed(f"arming refused: {text}")


def disarm(onboard: Onboard) -> Script:
    """Disarms a vehicle that stands, so that people may come near; whether it did is left to see."""
    yield from onboard.do(AUTOPILOT_LINK, commands.disarm(onboard.system_id))
    yield from pause(onboard, DISARM_S, until=lambda: not onboard.telemetry.armed)
