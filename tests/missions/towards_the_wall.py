"""A mission for tests: a pilot's stick, held full ahead in Position mode, towards the wall of examples/own_world."""

from sitl_emu.companion import (
    AUTOPILOT_LINK,
    Companion,
    ManualControl,
    Onboard,
    ParameterSet,
    Script,
    Scripted,
    Sticks,
    set_mode,
    steps,
)
from sitl_emu.mission import Mission, Options, Program

JOYSTICK = 1
"""COM_RC_IN_MODE: sticks come by MANUAL_CONTROL alone."""
HELD_S = 30.0
"""The last scan's braking pushes it back, a metre and more; then it comes again."""


def towards_the_wall(onboard: Onboard, keep_m: float) -> Script:
    """Take off, then hold the stick for HELD_S."""
    yield from steps.heard(onboard)
    system = onboard.system_id
    for name, value in (
        ("MIS_TAKEOFF_ALT", 2.5),
        ("COM_RC_IN_MODE", JOYSTICK),
        ("CP_DIST", keep_m),
        ("CP_GUIDE_ANG", 0.0),
    ):
        yield from onboard.do(AUTOPILOT_LINK, ParameterSet(system, name, value))
    sticks = ManualControl(system)
    onboard.start(AUTOPILOT_LINK, sticks)
    yield from steps.ready(onboard, timeout_s=120.0)
    yield from steps.command(onboard, set_mode(system, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold", "position"})
    yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
    yield from steps.command(onboard, set_mode(system, "position"), "mode position")
    onboard.note("stick", "full ahead")
    sticks.sticks = Sticks(pitch=1.0)
    yield from steps.pause(onboard, HELD_S)
    onboard.note("mode", onboard.telemetry.mode)


def program(options: Options) -> Companion:
    """The companion."""
    keep_m = options.number("keep_m", -1.0, -1.0, 15.0)
    return Scripted(lambda onboard: towards_the_wall(onboard, keep_m))


MISSION = Mission(programs={"towards-the-wall": Program(program)})
