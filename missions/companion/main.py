"""The runner of a companion on hardware, or beside any PX4: real clock, UDP sockets, a camera, a detector thread.

    python -P -m missions.companion.main --mission NAME --plan field.plan
        --connect udpin:0.0.0.0:14540 --camera rtsp://camera/stream --peer udpout:192.168.1.7:14600

It drives the same state machines as a simulated run, without its promise of equal results: frames that come while the
detector is busy are left out. `--connect` takes what PX4 sends on its onboard link (`udpin:HOST:PORT` waits for it,
`udpout:HOST:PORT` speaks first, `/dev/ttyX[:BAUD]` is a serial port); `--peer` is the link to the other companion, one
of the two `udpin`, the other `udpout`. This file alone reads the clock and opens sockets; MAVLink signing, TCP and
several peers on one socket are not supported.

Time of a frame: the simulator and recorded frames carry the vehicle's boot time. For a stream or a device it is the
time it was read, less `--camera-latency`, brought to the vehicle's boot time by the fastest telemetry of the last 10 s.
"""

import argparse
import json
import select
import signal
import socket
import sys
import threading
import time
from collections import deque
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import cv2

from gcs.heartbeat import Heartbeat
from gcs.tlog import TlogWriter
from missions.companion.camera import CameraError, CameraSource, Frame, RecordedFrames, open_camera
from missions.companion.companion import AUTOPILOT_LINK, GROUND_LINK, PEER_LINK, Companion, Outgoing
from missions.companion.detector import Detection
from missions.companion.peer_link import MAV_TYPE_ONBOARD_CONTROLLER
from missions.companion.wire import Wire
from missions.registry import MissionError, make_companion, programs
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.framing import Splitter

STEP_S = 0.02
STRANGER = 255
"""The system that we speak as until our vehicle's is known."""
OFFSET_WINDOW_US = 10_000_000
STATUS_EVERY_US = 5_000_000
DEFAULT_BAUD = 921600


class LinkError(Exception):
    """A link that can't be opened; one line for people."""


class Port(Protocol):
    """Bytes in and out."""

    def fileno(self) -> int:
        """For select."""
        ...

    def receive(self) -> bytes:
        """What has come, b"" if nothing."""
        ...

    def send(self, frame: bytes) -> None:
        """Send a frame; what can't be sent is lost, as on any radio."""
        ...

    def close(self) -> None:
        """Let the port go."""
        ...


class UdpPort:
    """`udpin:HOST:PORT` answers whoever sent last, `udpout:HOST:PORT` sends there."""

    def __init__(self, kind: str, host: str, port: int) -> None:
        """Raises LinkError when the address can't be bound."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._remote: tuple[str, int] | None = (host, port) if kind == "udpout" else None
        self._follow = kind == "udpin"
        if self._follow:
            try:
                self._socket.bind((host, port))
            except OSError as error:
                self._socket.close()
                raise LinkError(
                    f"UDP port {port} can't be bound ({error.strerror}); end the program that holds it, or take another"
                ) from None

    def fileno(self) -> int:
        """For select."""
        return self._socket.fileno()

    def receive(self) -> bytes:
        """One datagram."""
        try:
            data, remote = self._socket.recvfrom(65535)
        except OSError:
            return b""
        if self._follow:
            self._remote = remote
        return data

    def send(self, frame: bytes) -> None:
        """Send a datagram, to nobody as long as nobody is known."""
        if self._remote is not None:
            try:
                self._socket.sendto(frame, self._remote)
            except OSError:
                return

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class SerialPort:
    """`/dev/ttyX[:BAUD]`; needs pyserial. Frames are put together from the bytes as they come."""

    def __init__(self, device: str, baud: int) -> None:
        """Raises LinkError when the device can't be opened, or pyserial is not there."""
        try:
            import serial  # type: ignore[import-untyped,unused-ignore]
        except ImportError:
            raise LinkError(f"{device}: a serial link needs pyserial: pip install pyserial") from None
        try:
            self._serial = serial.Serial(device, baud, timeout=0, write_timeout=0.2)
        except (OSError, ValueError) as error:
            raise LinkError(f"{device}: can't be opened: {error}") from None
        self._splitter = Splitter()

    def fileno(self) -> int:
        """For select."""
        return int(self._serial.fileno())

    def receive(self) -> bytes:
        """Whole frames of what has come."""
        return b"".join(self._splitter.feed(bytes(self._serial.read(4096))))

    def send(self, frame: bytes) -> None:
        """Write a frame."""
        try:
            self._serial.write(frame)
        except OSError:
            return

    def close(self) -> None:
        """Close the device."""
        self._serial.close()


