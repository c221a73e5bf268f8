"""A mission for tests: an iris flies over the house of examples/own_world and keeps what its feeds show there."""

import math
from pathlib import Path

import numpy as np

from sitl_emu.companion import Companion, Onboard, Script, Scripted, set_mode, steps
from sitl_emu.mission import Mission, Options, Program

NORTH_M, EAST_M, HEIGHT_M = 25.0, 10.0, 12.0
"""Of the roof's middle from home, and how high above home it flies there."""
M_PER_DEG = 111_319.49


def measure(onboard: Onboard, folder: Path) -> Script:
    """Go above the roof, and keep depth and points for three seconds."""
    yield from steps.heard(onboard)
    yield from steps.ready(onboard, timeout_s=120.0)
    home = onboard.telemetry.place
    assert home is not None, "ready means that it knows where it is"
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold"})
    yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
    lat_deg = home.lat_deg + NORTH_M / M_PER_DEG
    lon_deg = home.lon_deg + EAST_M / (M_PER_DEG * math.cos(math.radians(home.lat_deg)))
    yield from steps.go_to(onboard, lat_deg, lon_deg, home.alt_amsl_m + HEIGHT_M, within_m=1.0, timeout_s=90.0)
    depths, clouds = dict[str, object](), dict[str, object]()
    until_us = onboard.now_us + 3_000_000
    while onboard.now_us < until_us:
        if onboard.depth is not None:
            depths[str(onboard.depth.time_usec)] = onboard.depth.depth_m
        if onboard.cloud is not None:
            clouds[str(onboard.cloud.time_usec)] = onboard.cloud.points_m
        yield
    np.savez(folder / "depths.npz", **depths)  # type: ignore[arg-type]
    np.savez(folder / "clouds.npz", **clouds)  # type: ignore[arg-type]
    onboard.note("measured", f"{len(depths)} depth images, {len(clouds)} scans")


def program(options: Options) -> Companion:
    """The companion."""
    folder = Path(options.text("folder"))
    return Scripted(lambda onboard: measure(onboard, folder))


MISSION = Mission(programs={"measure-house": Program(program)})
