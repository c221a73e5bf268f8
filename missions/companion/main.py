"""The runner of a companion on hardware, or beside any PX4: real clock, links and camera (`live_frames.py`).

    python -P -m sitl_emu.missions.companion.main --mission NAME --plan field.plan
        --connect udpin:0.0.0.0:14540 --camera rtsp://camera/stream --peer udpout:192.168.1.7:14600

The same harness (`harness.py`) drives the same state machines as in a simulated run, without its promise of equal
results: a frame that waits for the detector when the next one comes is left out. `--connect` takes what PX4 sends on
its onboard link (`links.py` has the kinds of links); `--peer` is the link to the other companion, one of the two
`udpin`, the other `udpout`.
"""

import argparse
import contextlib
import json
import signal
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2

from sitl_emu.gcs.heartbeat import Heartbeat
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.missions.companion.camera import CameraError, CameraSource, open_camera
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, PEER_LINK, Companion, Event
from sitl_emu.missions.companion.detection_log import DetectionLog
from sitl_emu.missions.companion.feeds import Feed, FeedError, open_feed
from sitl_emu.missions.companion.harness import Harness, Received
from sitl_emu.missions.companion.inference import Inference
from sitl_emu.missions.companion.links import Link, LinkError, Port, open_port, wait
from sitl_emu.missions.companion.live_frames import BootClock, LiveFrames
from sitl_emu.missions.companion.logs import Log
from sitl_emu.missions.companion.peer_link import MAV_TYPE_ONBOARD_CONTROLLER
from sitl_emu.missions.companion.pictures import Album
from sitl_emu.missions.registry import MissionError, make_companion, programs

STEP_S = 0.02
STATUS_EVERY_US = 5_000_000
LONGEST_LATENCY_S = 60.0


class Runner:
    """Drives one companion in real time."""

    def __init__(
        self,
        companion: Companion,
        ports: Mapping[str, Port],
        camera: CameraSource | None,
        log_dir: Path | None,
        camera_latency_us: int,
        feeds: Sequence[Feed] = (),
    ) -> None:
        """`ports` by the names of their links; `log_dir` takes tlogs, events.jsonl, detections.jsonl and frames/.

        `feeds`: of depth images and point clouds, of which the newest are taken at each step.
        """
        self._feeds = feeds
        epoch_us = (time.time_ns() - time.monotonic_ns()) // 1000
        links = {
            name: Link(port, TlogWriter(log_dir / f"{name}.tlog") if log_dir is not None else None, epoch_us)
            for name, port in ports.items()
        }
        self._clock = BootClock()
        self._frames = LiveFrames(camera, self._clock, camera_latency_us) if camera is not None else None
        detections = DetectionLog(log_dir / "detections.jsonl") if log_dir is not None else None
        self.harness = Harness(companion, links, Inference(companion.detect), _album(log_dir), detections)
        self._knock = Heartbeat(MAV_TYPE_ONBOARD_CONTROLLER)
        events = log_dir / "events.jsonl" if log_dir is not None else None
        self._events = Log(events, events.open("w", buffering=1)) if events is not None else None
        self._told_us, self._told = 0, ""

    def step(self) -> None:
        """Waits for messages, at most `STEP_S`, and goes on. Raises LinkError where nothing can ever be sent."""
        links = self.harness.links
        ready = wait(links, STEP_S)
        now_us = time.monotonic_ns() // 1000
        received = self._received(now_us, ready)
        frames = self._frames.take(now_us) if self._frames is not None else []
        if not self.harness.companion.system_id:
            # An autopilot that was sent nothing does not know where we are: it speaks to its standing port alone.
            self.harness.send(now_us, [(AUTOPILOT_LINK, msg) for msg in self._knock.on_time(now_us)])
        ranges = [one for feed in self._feeds if (one := feed.newest()) is not None]
        self._tell(now_us, self.harness.step(now_us, received, frames, ranges))

    def close(self) -> None:
        """Lets links, camera and logs go."""
        if self._frames is not None:
            self._frames.close()
        for feed in self._feeds:
            feed.close()
        self.harness.close()
        if self._events is not None:
            self._events.close()

    def _received(self, now_us: int, ready: list[str]) -> Iterator[Received]:
        """All that has come on these links."""
        for name in ready:
            while (messages := self.harness.links[name].receive(now_us)) is not None:
                for message in messages:
                    if name == AUTOPILOT_LINK:
                        self._clock.heard(now_us, message)
                    yield name, message

    def _tell(self, now_us: int, events: list[Event]) -> None:
        for event in events:
            tell(f"{event.kind}: {event.text}")
            self._write_down(now_us, event)
        if self._frames is not None and self._frames.error is not None:
            sys.stderr.write(f"camera: {self._frames.error}\n")
            self._frames.error = None
        status = self.harness.companion.status
        told = f"{status.phase} {status.progress:.0%}: {status.text}"
        if told != self._told and now_us - self._told_us > STATUS_EVERY_US:
            self._told, self._told_us = told, now_us
            tell(told)

    def _write_down(self, now_us: int, event: Event) -> None:
        if self._events is not None:
            line = json.dumps({"time_s": time.time(), **event.line}) + "\n"
            self._events.write(lambda file: file.write(line))
            if self._events.error:
                self.harness.say(now_us, self._events.error)


