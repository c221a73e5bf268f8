"""What a picture costs: CPU of 640 x 480 over eight named views of each generated world, memory and first frame.

    python tools/bench_renderer.py [KIND...]

A view's figure is the CPU time of the least of several pictures, on one core. Memory (PSS, which counts shared pages in
parts) is what a camera's process takes after its first picture, and what a second of the same world adds, which shares
what is looked up, as in a run; and the most that one ever took (RSS). The first frame is that of a process from its
start, with numba's code cached, the world read from its file: CPU and wall time, of the first camera and the second.
"""

import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.run import worlds
from sitl_emu.run.memory import large_goes_back, settle
from sitl_emu.world.world import World

KINDS = ("urban_flood", "debris_field", "wildfire_perimeter")
SEED = 1
RUNS = 15
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
MIB = 1024
"""KiB in a MiB."""

F64 = npt.NDArray[np.float64]


def pose(world: World, view: str) -> tuple[F64, F64]:
    """A view's place and axes in NED."""
    n, e, above, heading, below = VIEWS[view]
    north, east = np.max(world.description.area_m, axis=0)
    h, p = math.radians(heading), math.radians(below)
    ahead = np.array((math.cos(p) * math.cos(h), math.cos(p) * math.sin(h), math.sin(p)))
    right = np.array((-math.sin(h), math.cos(h), 0.0))
    axes = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    return np.array((n * north, e * east, -world.ground(n * north, e * east) - above)), axes


def pss_mib() -> float:
    """What this process takes of the machine now."""
    lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / MIB


def camera(file: str, shared_fd: int) -> None:
    """A camera's process: tells what its first picture took; then, when asked, its memory or what all views cost."""
    cv2.setNumThreads(1)  # as camera.Camera does: threads that share a core count its time twice
    world = worlds.kept(file, is_met=False)
    with large_goes_back():
        renderer = world.scene(shared_fd).renderer(640, 480, 320.0)
    renderer.draw(*pose(world, "nadir 15 m"), AT_S)
    print(time.process_time(), flush=True)
    settle()
    for asked in sys.stdin:
        print(pss_mib() if asked == "memory\n" else json.dumps(costs(world, renderer)), flush=True)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MIB)


class Camera:
    """Such a process, and when it had its first picture."""

    def __init__(self, file: Path, shared_fd: int) -> None:
        began_s = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, __file__, "--camera", str(file), str(shared_fd)],
            pass_fds=[shared_fd], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.cpu_s, self.wall_s = float(self._told()), time.monotonic() - began_s

    def ask(self, what: str) -> str:
        """A line of it."""
        assert self._process.stdin is not None
        self._process.stdin.write(what + "\n")
        self._process.stdin.flush()
        return self._told()

    def end(self) -> float:
        """The most memory that it took, MiB."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        most = float(self._told())
        self._process.wait()
        return most

    def _told(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


def costs(world: World, renderer: Any) -> dict[str, float]:
    """CPU of each view, ms."""
    found = {}
    for name in VIEWS:
        place, axes = pose(world, name)
        renderer.draw(place, axes, AT_S)
        taken = []
        for _ in range(RUNS):
            began_s = time.process_time()
            renderer.draw(place, axes, AT_S)
            taken.append(1e3 * (time.process_time() - began_s))
        found[name] = min(taken)
    return found


def measure(kind: str) -> None:
    """Print one world's figures."""
    with tempfile.TemporaryDirectory() as folder:
        file = worlds.keep(worlds.build(kind, SEED, {}), Path(folder))
        shared_fd = os.memfd_create("bench_renderer")
        cameras, memory = list[Camera](), list[float]()
        for _ in range(2):
            cameras.append(Camera(file, shared_fd))
            memory.append(sum(float(each.ask("memory")) for each in cameras))
        ms: dict[str, float] = json.loads(cameras[0].ask("costs"))
        peak = max(each.end() for each in cameras)
        os.close(shared_fd)
    first, second = cameras
    every = list(ms.values())
    print(f"{kind:20} {max(every):6.1f} {statistics.median(every):7.1f} {statistics.mean(every):6.1f} "
          f"{memory[0]:8.0f} {memory[1] - memory[0]:7.0f} {peak:6.0f}   "
          f"{first.cpu_s:5.1f} {first.wall_s:5.1f}   {second.cpu_s:5.1f} {second.wall_s:5.1f}")  # fmt: skip
    print("    " + ", ".join(f"{name} {cost:.1f}" for name, cost in ms.items()), flush=True)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("kinds", nargs="*", default=KINDS, metavar="KIND")
    parser.add_argument("--camera", nargs=2, help=argparse.SUPPRESS)
    wanted = parser.parse_args()
    if wanted.camera:
        camera(wanted.camera[0], int(wanted.camera[1]))
        return
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(f"{'':20} {'CPU of a picture, ms':^21} {'memory, MiB':^23}   {'first frame, s of CPU and wall':^26}")
    print(f"{'':20} {'worst':>6} {'median':>7} {'mean':>6} {'first':>8} {'second':>7} {'most':>6}   "
          f"{'first':^11}   {'second':^11}")  # fmt: skip
    for kind in wanted.kinds:
        measure(kind)
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
