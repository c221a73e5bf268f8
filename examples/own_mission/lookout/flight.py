"""The flight: up, look out, down. A script on simulated time; what it waits for, it waits for with `yield from`."""

from sitl_emu.companion import Onboard, Script, set_mode, steps

READY_S = CLIMB_S = 120.0


def look_out(onboard: Onboard, height_m: float, wait_s: float) -> Script:
    """Takes off to a height over the ground, stays there, lands where it stands."""
    yield from steps.heard(onboard)
    onboard.enter("getting ready", f"to look out from {height_m:g} m")
    yield from steps.parameter(onboard, "MIS_TAKEOFF_ALT", height_m)
    yield from steps.ready(onboard, READY_S)
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold"})
    onboard.enter("climbing", f"to {height_m:g} m")
    yield from steps.pause(onboard, CLIMB_S, until=lambda: onboard.telemetry.mode == "hold")
    onboard.enter("looking out", f"for {wait_s:g} s")
    onboard.note("lookout_begins", f"from {height_m:g} m", height_m=height_m)
    yield from steps.pause(onboard, wait_s)
    onboard.note("lookout_ends", "seen enough")
    yield from steps.command(onboard, set_mode(onboard.system_id, "land"), "mode land")
    onboard.yielding.expect({"land", "hold"})
    onboard.enter("landing", "where it took off")
    yield from steps.until_landed(onboard)
