"""Memory and first frame of the cameras of one world, as `sitl-emu run` starts them.

    python tools/bench_cameras.py [CAMERAS] [--world KIND] [--size M] [--mount nadir|mast]

A world (a `corn_field`) of M × M metres (200) is built, and a process started for each camera (4). Together they look
at all of it: each starts on the ground and flies over a strip of its own at 15 m, a picture every 5 m, lines 12 m
apart; on a mast it stays at the ground. It tells their memory as it grows and at its greatest; when the first and the
last camera had its first frame, after all were started together; and what a frame costs. PSS counts a page that n
processes share as 1/n in each, so that the sum is what all take of the machine. It is sampled (/proc/PID/smaps_rollup,
Linux) every 20 ms: the greatest that was seen.
"""

import argparse
import contextlib
import math
import os
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from sitl_emu.run import worlds
from sitl_emu.run.children import Child, end_all, start_process
from sitl_emu.run.configs import CameraConfig, CameraDescription, RingData
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import BodyPose, End, Ready, Render, Rendered
from sitl_emu.world.lens import MOUNTS, Intrinsics
from sitl_emu.world.world import World

SEED = 7
STANDING_M = 0.2
"""About the height of a body on its legs or wheels."""
ABOVE_M = {"nadir": 15.0, "mast": STANDING_M}
"""Of a survey, and of a rover."""
LEVEL = (1.0, 0.0, 0.0, 0.0)
LINES_M, STEP_M = 12.0, 5.0
PERIOD_US = 66_667
SAMPLE_S = 0.02
MIB = 1024.0
"""KiB in a MiB."""


def pss_mib(pid: int) -> float:
    """What a process takes of the machine now; 0 when it has ended."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) / MIB
    return 0.0


def cpu_s(pid: int) -> float:
    """Processor time that it has had, in user and kernel."""
    utime, stime = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return (int(utime) + int(stime)) / os.sysconf("SC_CLK_TCK")


class Sampler(threading.Thread):
    """Watches the memory of processes until told to `stop`."""

    def __init__(self, pids: list[int]) -> None:
        super().__init__(daemon=True)
        self.pids = pids
        self.most_mib = dict.fromkeys(pids, 0.0)
        self.most_together_mib = 0.0
        self._over = threading.Event()

    def run(self) -> None:
        """See Thread."""
        while not self._over.wait(SAMPLE_S):
            now = {pid: pss_mib(pid) for pid in self.pids}
            self.most_mib = {pid: max(self.most_mib[pid], each) for pid, each in now.items()}
            self.most_together_mib = max(self.most_together_mib, sum(now.values()))

    def stop(self) -> None:
        """And wait until it has."""
        self._over.set()
        self.join()


@contextlib.contextmanager
def cameras(kept: Path, count: int, mount: str, folder: Path) -> Iterator[tuple[list[Child], list[ControlChannel]]]:
    """The processes that look at a world that was kept, and a channel to each."""
    (folder / "logs").mkdir()
    lens = Intrinsics()
    described = CameraDescription(
        width_px=lens.width, height_px=lens.height, hfov_deg=lens.hfov_deg, distortion=lens.distortion,
        place_m=MOUNTS[mount][:3], depression_deg=MOUNTS[mount].depression_deg, rate_hz=15.0, latency_s=0.1,
    )  # fmt: skip
    children, channels = list[Child](), list[ControlChannel]()
    try:
        shared_fd = os.memfd_create("bench_cameras")
        for index in range(count):
            name = f"camera{index}"
            config = CameraConfig(
                folder=str(folder), start_us=0, seed=SEED, name=name, world=str(kept), camera=described,
                ring=RingData(name=f"bench_cameras-{os.getpid()}-{name}", slots=8), shared_fd=shared_fd,
            )  # fmt: skip
            ours, theirs = socket.socketpair()
            with theirs:
                children.append(start_process(f"camera {name}", "camera_process", config, theirs, folder))
            channels.append(ControlChannel(ours, name))
        os.close(shared_fd)
        yield children, channels
    finally:
        for channel in channels:
            channel.send(End())
        end_all(children, 5.0)


def places(world: World, count: int, mount: str) -> Iterator[list[BodyPose]]:
    """The poses of all cameras, picture by picture: there and back over a strip of the field each."""
    north_m, east_m = (max(corner[axis] for corner in world.description.area_m) for axis in (0, 1))
    width_m = east_m / count
    lines, steps = math.ceil(width_m / LINES_M), math.ceil(north_m / STEP_M) + 1
    for line in range(lines):
        for step in range(steps):
            north = (step if line % 2 == 0 else steps - 1 - step) * north_m / (steps - 1)
            east = [(index + (line + 0.5) / lines) * width_m for index in range(count)]
            before = () if line or step else (STANDING_M,)
            for height in (*before, ABOVE_M[mount]):
                yield [BodyPose(north, each, -world.ground(north, each) - height, LEVEL) for each in east]


def take(channels: list[ControlChannel], index: int, poses: list[BodyPose]) -> list[float]:
    """A picture by each camera; when each was done."""
    for channel, pose in zip(channels, poses, strict=True):
        channel.send(Render(index, index * PERIOD_US, pose))
    done = list[float]()
    for channel in channels:
        channel.expect(Rendered)
        done.append(time.monotonic())
    return done


def tell(title: str, pids: list[int]) -> None:
    """One line of the table."""
    each = [pss_mib(pid) for pid in pids]
    print(f"{title:22} {sum(each):6.0f} MiB PSS together, {max(each):6.0f} the largest", flush=True)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("cameras", type=int, nargs="?", default=4)
    parser.add_argument("--world", default="corn_field", metavar="KIND", help="a kind with the option size_m")
    parser.add_argument("--size", type=float, default=200.0, metavar="M")
    parser.add_argument("--mount", choices=sorted(MOUNTS), default="nadir")
    wanted = parser.parse_args()
    size_m = [wanted.size, wanted.size] if wanted.world == "corn_field" else wanted.size
    world = worlds.build(wanted.world, SEED, {"size_m": size_m})
    print(f"{wanted.cameras} cameras ({wanted.mount}) in one {wanted.world} of {wanted.size:g} x {wanted.size:g} m")
    with tempfile.TemporaryDirectory() as folder:
        kept = worlds.keep(world, Path(folder))
        began_s = time.monotonic()
        with cameras(kept, wanted.cameras, wanted.mount, Path(folder)) as (children, channels):
            pids = [child.process.pid for child in children]
            sampler = Sampler(pids)
            sampler.start()
            for channel in channels:
                channel.expect(Ready)
            tell("ready", pids)
            views = places(world, wanted.cameras, wanted.mount)
            ready_s = time.monotonic()
            done = take(channels, 0, next(views))
            first_s, last_s = min(done) - began_s, max(done) - began_s
            tell("first frame", pids)
            spent_s, index = sum(map(cpu_s, pids)), 0
            for index, poses in enumerate(views, 1):
                take(channels, index, poses)
            spent_s = sum(map(cpu_s, pids)) - spent_s
            passed_s = time.monotonic() - ready_s
            tell("all of it seen", pids)
            sampler.stop()
    most = max(sampler.most_mib.values())
    print(f"{'at its greatest':22} {sampler.most_together_mib:6.0f} MiB PSS together, {most:6.0f} the largest")
    print(f"first frame {first_s:.1f} s after the start, the last camera's {last_s:.1f} s")
    print(f"{1e3 * spent_s / index / len(pids):.1f} ms of CPU a frame; {index + 1} frames each in {passed_s:.1f} s")


if __name__ == "__main__":
    main()
