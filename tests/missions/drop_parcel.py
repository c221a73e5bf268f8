"""A mission for tests: a responder takes off with its parcel and drops it."""

from sitl_emu.companion import Companion, Onboard, Script, Scripted, set_mode, steps
from sitl_emu.gcs.command import gripper
from sitl_emu.mission import Mission, Options, Program


def drop(onboard: Onboard) -> Script:
    """Up, open, and wait until it lies."""
    yield from steps.heard(onboard)
    yield from steps.ready(onboard, timeout_s=120.0)
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold"})
    yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
    yield from steps.command(onboard, gripper(onboard.system_id, open_it=True), "gripper")
    yield from steps.pause(onboard, 6.0)


def program(_options: Options) -> Companion:
    """The companion."""
    return Scripted(drop)


MISSION = Mission(programs={"drop-parcel": Program(program)})
