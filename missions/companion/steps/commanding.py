"""What the autopilot is told and has to accept: commands, parameters, uploads of missions, fences and rally points."""

from collections.abc import Callable, Sequence

from sitl_emu.gcs.command import Command
from sitl_emu.gcs.mission import FENCE, MISSION, RALLY, MissionItem, MissionUpload
from sitl_emu.gcs.parameter import ParameterSet
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script

NAMES = {MISSION: "mission", FENCE: "fence", RALLY: "rally points"}
NO_ANSWER = "no answer"


class StepFailed(Exception):
    """A step that can't be done; the text is for people."""


def command(onboard: Onboard, wanted: Command, what: str, begun: Callable[[], None] | None = None) -> Script:
    """Until the autopilot has accepted a command; `what` names it where it does not.

    `begun` is called when it says that it is at it, or in the end where it may be: it accepted, or no answer came.
    """
    onboard.start(AUTOPILOT_LINK, wanted)
    while not wanted.done and wanted.progress is None:
        yield
    if begun is not None and wanted.may_have_begun:
        begun()
    while not wanted.done:
        yield
    if wanted.outcome is None or not wanted.outcome.accepted:
        raise StepFailed(f"{what}: {wanted.outcome.text if wanted.outcome else NO_ANSWER}")


def parameter(onboard: Onboard, name: str, value: float) -> Script:
    """Until the autopilot has told that a parameter has a value."""
    asked = yield from onboard.do(AUTOPILOT_LINK, ParameterSet(onboard.system_id, name, value))
    if not asked.accepted:
        why = f" ({asked.refusal})" if asked.refusal else ""
        raise StepFailed(f"parameter {name}: the autopilot does not take {value:g}{why}")


def upload(onboard: Onboard, items: Sequence[MissionItem], mission_type: int = MISSION) -> Script:
    """Until the autopilot has a mission, a fence or rally points (none: clears those there are)."""
    done = yield from onboard.do(AUTOPILOT_LINK, MissionUpload(onboard.system_id, items, mission_type))
    if done.outcome is None or not done.outcome.accepted:
        raise StepFailed(f"upload of {NAMES[mission_type]} failed: {done.outcome.text if done.outcome else NO_ANSWER}")
