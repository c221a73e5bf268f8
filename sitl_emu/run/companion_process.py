"""The process of one companion of ours in a run: a mission's state machine, in lockstep with the simulation.

At each step it reads exactly the datagrams and frames that it is told of (of an autopilot from outside, what is there),
then lets the harness step the mission's state machine, and says what it sent. The very same harness drives it on real
hardware, in `sitl_emu.missions.companion.main`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import cv2

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.missions.companion.camera import CameraError, Frame, SharedFrames
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, PEER_LINK
from sitl_emu.missions.companion.detection_log import DetectionLog
from sitl_emu.missions.companion.feeds import Feed, FeedError, Ranges
from sitl_emu.missions.companion.harness import Harness, Received
from sitl_emu.missions.companion.inference import Inference
from sitl_emu.missions.companion.links import Link, LinkError, UdpPort
from sitl_emu.missions.companion.pictures import Album
from sitl_emu.missions.registry import MissionError, make_companion
from sitl_emu.run.configs import CompanionConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.link_sockets import PrivateSocket
from sitl_emu.run.memory import settle
from sitl_emu.run.messages import FrameTaken, Ready, Start, Step, Stepped, Waiting
from sitl_emu.run.process import StartError, main

CAMERA = "camera"
"""The feed that carries images."""
One = TypeVar("One")
LOOPBACK = "127.0.0.1"
UNDER_WAY_LIMIT_S = 10.0
IN_LOCKSTEP = (AUTOPILOT_LINK, PEER_LINK)
"""The links whose datagrams are counted on both sides."""


class Feeds:
    """The feeds of the simulator's camera, depth camera and lidar, by the numbers that the conductor tells."""

    def __init__(self, rings: Mapping[str, str]) -> None:
        """`rings`: names of shared memory, by feed. Raises CameraError and FeedError."""
        self._camera: SharedFrames | None = None
        self._ranging = dict[str, Feed]()
        self.lost = 0
        """Frames that were overwritten before they were read."""
        for feed, ring in rings.items():
            if feed == CAMERA:
                self._camera = SharedFrames(ring)
            else:
                self._ranging[feed] = Feed(ring)

    def images(self, told: Sequence[FrameTaken]) -> list[Frame]:
        """The camera's, of those told of."""
        camera = self._camera
        return self._there([camera.at(one.index) for one in told if one.feed == CAMERA]) if camera is not None else []

    def ranges(self, told: Sequence[FrameTaken]) -> list[Ranges]:
        """Depth images and point clouds, of those told of."""
        return self._there([self._ranging[one.feed].at(one.index) for one in told if one.feed != CAMERA])

    def close(self) -> None:
        """Let go of all."""
        for feed in (self._camera, *self._ranging.values()):
            if feed is not None:
                feed.close()

    def _there(self, taken: list[One | None]) -> list[One]:
        there = [one for one in taken if one is not None]
        self.lost += len(taken) - len(there)
        return there


def step(harness: Harness, feeds: Feeds, message: Step) -> Stepped:
    """Read what has come, act, send; the answer to the conductor. Raises LinkError."""
    now_us = message.now_us
    counts = {AUTOPILOT_LINK: message.autopilot, PEER_LINK: message.peer}
    in_lockstep = [name for name in IN_LOCKSTEP if name in harness.links]
    sent_before = {name: harness.links[name].sent for name in in_lockstep}
    received = list[Received]()
    for name in in_lockstep:
        received += [(name, one) for one in _received(harness.links[name], now_us, counts[name])]
    told = message.frames
    events = harness.step(now_us, received, feeds.images(told), feeds.ranges(told))
    sent = {name: harness.links[name].sent - before for name, before in sent_before.items()}
    dropped = feeds.lost + harness.inference.dropped
    status = harness.companion.status
    of_autopilot, of_peer = sent.get(AUTOPILOT_LINK, 0), sent.get(PEER_LINK, 0)
    return Stepped(of_autopilot, of_peer, status, tuple(events), dropped, harness.looks)


def _received(link: Link, now_us: int, count: int | None) -> list[mavlink.MAVLink_message]:
    """The messages of so many datagrams; None: of those that are there. Raises LinkError."""
    if count is not None:
        return link.receive_exactly(now_us, count)
    messages = list[mavlink.MAVLink_message]()
    while (some := link.receive(now_us)) is not None:
        messages += some
    return messages


def run(config: CompanionConfig, control: ControlChannel) -> None:
    """Step whenever the conductor says so, until the run ends."""
    cv2.setNumThreads(1)
    folder = Path(config.folder)
    try:
        companion = make_companion(config.mission, dict(config.options))
        links = _links(config, folder)
    except (MissionError, LinkError) as error:
        raise StartError(str(error)) from None
    peer = links[PEER_LINK].port if PEER_LINK in links else None
    control.send(Waiting())
    control.expect(Start)
    try:
        feeds = Feeds(config.rings)
    except (CameraError, FeedError) as error:
        raise StartError(str(error)) from None
    inference = Inference(companion.detect, config.inference_latency_us, most_waiting=None)
    detections = DetectionLog(folder / f"{config.name}-detections.jsonl") if CAMERA in config.rings else None
    harness = Harness(companion, links, inference, Album(folder / "frames", config.name), detections)
    try:
        settle()
        control.send(Ready(peer.address[1] if isinstance(peer, UdpPort) else None))
        while isinstance(message := control.receive(), Step):
            control.send(step(harness, feeds, message))
    finally:
        harness.close()
        feeds.close()


def _links(config: CompanionConfig, folder: Path) -> dict[str, Link]:
    """To the autopilot, and to the peer radio if there is one."""
    links = {AUTOPILOT_LINK: Link(_onboard_port(config))}
    if config.radio_port is not None:
        log = TlogWriter(folder / f"{config.name}-peer.tlog")
        links[PEER_LINK] = Link(_counted_port(0, config.radio_port, True), log, config.start_us)
    return links


def _onboard_port(config: CompanionConfig) -> UdpPort:
    if config.isolated is None:
        onboard = ports.onboard(config.instance)
        return _counted_port(onboard.remote, onboard.local, config.lockstep)
    end = config.isolated.companion
    assert end is not None
    own = PrivateSocket.inherited(end)
    return UdpPort(own.opened, (LOOPBACK, own.other_port), remote_alone=True, wait_s=_wait_s(config.lockstep))


def _counted_port(local: int, remote: int, counted: bool) -> UdpPort:
    """What comes from elsewhere than the remote port is left aside: it is in nobody's count."""
    return UdpPort((LOOPBACK, local), (LOOPBACK, remote), remote_alone=True, wait_s=_wait_s(counted))


def _wait_s(counted: bool) -> float:
    """How long a datagram is waited for."""
    return UNDER_WAY_LIMIT_S if counted else 0.0


if __name__ == "__main__":
    main(run, CompanionConfig)
