"""A companion that lands on the roof of examples/own_world/yard.yaml, as it would on a real one.

sitl-emu run scenario.yaml        # starts it; the scenario names it
"""

import math
import sys

from sitl_emu.companion import LinkError, Onboard, Script, Scripted, fly, set_mode, steps

NORTH_M, EAST_M, HEIGHT_M = 25.0, 10.0, 12.0
"""Of the roof's middle, from home; and how high above home it flies there."""
M_PER_DEG = 111_319.49


def land_on_roof(onboard: Onboard) -> Script:
    """What happens, in order."""
    yield from steps.heard(onboard)
    yield from steps.ready(onboard, timeout_s=120.0)
    home = onboard.telemetry.place
    assert home is not None, "ready means that it knows where it is"
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold"})
    onboard.enter("climbing", "to the take-off altitude")
    yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
    onboard.enter("crossing", "to above the roof")
    lat_deg = home.lat_deg + NORTH_M / M_PER_DEG
    lon_deg = home.lon_deg + EAST_M / (M_PER_DEG * math.cos(math.radians(home.lat_deg)))
    yield from steps.go_to(onboard, lat_deg, lon_deg, home.alt_amsl_m + HEIGHT_M, within_m=3.0, timeout_s=90.0)
    onboard.enter("landing", "on the roof")
    yield from steps.command(onboard, set_mode(onboard.system_id, "land"), "mode land")
    onboard.yielding.expect({"land", "hold"})
    yield from steps.until_landed(onboard)


if __name__ == "__main__":
    try:
        status = fly(Scripted(land_on_roof), sys.argv[1])
    except LinkError as error:
        sys.exit(str(error))
    print(status.outcome)
    sys.exit(status.outcome != "success")
