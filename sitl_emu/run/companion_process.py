"""The process of one companion of ours in a run: a mission's state machine, in lockstep with the simulation.

At each step it reads exactly the datagrams and frames that it is told of, then lets the mission's state machine act,
and says what it sent. Its detector works in a thread while simulated time goes on; a frame's detections are handed over
`inference_latency_s` after the frame came, waiting for the thread if need be: so no frame is dropped and results do not
depend on the CPU. The very same state machine runs on real hardware under `missions.companion.main`.
"""

import contextlib
import socket
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import cv2

from gcs.tlog import TlogWriter
from missions.companion.camera import CameraError, Frame, FrameRingReader, Image
from missions.companion.companion import AUTOPILOT_LINK, GROUND_LINK, PEER_LINK, Companion, Event, Outgoing
from missions.companion.detector import Detection
from missions.companion.wire import Wire
from missions.registry import MissionError, make_companion
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.framing import split
from sitl_emu.run.configs import CompanionConfig
from sitl_emu.run.control import ControlChannel, Message
from sitl_emu.run.process import StartError, main, settle

LOOPBACK = "127.0.0.1"
RECEIVE_BUFFER_BYTES = 4 << 20
LARGEST_DATAGRAM_BYTES = 65535
UNDER_WAY_LIMIT_S = 10.0
KEPT_FRAMES = 96
"""Of those with detections: a target is confirmed seconds after the frame that showed it best."""
BOX_COLOUR, TEXT_COLOUR, FOUND_COLOUR = (0, 200, 255), (255, 255, 255), (60, 60, 255)


class UdpLink:
    """A MAVLink link of the companion: exactly so many datagrams in, messages out, all logged.

    What comes from elsewhere than the remote port is left aside: it is in nobody's count. From instance 9 on,
    every PX4 of a machine sends to one port.
    """

    def __init__(self, name: str, local_port: int, remote_port: int, log: TlogWriter | None, start_us: int) -> None:
        """Bind a local port (0: any). Raises StartError when it is taken."""
        self.wire = Wire()
        self.sent = 0
        """Datagrams sent since the last step."""
        self._remote, self._log, self._start_us = (LOOPBACK, remote_port), log, start_us
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._socket.settimeout(UNDER_WAY_LIMIT_S)
        try:
            self._socket.bind((LOOPBACK, local_port))
        except OSError as error:
            raise StartError(
                f"UDP port {local_port} (the companion's {name} link) can't be bound: {error.strerror}; "
                "end the program that holds it"
            ) from None

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._socket.getsockname()[1])

    def read(self, now_us: int, exactly: int) -> list[mavlink.MAVLink_message]:
        """The messages in the next `exactly` datagrams of the remote port."""
        messages, left = list[mavlink.MAVLink_message](), exactly
        while left:
            datagram, sender = self._socket.recvfrom(LARGEST_DATAGRAM_BYTES)
            if sender == self._remote:
                left -= 1
                self._write(now_us, datagram)
                messages += self.wire.decode(datagram)
        return messages

    def send(self, now_us: int, message: mavlink.MAVLink_message) -> None:
        """Send one message as a datagram."""
        frame = self.wire.encode(message)
        self._write(now_us, frame)
        self._socket.sendto(frame, self._remote)
        self.sent += 1

    def close(self) -> None:
        """Make the log whole, free the port."""
        if self._log is not None:
            self._log.close()
        self._socket.close()

    def _write(self, now_us: int, datagram: bytes) -> None:
        if self._log is not None:
            for frame in split(datagram):
                self._log.write(self._start_us + now_us, frame)


class GroundLink:
    """Straight to the ground station, send only: PX4 does not forward a companion's texts."""

    def __init__(self, remote: tuple[str, int]) -> None:
        self._wire, self._remote = Wire(), remote
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(self, system: int, message: mavlink.MAVLink_message) -> None:
        """Send one message; nobody needs to listen."""
        self._wire.system = system
        with contextlib.suppress(OSError):
            self._socket.sendto(self._wire.encode(message), self._remote)

    def close(self) -> None:
        """Free the port."""
        self._socket.close()


class Looked(NamedTuple):
    """A frame that the detector looks at, or has looked at."""

    frame: Frame
    due_us: int
    """Simulated time at which its detections are there."""
    detections: "Future[Sequence[Detection]]"


class Eyes:
    """Camera frames in, detections out after the inference latency; the detector works in a thread meanwhile."""

    def __init__(self, camera: FrameRingReader, companion: Companion, inference_latency_us: int) -> None:
        self._camera, self._companion, self._latency_us = camera, companion, inference_latency_us
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="detector")
        self._looking: deque[Looked] = deque()
        self._looked: deque[Looked] = deque(maxlen=KEPT_FRAMES)
        self.dropped = 0

    def take(self, now_us: int, index: int) -> None:
        """A frame has come: have the detector look at it if the mission wants that."""
        frame = self._camera.read()
        while frame is not None and frame.index < index:
            frame = self._camera.read_index(index)
        if frame is None:
            self.dropped += 1
            return
        gsd_m = self._companion.wants_frame(frame.time_usec)
        if gsd_m is not None:
            found = self._worker.submit(self._companion.detect, frame.image, gsd_m)
            self._looking.append(Looked(frame, now_us + self._latency_us, found))

    def due(self, now_us: int) -> list[tuple[int, Sequence[Detection]]]:
        """(frame time, detections) due by now; waits for the detector if it is not through."""
        ready = list[tuple[int, Sequence[Detection]]]()
        while self._looking and self._looking[0].due_us <= now_us:
            looked = self._looking.popleft()
            found = looked.detections.result()
            ready.append((looked.frame.time_usec, found))
            if found:
                self._looked.append(looked)
        return ready

    def picture(self, frame_time_us: int, event: Event) -> Image | None:
        """The frame of a moment with its detections drawn, the one that the event tells of in red."""
        for looked in self._looked:
            if looked.frame.time_usec == frame_time_us:
                return draw(looked.frame.image, looked.detections.result(), event)
        return None

    def close(self) -> None:
        """End the thread, let go of the camera."""
        self._worker.shutdown(cancel_futures=True)
        self._camera.close()


