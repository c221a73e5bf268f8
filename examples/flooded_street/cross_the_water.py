"""A companion that crosses the water of street.yaml and lands at a place, north and east of the street's middle.

sitl-emu run scenario.yaml        # starts it; the scenario names it, and the place
"""

import math
import sys

from sitl_emu.companion import LinkError, Onboard, Script, Scripted, fly, set_mode, steps

HOME_EAST_M = 34.0
HEIGHT_M = 15.0
"""Above home: over the roofs, and the trees."""
M_PER_DEG = 111_319.49


def cross_to(north_m: float, east_m: float, onboard: Onboard) -> Script:
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
    onboard.enter("crossing", "the water")
    lat_deg = home.lat_deg + north_m / M_PER_DEG
    lon_deg = home.lon_deg + (east_m - HOME_EAST_M) / (M_PER_DEG * math.cos(math.radians(home.lat_deg)))
    yield from steps.go_to(onboard, lat_deg, lon_deg, home.alt_amsl_m + HEIGHT_M, within_m=2.0, timeout_s=90.0)
    onboard.enter("landing", "at the place")
    yield from steps.command(onboard, set_mode(onboard.system_id, "land"), "mode land")
    onboard.yielding.expect({"land", "hold"})
    yield from steps.until_landed(onboard)


if __name__ == "__main__":
    connect, north, east = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    try:
        status = fly(Scripted(lambda onboard: cross_to(north, east, onboard)), connect)
    except LinkError as error:
        sys.exit(str(error))
    print(status.outcome)
    sys.exit(status.outcome != "success")
