"""How far from its place a parcel comes to rest that was let go where `release_point` says: in the simulator, in wind.

    python tools/measure_parcel.py [HEIGHT...] [--drops N]

A responder's parcel, hung as by a vehicle that hovers: tilted by 2 degrees for each m/s of wind, moving by 0.3 m/s and
turning by 0.2 rad/s (standard deviations; these and the winds, 0 to 12 m/s from anywhere, are ours). The wind is known
but for its gusts, a tenth of it. All is drawn from a seed: the same figures each time.
"""

import argparse
import math
import random
import statistics
from pathlib import Path

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.release_point import OPEN_LAND, Parcel, Wind, release_point
from sitl_emu.vehicles.description import Parcel as ParcelData
from sitl_emu.world.description import read
from sitl_emu.world.parcels import loose_parcel
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.world import World

HEIGHTS_M = (5.0, 10.0, 20.0)
WINDIEST_M_S = 12.0
TILT_PER_M_S = math.radians(2.0)
LONGEST_TICKS = 10_000
NAME = "parcel"


def away_m(data: ParcelData, height_m: float, seed: int) -> float:
    """From the place to where one drop came to rest."""
    draw = random.Random(seed)
    blows_m_s, towards = draw.uniform(0.0, WINDIEST_M_S), draw.uniform(0.0, math.tau)
    wind = Wind(blows_m_s * math.cos(towards), blows_m_s * math.sin(towards), height_m)
    described = {
        "north_m_s": wind.north_m_s,
        "east_m_s": wind.east_m_s,
        "gust_m_s": 0.1 * blows_m_s,
        "profile_exponent": OPEN_LAND,
        "reference_height_m": height_m,
    }
    world = World(read({"name": "drop", "seed": seed, "wind": described}, "drop"), Path())
    world.expect_releases()
    assert world.solids is not None
    simulation = Simulation([], world.solids)
    velocity = (draw.gauss(0.0, 0.3), draw.gauss(0.0, 0.3), draw.gauss(0.0, 0.3))
    parcel = Parcel(data.mass_kg, data.drag_m2, 0.5 * data.size_m[2])
    point = release_point((0.0, 0.0), parcel, height_m, velocity, wind)
    hung = quaternion(0.0, -TILT_PER_M_S * blows_m_s, towards + math.pi)  # a vehicle that looks and leans into the wind
    spin = (draw.gauss(0.0, 0.2), draw.gauss(0.0, 0.2), draw.gauss(0.0, 0.2))
    simulation.release(loose_parcel(NAME, data), (*point, -height_m), hung, velocity, spin)
    for _ in range(LONGEST_TICKS):
        simulation.tick([])
        if world.solids.lies_still(NAME):
            break
    (pose,) = simulation.loose_poses()
    return math.hypot(pose.place[0], pose.place[1])


def main() -> None:
    """Drop, and print a line for each height."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("heights", metavar="HEIGHT", nargs="*", type=float, default=HEIGHTS_M)
    parser.add_argument("--drops", metavar="N", type=int, default=60)
    asked = parser.parse_args()
    release = vehicles.load("responder").release
    assert release is not None
    for height_m in asked.heights:
        away = sorted(away_m(release.parcel, height_m, seed) for seed in range(asked.drops))
        most = away[math.ceil(0.9 * len(away)) - 1]
        print(f"{height_m:g} m: median {statistics.median(away):.2f} m, 90 % {most:.2f} m, farthest {away[-1]:.2f} m")


if __name__ == "__main__":
    main()