def _album(log_dir: Path | None) -> Album | None:
    """Pictures beside the events."""
    if log_dir is None:
        return None
    (log_dir / "frames").mkdir(exist_ok=True)
    return Album(log_dir / "frames", "frame")


def tell(line: str) -> None:
    """A line for people, at once. That it can't be written, as into a file on a disk that is full, ends no flight."""
    with contextlib.suppress(OSError):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


def parse(arguments: list[str]) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -P -m sitl_emu.missions.companion.main", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--mission", required=True, metavar="NAME", help=f"one of {', '.join(sorted(programs()))}")
    parser.add_argument(
        "--connect", required=True, metavar="URL", help="the autopilot: udpin:HOST:PORT, udpout:…, /dev/ttyX[:BAUD]"
    )
    parser.add_argument("--peer", metavar="URL", help="the other companion: udpin:HOST:PORT or udpout:HOST:PORT")
    parser.add_argument("--camera", metavar="SOURCE", help="shm:NAME, a folder, a video file, rtsp://… or /dev/videoN")
    parser.add_argument(
        "--feed", action="append", default=[], metavar="SOURCE", help="depth images or point clouds: shm:NAME"
    )
    parser.add_argument(
        "--camera-latency",
        type=float,
        default=0.05,
        metavar="SECONDS",
        help="how old a live camera's frames are (0.05)",
    )
    parser.add_argument("--plan", type=Path, metavar="FILE", help="a QGroundControl .plan file")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="an option of the mission")
    parser.add_argument("--log-dir", type=Path, metavar="DIR", help="folder for tlogs and events.jsonl")
    parser.add_argument(
        "--exit-when-idle",
        type=float,
        metavar="SECONDS",
        help="end when there was nothing more to do for so long (default: wait for a peer's next request)",
    )
    return parser.parse_args(arguments)


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The mission's options: numbers where they look like numbers."""
    options: dict[str, Any] = {} if arguments.plan is None else {"plan": str(arguments.plan)}
    for option in arguments.option:
        name, equals, value = option.partition("=")
        if not equals:
            raise MissionError(f"--option {option}: allowed: NAME=VALUE")
        try:
            options[name] = float(value)
        except ValueError:
            options[name] = value
    return options


def prepare_log_dir(folder: Path) -> None:
    """Make it; raises MissionError with the remedy."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MissionError(f"--log-dir {folder}: can't write there: {error.strerror}; name another folder") from None


def latency_us(seconds: float) -> int:
    """In microseconds; raises MissionError with the remedy."""
    if not 0.0 <= seconds <= LONGEST_LATENCY_S:
        raise MissionError(f"--camera-latency {seconds:g}: allowed: seconds, 0 to {LONGEST_LATENCY_S:g}")
    return round(seconds * 1e6)


def main(arguments: list[str] | None = None) -> int:
    """Runs until the mission is done or somebody stops it. Returns 0 for success, 1 for not, 2 for no start."""
    given = parse(sys.argv[1:] if arguments is None else arguments)
    ports: dict[str, Port] = {}
    try:
        latency = latency_us(given.camera_latency)
        companion = make_companion(given.mission, options_of(given))
        if given.log_dir is not None:
            prepare_log_dir(given.log_dir)
        ports[AUTOPILOT_LINK] = open_port(given.connect)
        if given.peer:
            ports[PEER_LINK] = open_port(given.peer)
        cv2.setNumThreads(1)
        camera = open_camera(given.camera) if given.camera else None
        feeds = [open_feed(url) for url in given.feed]
        runner = Runner(companion, ports, camera, given.log_dir, latency, feeds)
    except (MissionError, LinkError, CameraError, FeedError, OSError) as error:
        for port in ports.values():
            port.close()
        sys.stderr.write(f"sitl_emu.missions.companion.main: {error}\n")
        return 2
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    idle_s = given.exit_when_idle if given.exit_when_idle is not None else float("inf")
    worked, idle_since_s = False, time.monotonic()
    try:
        while not stopped.is_set():
            runner.step()
            status = companion.status
            if not status.done:
                worked, idle_since_s = True, time.monotonic()
            elif status.phase == "done" or (worked and time.monotonic() - idle_since_s > idle_s):
                break
    except LinkError as error:
        sys.stderr.write(f"sitl_emu.missions.companion.main: {error}\n")
        return 1
    finally:
        runner.close()
    outcome = companion.status.outcome
    tell(f"outcome: {outcome or 'stopped'}")
    return 0 if outcome == "success" else 1


if __name__ == "__main__":
    sys.exit(main())
