"""Descent speed over height (MPC_LAND_ALT1..3, MPC_LAND_SPEED, MPC_LAND_CRWL), for AUTO_LAND.

As PX4 v1.18 in FlightTaskAuto: full speed above ALT1, interpolated to the landing speed at ALT2 (an ALT1 below that
counts as ALT2), and a crawl below ALT3 if a range sensor sees the ground.
"""

from typing import NamedTuple

from sitl_emu.autopilot.parameters import Parameters


class LandSpeeds(NamedTuple):
    """Copies of the parameters: m/s and m."""

    fast: float
    slow: float
    crawl: float
    altitude1_m: float
    altitude2_m: float
    altitude3_m: float


def land_speeds(parameters: Parameters) -> LandSpeeds:
    """The parameters of the descent."""
    return LandSpeeds(
        parameters["MPC_Z_VEL_MAX_DN"],
        parameters["MPC_LAND_SPEED"],
        parameters["MPC_LAND_CRWL"],
        max(parameters["MPC_LAND_ALT1"], parameters["MPC_LAND_ALT2"]),
        parameters["MPC_LAND_ALT2"],
        parameters["MPC_LAND_ALT3"],
    )


def descent_speed(speeds: LandSpeeds, height_m: float, range_m: float) -> float:
    """Speed down, m/s; `range_m` is NaN where no range sensor sees the ground."""
    if range_m <= speeds.altitude3_m:
        return speeds.crawl
    if not height_m > speeds.altitude2_m:
        return speeds.slow
    if height_m > speeds.altitude1_m:
        return speeds.fast
    share = (height_m - speeds.altitude2_m) / (speeds.altitude1_m - speeds.altitude2_m)
    return speeds.slow + (speeds.fast - speeds.slow) * share
