"""Off a mission's path for something more important, and back to where it was left."""

from collections.abc import Generator

from sitl_emu.gcs.mission import MissionSetCurrent
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.steps.commanding import NO_ANSWER, StepFailed, command


def leave(onboard: Onboard) -> Generator[None, None, int]:
    """Holds where it is; gives the index of the mission item that the vehicle was under way to, for `resume`."""
    left = onboard.telemetry.mission_current
    onboard.yielding.expect(())
    yield from command(onboard, set_mode(onboard.system_id, "hold"), "hold")
    onboard.yielding.expect({"hold"})
    return left


def resume(onboard: Onboard, left: int) -> Script:
    """Goes on with the mission, from the item that it was left at."""
    current = yield from onboard.do(AUTOPILOT_LINK, MissionSetCurrent(onboard.system_id, left))
    if current.outcome is None or not current.outcome.accepted:
        raise StepFailed(f"mission item {left}: {current.outcome.text if current.outcome else NO_ANSWER}")
    onboard.yielding.expect(())
    yield from command(onboard, set_mode(onboard.system_id, "mission"), "mission mode")
    onboard.yielding.expect({"mission"})