def open_port(url: str) -> Port:
    """Opens a link by its URL. Raises LinkError."""
    if url.startswith("/dev/"):
        device, _, baud = url.partition(":")
        if baud and not baud.isdigit():
            raise LinkError(f"{url}: {baud!r}; allowed: a baud rate, as in /dev/ttyUSB0:921600")
        return SerialPort(device, int(baud or DEFAULT_BAUD))
    parts = url.replace("://", ":").split(":")
    if len(parts) != 3 or parts[0] not in ("udpin", "udpout") or not parts[2].isdigit() or int(parts[2]) > 65535:
        raise LinkError(f"{url!r}: no link; allowed: udpin:HOST:PORT, udpout:HOST:PORT, /dev/ttyX[:BAUD]")
    return UdpPort(parts[0], parts[1], int(parts[2]))


class BootClock:
    """From this computer's time to the vehicle's boot time: the smallest delay of the last 10 s counts as none."""

    def __init__(self) -> None:
        self._offsets: deque[tuple[int, int]] = deque()

    def heard(self, now_us: int, msg: mavlink.MAVLink_message) -> None:
        """A message of the autopilot came in, which may bear its boot time."""
        time_boot_ms = getattr(msg, "time_boot_ms", None)
        if time_boot_ms is None or msg.get_srcComponent() != 1:
            return
        offset = time_boot_ms * 1000 - now_us
        while self._offsets and self._offsets[-1][1] <= offset:
            self._offsets.pop()
        self._offsets.append((now_us, offset))
        while self._offsets[0][0] < now_us - OFFSET_WINDOW_US:
            self._offsets.popleft()

    def boot_us(self, now_us: int) -> int | None:
        """The vehicle's boot time now; None before it was heard."""
        return now_us + self._offsets[0][1] if self._offsets else None


class Found(NamedTuple):
    """A frame with what the detector found in it."""

    frame: Frame
    detections: list[Detection]


