"""What a picture costs: CPU of 640 x 480 over eight named views of each generated world, the worst and the median.

`python tools/bench_renderer.py [KIND...]`. Each figure is the least of several runs of one view, on one core; memory is
what the process has taken most (ru_maxrss), with Python, numba, PyBullet and the world's building.
"""

import math
import multiprocessing
import resource
import statistics
import sys
import time

import numpy as np

from sitl_emu.run import worlds

KINDS = ("urban_flood", "debris_field", "wildfire_perimeter")
RUNS = 9
AT_S = 20.0
VIEWS = {  # share of the area north and east, height m, heading and degrees below the horizon
    "nadir 5 m": (0.45, 0.45, 5.0, 0.0, 90.0),
    "nadir 15 m": (0.5, 0.5, 15.0, 0.0, 90.0),
    "nadir 30 m": (0.5, 0.5, 30.0, 0.0, 90.0),
    "nadir 60 m": (0.5, 0.5, 60.0, 0.0, 90.0),
    "oblique": (0.2, 0.25, 24.0, 40.0, 38.0),
    "forward": (0.35, 0.6, 9.0, 100.0, 15.0),
    "street": (0.62, 0.5, 1.7, 180.0, 3.0),
    "whole world": (-0.1, -0.1, 60.0, 45.0, 28.0),
}


def measure(kind: str) -> None:
    """Print one world's figures."""
    started = time.perf_counter()
    world = worlds.build(kind, 1, {})
    built = time.perf_counter()
    renderer = world.scene().renderer(640, 480, 320.0)
    north, east = np.max(world.description.area_m, axis=0)
    costs: dict[str, float] = {}
    for name, (n, e, above, heading, below) in VIEWS.items():
        h, p = math.radians(heading), math.radians(below)
        ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
        right = np.array((-math.sin(h), math.cos(h), 0.0))
        axes = np.stack((right, np.cross(ahead, right), ahead), axis=1)
        place = np.array((n * north, e * east, -world.ground(n * north, e * east) - above))
        renderer.draw(place, axes, AT_S)
        if not costs:
            first = time.perf_counter() - built
        taken = []
        for _ in range(RUNS):
            began = time.process_time()
            renderer.draw(place, axes, AT_S)
            taken.append(1e3 * (time.process_time() - began))
        costs[name] = min(taken)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{kind}: worst {max(costs.values()):.1f} ms, median {statistics.median(costs.values()):.1f} ms, "
          f"{memory:.0f} MiB; world {built - started:.1f} s, scene and first frame {first:.1f} s")  # fmt: skip
    print("  " + ", ".join(f"{name} {cost:.1f}" for name, cost in costs.items()))


if __name__ == "__main__":
    for kind in sys.argv[1:] or KINDS:
        process = multiprocessing.get_context("spawn").Process(target=measure, args=(kind,))
        process.start()
        process.join()
        if process.exitcode:
            raise SystemExit(process.exitcode)
