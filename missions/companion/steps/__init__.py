"""Steps that missions share. Each is a script on simulated time: a mission's own script goes through it with
`yield from`, and is where it was when the step has been done.

    yield from steps.heard(onboard)
    yield from steps.select(onboard, perception)
    yield from steps.upload(onboard, plan.mission)
    yield from steps.ready(onboard, timeout_s=120.0)
    yield from steps.command(onboard, set_mode(onboard.system_id, "mission"), "mission mode")
    yield from steps.arm(onboard)

A step that can't be done raises `StepFailed`, whose text says what and why. No step goes on while a pilot or a failsafe
has the vehicle, as long as its mission does not step the script then (`Onboard.watch_pilot`).
"""

from sitl_emu.missions.companion.steps.arming import arm, disarm, heard, ready
from sitl_emu.missions.companion.steps.commanding import StepFailed, command, parameter, upload
from sitl_emu.missions.companion.steps.landing import GOING_HOME, return_home, until_landed
from sitl_emu.missions.companion.steps.moving import STILL_M_S, Motion, centre, go_to, pause, until_standing
from sitl_emu.missions.companion.steps.resuming import leave, resume
from sitl_emu.missions.companion.steps.selecting import select

__all__ = [
    "GOING_HOME",
    "STILL_M_S",
    "Motion",
    "StepFailed",
    "arm",
    "centre",
    "command",
    "disarm",
    "go_to",
    "heard",
    "leave",
    "parameter",
    "pause",
    "ready",
    "resume",
    "return_home",
    "select",
    "until_landed",
    "until_standing",
    "upload",
]