class Eyes:
    """Reads the camera and runs the detector in a thread; at most one frame is under way."""

    def __init__(self, source: CameraSource, companion: Companion) -> None:
        self.source, self._companion = source, companion
        self._frames: deque[tuple[Frame, int]] = deque(maxlen=2)
        self._wanted: deque[tuple[Frame, float]] = deque(maxlen=1)
        self._found: deque[Found] = deque()
        self._stop = threading.Event()
        self.error: str | None = None
        self._threads = [
            threading.Thread(target=self._detect, name="detector", daemon=True),
            threading.Thread(target=self._read, name="camera", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def frames(self) -> list[tuple[Frame, int]]:
        """Frames that have come, each with this computer's time at which it was read."""
        taken = []
        while self._frames:
            taken.append(self._frames.popleft())
        return taken

    def want(self, frame: Frame, gsd_m: float) -> None:
        """Has the detector look at a frame; one that waits still is left out for it."""
        self._wanted.append((frame, gsd_m))

    def found(self) -> list[Found]:
        """Results since the last call."""
        taken = []
        while self._found:
            taken.append(self._found.popleft())
        return taken

    def close(self) -> None:
        """Ends the threads and lets the camera go."""
        self._stop.set()
        for thread in self._threads:
            thread.join(timeout=2.0)
        self.source.close()

    def _read(self) -> None:
        # Recorded frames are fed by the main loop, at their own time.
        while not self._stop.is_set() and not isinstance(self.source, RecordedFrames) and not self.source.ended:
            try:
                frame = self.source.read()
            except CameraError as error:
                self.error = str(error)
                return
            if frame is None:
                self._stop.wait(0.002)
                continue
            self._frames.append((frame, time.monotonic_ns() // 1000))
            if self.source.clock == "file":
                self._stop.wait(1 / 30)

    def _detect(self) -> None:
        while not self._stop.is_set():
            if not self._wanted:
                self._stop.wait(0.002)
                continue
            frame, gsd_m = self._wanted.popleft()
            detections = self._companion.detect(frame.image, gsd_m)
            self._found.append(Found(frame, list(detections)))


class Runner:
    """Drives one companion in real time."""

    def __init__(
        self,
        companion: Companion,
        ports: dict[str, Port],
        eyes: Eyes | None,
        log_dir: Path | None,
        camera_latency_us: int,
    ) -> None:
        self.companion, self.ports, self.eyes = companion, ports, eyes
        self.camera_latency_us = camera_latency_us
        self.wires = {name: Wire() for name in ports}
        self.clock = BootClock()
        self._knock = Heartbeat(MAV_TYPE_ONBOARD_CONTROLLER)
        self._logs = {name: TlogWriter(log_dir / f"{name}.tlog") for name in ports} if log_dir is not None else {}
        self._events = (log_dir / "events.jsonl").open("w") if log_dir is not None else None
        self._told_us, self._told = 0, ""

    def step(self) -> None:
        """Waits for messages, at most `STEP_S`, and goes on."""
        readable, _, _ = select.select(list(self.ports.values()), [], [], STEP_S)
        now_us = time.monotonic_ns() // 1000
        for name, port in self.ports.items():
            while port in readable and (data := port.receive()):
                for msg in self.wires[name].decode(data):
                    self._log(name, bytes(msg.get_msgbuf()))
                    if name == GROUND_LINK:
                        continue
                    if name == AUTOPILOT_LINK:
                        self.clock.heard(now_us, msg)
                    self._send(self.companion.on_message(now_us, name, msg))
        if self.eyes is not None:
            self._look(now_us, self.eyes)
        if not self.companion.system_id:
            # An autopilot that was sent nothing does not know where we are: it speaks to its standing port alone.
            self._send([(AUTOPILOT_LINK, msg) for msg in self._knock.on_time(now_us)])
        self._send(self.companion.on_time(now_us))
        self._tell(now_us)

    def close(self) -> None:
        """Lets links, camera and logs go."""
        if self.eyes is not None:
            self.eyes.close()
        for port in self.ports.values():
            port.close()
        for log in self._logs.values():
            log.close()
        if self._events is not None:
            self._events.close()

    def _look(self, now_us: int, eyes: Eyes) -> None:
        frames = eyes.frames()
        source = eyes.source
        boot_us = self.clock.boot_us(now_us)
        if isinstance(source, RecordedFrames) and boot_us is not None:
            while (next_us := source.next_time_usec) is not None and next_us <= boot_us:
                frame = source.read()
                if frame is not None:
                    frames.append((frame, now_us))
        for frame, read_us in frames:
            if source.clock != "vehicle":
                boot_us = self.clock.boot_us(read_us - self.camera_latency_us)
                if boot_us is None:
                    continue
                frame = frame._replace(time_usec=boot_us)
            gsd_m = self.companion.wants_frame(frame.time_usec)
            if gsd_m is not None:
                eyes.want(frame, gsd_m)
        for found in eyes.found():
            self._send(self.companion.on_detections(now_us, found.frame.time_usec, found.detections))
        if eyes.error is not None:
            sys.stderr.write(f"camera: {eyes.error}\n")
            eyes.error = None

    def _send(self, outgoing: Outgoing) -> None:
        for name, msg in outgoing:
            if name in self.ports:
                self.wires[name].system = self.companion.system_id or STRANGER
                frame = self.wires[name].encode(msg)
                self._log(name, frame)
                self.ports[name].send(frame)

    def _log(self, name: str, frame: bytes) -> None:
        if name in self._logs:
            self._logs[name].write(time.time_ns() // 1000, frame)

    def _tell(self, now_us: int) -> None:
        for event in self.companion.events():
            tell(f"{event.kind}: {event.text}")
            if self._events is not None:
                line = {"time_s": time.time(), "event": event.kind, "text": event.text, **event.data}
                self._events.write(json.dumps(line) + "\n")
                self._events.flush()
        status = self.companion.status
        told = f"{status.phase} {status.progress:.0%}: {status.text}"
        if told != self._told and now_us - self._told_us > STATUS_EVERY_US:
            self._told, self._told_us = told, now_us
            tell(told)


def tell(line: str) -> None:
    """A line for people, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def parse(arguments: list[str]) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -P -m missions.companion.main", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--mission", required=True, metavar="NAME", help=f"one of {', '.join(sorted(programs()))}")
    parser.add_argument(
        "--connect", required=True, metavar="URL", help="the autopilot: udpin:HOST:PORT, udpout:…, /dev/ttyX[:BAUD]"
    )
    parser.add_argument("--peer", metavar="URL", help="the other companion: udpin:HOST:PORT or udpout:HOST:PORT")
    parser.add_argument(
        "--ground", metavar="URL", help="a ground station that is to see our texts, udpout:HOST:14550; send only"
    )
    parser.add_argument("--camera", metavar="SOURCE", help="shm:NAME, a folder, a video file, rtsp://… or /dev/videoN")
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


def main(arguments: list[str] | None = None) -> int:
    """Runs until the mission is done or somebody stops it. Returns 0 for success, 1 for not, 2 for no start."""
    given = parse(sys.argv[1:] if arguments is None else arguments)
    ports: dict[str, Port] = {}
    try:
        companion = make_companion(given.mission, options_of(given))
        if given.log_dir is not None:
            prepare_log_dir(given.log_dir)
        ports[AUTOPILOT_LINK] = open_port(given.connect)
        if given.peer:
            ports[PEER_LINK] = open_port(given.peer)
        if given.ground:
            ports[GROUND_LINK] = open_port(given.ground)
        cv2.setNumThreads(1)
        eyes = Eyes(open_camera(given.camera), companion) if given.camera else None
        runner = Runner(companion, ports, eyes, given.log_dir, round(given.camera_latency * 1e6))
    except (MissionError, LinkError, CameraError, OSError) as error:
        for port in ports.values():
            port.close()
        sys.stderr.write(f"missions.companion.main: {error}\n")
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
    finally:
        runner.close()
    outcome = companion.status.outcome
    tell(f"outcome: {outcome or 'stopped'}")
    return 0 if outcome == "success" else 1


if __name__ == "__main__":
    sys.exit(main())