def draw(image: Image, detections: Sequence[Detection], event: Event) -> Image:
    """A copy of a frame with boxes around its detections, and the event's text."""
    drawn = image.copy()
    for found in detections:
        _box(drawn, found.x, found.y, found.w, found.h, BOX_COLOUR, f"{found.label} {found.score:.2f}")
    if "x" in event.data:
        x, y, w, h = (float(event.data[key]) for key in ("x", "y", "w", "h"))
        _box(drawn, x, y, w, h, FOUND_COLOUR, "")
    cv2.putText(drawn, f"t = {event.time_us / 1e6:.1f} s  {event.text}"[:90], (6, 16), 0, 0.42, TEXT_COLOUR, 1, 16)
    return drawn


def _box(image: Image, x: float, y: float, w: float, h: float, colour: tuple[int, int, int], text: str) -> None:
    left, top, right, bottom = round(x - w / 2), round(y - h / 2), round(x + w / 2), round(y + h / 2)
    cv2.rectangle(image, (left, top), (right, bottom), colour, 2)
    cv2.putText(image, text, (left, max(30, top - 4)), 0, 0.42, colour, 1, 16)


class CompanionComputer:
    """A companion with its links and eyes, stepped by the conductor."""

    def __init__(
        self,
        name: str,
        companion: Companion,
        links: dict[str, UdpLink],
        ground: GroundLink,
        eyes: Eyes | None,
        pictures: Path,
    ) -> None:
        self._ground = ground
        self._name, self._companion, self._links, self._eyes, self._pictures = name, companion, links, eyes, pictures

    def step(self, message: Message) -> Message:
        """Read what has come, act, send; the answer to the conductor."""
        now_us, companion, links = message["step"], self._companion, self._links
        for link in links.values():
            link.sent = 0
        for name, link in links.items():
            for received in link.read(now_us, message[name]):
                self._send(now_us, companion.on_message(now_us, name, received))
        if self._eyes is not None:
            for index, _ in message["frames"]:
                self._eyes.take(now_us, index)
            for frame_time_us, detections in self._eyes.due(now_us):
                self._send(now_us, companion.on_detections(now_us, frame_time_us, detections))
        self._send(now_us, companion.on_time(now_us))
        answer: Message = {name: links[name].sent if name in links else 0 for name in (AUTOPILOT_LINK, PEER_LINK)}
        answer["status"] = companion.status._asdict()
        answer["events"] = [self._written(event) for event in companion.events()]
        answer["dropped"] = self._eyes.dropped if self._eyes is not None else 0
        return answer

    def close(self) -> None:
        """Make the logs whole, free ports and camera."""
        if self._eyes is not None:
            self._eyes.close()
        for link in self._links.values():
            link.close()
        self._ground.close()

    def _send(self, now_us: int, outgoing: Outgoing) -> None:
        system = self._companion.system_id
        for name, message in outgoing:
            if name in self._links:
                link = self._links[name]
                link.wire.system = system
                link.send(now_us, message)
            elif name == GROUND_LINK:
                self._ground.send(system, message)

    def _written(self, event: Event) -> Message:
        """An event as a line of events.jsonl; the picture it names is written beside."""
        line: Message = {"event": event.kind, "text": event.text, **event.data}
        if self._eyes is not None and "frame_time_us" in event.data:
            picture = self._eyes.picture(int(event.data["frame_time_us"]), event)
            if picture is not None:
                file = f"{self._name}-{int(event.data['frame_time_us']) // 1000:07d}-{event.kind}.jpg"
                cv2.imwrite(str(self._pictures / file), picture, [cv2.IMWRITE_JPEG_QUALITY, 88])
                line["picture"] = f"{self._pictures.name}/{file}"
        return line


def run(config: CompanionConfig, control: ControlChannel) -> None:
    """Step whenever the conductor says so, until the run ends."""
    cv2.setNumThreads(1)
    name, folder, start_us = config.name, Path(config.folder), config.start_us
    try:
        companion = make_companion(config.mission, dict(config.options))
    except MissionError as error:
        raise StartError(str(error)) from None
    onboard = ports.onboard(config.instance)
    links = {AUTOPILOT_LINK: UdpLink(AUTOPILOT_LINK, onboard.remote, onboard.local, None, start_us)}
    if config.radio_port is not None:
        log = TlogWriter(folder / f"{name}-peer.tlog")
        links[PEER_LINK] = UdpLink(PEER_LINK, 0, config.radio_port, log, start_us)
    control.send({"waiting": True})
    control.receive()
    eyes = None
    if config.ring is not None:
        try:
            eyes = Eyes(FrameRingReader(config.ring), companion, config.inference_latency_us)
        except CameraError as error:
            raise StartError(str(error)) from None
    ground = GroundLink(config.gcs or (LOOPBACK, ports.GCS_REMOTE))
    computer = CompanionComputer(name, companion, links, ground, eyes, folder / "frames")
    try:
        settle()
        control.send({"ready": True, "peer_port": links[PEER_LINK].port if PEER_LINK in links else None})
        while "end" not in (message := control.receive()):
            control.send(computer.step(message))
    finally:
        computer.close()


if __name__ == "__main__":
    main(run, CompanionConfig)
