"""A companion that flies north at 5 m/s whatever stands there, for test_own_world.py."""

import sys

from sitl_emu.companion import (
    AUTOPILOT_LINK,
    Offboard,
    Onboard,
    ParameterSet,
    Script,
    Scripted,
    fly,
    set_mode,
    steps,
    velocity_ned,
)


def into_the_wall(onboard: Onboard) -> Script:
    """Up to 2.5 m, and on."""
    yield from steps.heard(onboard)
    yield from onboard.do(AUTOPILOT_LINK, ParameterSet(onboard.system_id, "MIS_TAKEOFF_ALT", 2.5))
    yield from steps.ready(onboard, timeout_s=120.0)
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold", "offboard"})
    yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
    yield from onboard.do(AUTOPILOT_LINK, Offboard(onboard.system_id, velocity_ned(onboard.system_id, 5.0, 0.0, 0.0)))


if __name__ == "__main__":
    fly(Scripted(into_the_wall), sys.argv[1])
