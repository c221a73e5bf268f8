"""The one harness of a companion: which frames its detector sees, what becomes of its messages, events and pictures."""

import json
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.missions.companion.camera import Frame
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK, Candidate, Event, Outgoing, Status
from sitl_emu.missions.companion.detection_log import DetectionLog
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.harness import Harness
from sitl_emu.missions.companion.inference import MOST_FAILURES, Inference
from sitl_emu.missions.companion.links import Link, LinkError, UdpPort
from sitl_emu.missions.companion.pictures import Album
from sitl_emu.missions.companion.wire import Wire

US = 1_000_000
LIMIT_S = 5.0


def frame(index: int) -> Frame:
    return Frame(index * 100_000, np.full((48, 64, 3), index, np.uint8), index)


class Gate:
    """A detector that finds as many things as its picture says, but not before it is let."""

    def __init__(self) -> None:
        self.let, self.begun = threading.Semaphore(0), threading.Semaphore(0)

    def __call__(self, image: Any, gsd_m: float) -> list[Detection]:
        self.begun.release()
        assert self.let.acquire(timeout=LIMIT_S)
        return [Detection("fire", 0.9, 20.0, 20.0, 10.0, 10.0)] * int(image[0, 0, 0])


@pytest.fixture
def gate() -> Iterator[Gate]:
    made = Gate()
    yield made
    made.let.release(100)


def until(done: Callable[[], Sequence[Any]]) -> Sequence[Any]:
    """What a thread brings about."""
    waiting = threading.Event()
    for _ in range(round(LIMIT_S / 0.005)):
        if found := done():
            return found
        waiting.wait(0.005)
    raise AssertionError("it did not come about")


def test_on_hardware_one_frame_waits_and_a_newer_one_takes_its_place(gate: Gate) -> None:
    inference = Inference(gate, most_waiting=1)
    inference.look(0, frame(1), 0.0)
    assert gate.begun.acquire(timeout=LIMIT_S)  # the first is under way; the others wait
    for index in (2, 3, 4):
        inference.look(0, frame(index), 0.0)
    assert inference.due(US) == []  # and nobody waits for it
    gate.let.release(2)
    found = list(until(lambda: inference.due(US)))
    found += until(lambda: inference.due(US)) if len(found) < 2 else []
    assert [(one.frame.index, len(one.detections)) for one in found] == [(1, 1), (4, 4)]
    assert inference.dropped == 2
    inference.close()


def test_in_a_simulated_run_every_frame_is_looked_at_and_time_waits_for_the_detector(gate: Gate) -> None:
    inference = Inference(gate, latency_us=100_000, most_waiting=None)
    for index in range(1, 5):
        inference.look(index * 20_000, frame(index), 0.0)
    assert inference.due(119_999) == []
    gate.let.release(4)
    assert [one.frame.index for one in inference.due(140_000)] == [1, 2]
    assert [one.frame.index for one in inference.due(US)] == [3, 4]
    assert inference.dropped == 0
    inference.close()


def test_the_detector_works_with_arithmetic_that_repeats_itself() -> None:
    """OpenCV's switch for IPP is the thread's own."""

    def says(image: Any, gsd_m: float) -> list[Detection]:
        return [Detection("ipp" if cv2.ipp.useIPP() else "plain", 1.0, 0.0, 0.0, 1.0, 1.0)]

    inference = Inference(says, most_waiting=None)
    inference.look(0, frame(0), 0.0)
    assert [one.label for one in inference.due(0)[0].detections] == ["plain"]
    inference.close()


class Reporter:
    """A companion that answers every heartbeat, and reports the second frame when it has seen the third."""

    system_id = 7
    status = Status("watching", 0.0, False, "", "")

    def __init__(self) -> None:
        self.log: list[str] = []
        self._events: list[Event] = []

    def on_message(self, now_us: int, link: str, msg: Any) -> Outgoing:
        self.log.append(f"message on {link}")
        return [(link, mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)), ("nowhere", msg)]

    def wants_frame(self, frame_time_us: int) -> float | None:
        return None if frame_time_us == 400_000 else 0.05

    def detect(self, image: Any, gsd_m: float) -> list[Detection]:
        return [Detection("fire", 0.9, 20.0, 20.0, 10.0, 10.0)] * int(image[0, 0, 0])

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        self.log.append(f"{len(detections)} in frame {frame_time_us // 100_000}")
        if frame_time_us == 300_000:
            box: dict[str, float | int | str] = {"x": 20.0, "y": 20.0, "w": 10.0, "h": 10.0, "frame_time_us": 200_000}
            self._events.append(Event(now_us, "target_confirmed", "a fire", box))
        return []

    def on_time(self, now_us: int) -> Outgoing:
        self.log.append("time")
        return []

    def events(self) -> list[Event]:
        events, self._events = self._events, []
        return events


def test_a_step_is_messages_frames_detections_time_and_the_events_with_their_pictures(tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    vehicle = UdpPort(("127.0.0.1", 0), None, wait_s=LIMIT_S)
    link = Link(UdpPort(None, vehicle.address), TlogWriter(tmp_path / "autopilot.tlog"), epoch_us=5 * US)
    companion = Reporter()
    inference = Inference(companion.detect, most_waiting=None)
    harness = Harness(companion, {AUTOPILOT_LINK: link}, inference, Album(tmp_path / "frames", "uas"))
    message = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)
    events = harness.step(US, [(AUTOPILOT_LINK, message)], [frame(index) for index in range(5)])
    seen = ["0 in frame 0", "1 in frame 1", "2 in frame 2", "3 in frame 3"]
    assert companion.log == ["message on autopilot", *seen, "time"]
    data = vehicle.receive()
    assert data is not None
    assert [(msg.get_srcSystem(), msg.get_srcComponent()) for msg in Wire(skip=()).decode(data)] == [(7, 191)]
    lines = [event.line for event in events]
    assert [line["picture"] for line in lines] == ["frames/uas-0000200-target_confirmed.jpg"]
    assert lines[0]["event"] == "target_confirmed" and lines[0]["frame_time_us"] == 200_000
    picture = np.asarray(cv2.imread(str(tmp_path / str(lines[0]["picture"]))))
    assert picture.shape == (48, 64, 3) and picture[..., 2].max() > 200  # the box is drawn in red
    assert harness.step(2 * US, []) == []
    harness.close()
    vehicle.close()
    logged = (tmp_path / "autopilot.tlog").read_bytes()
    assert logged[:8] == (6 * US).to_bytes(8, "big") and logged[8:] == data


def test_a_datagram_that_was_announced_and_does_not_come_is_told() -> None:
    one = UdpPort(("127.0.0.1", 0), None)
    link = Link(UdpPort(None, one.address, remote_alone=True, wait_s=0.05))
    link.send(0, 1, mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    assert one.receive() is not None
    one.send(Wire(1, 1).encode(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)))
    with pytest.raises(LinkError, match="of 3 datagrams that were sent to us 2 have not come"):
        link.receive_exactly(0, 3)
    one.close()
    link.close()


class Doubtful(Reporter):
    """One that has candidates."""

    def candidates(self) -> list[Candidate]:
        return [Candidate("fire", 0.5, 47.0, 8.0, 2.0, 3)]


def test_what_is_detected_in_each_frame_is_a_line_and_candidates_once_a_second(tmp_path: Path) -> None:
    companion = Doubtful()
    inference = Inference(companion.detect, most_waiting=None)
    harness = Harness(companion, {}, inference, detections=DetectionLog(tmp_path / "detections.jsonl"))
    harness.step(US, [], [frame(index) for index in range(3)])
    harness.close()
    lines = [json.loads(line) for line in (tmp_path / "detections.jsonl").read_text().splitlines()]
    found = ["fire", 0.9, 20.0, 20.0, 10.0, 10.0]
    assert lines == [
        {"time_s": 0.0, "found": [], "candidates": [["fire", 0.5, 47.0, 8.0, 2.0, 3]]},
        {"time_s": 0.1, "found": [found]},
        {"time_s": 0.2, "found": [found, found]},
    ]


class Broken(Reporter):
    """One whose detector fails from a frame on, but for some; it notes why it was told to end."""

    def __init__(self, fails: Callable[[int], bool]) -> None:
        super().__init__()
        self.fails, self.ended = fails, list[str]()

    def wants_frame(self, frame_time_us: int) -> float | None:
        return 0.05

    def detect(self, image: Any, gsd_m: float) -> list[Detection]:
        if self.fails(int(image[0, 0, 0])):
            raise ValueError("no\nsuch layer")
        return []

    def fail(self, why: str) -> None:
        self.ended.append(why)


@pytest.mark.parametrize(
    ("fails", "dropped", "ended"),
    [
        (lambda index: index % MOST_FAILURES != 0, 27, 0),
        (lambda index: index >= 5, 25, 1),
    ],
    ids=["never all in a row", "for good"],
)
def test_a_detector_that_fails_loses_frames_is_told_once_and_ends_a_mission_if_it_does_so_for_good(
    fails: Callable[[int], bool], dropped: int, ended: int
) -> None:
    vehicle = UdpPort(("127.0.0.1", 0), None, wait_s=LIMIT_S)
    companion = Broken(fails)
    inference = Inference(companion.detect, most_waiting=None)
    harness = Harness(companion, {AUTOPILOT_LINK: Link(UdpPort(None, vehicle.address))}, inference)
    events = [event for index in range(30) for event in harness.step(index * US, [], [frame(index)])]
    assert inference.dropped == dropped and len(companion.log) == 60 - dropped
    told = "detector: ValueError: no such layer"
    assert [event.text for event in events if event.kind == "text"] == [told]
    data = vehicle.receive()
    assert data is not None
    (said,) = Wire(skip=()).decode(data)
    assert (said.get_type(), said.severity, said.text) == ("STATUSTEXT", 4, told)
    assert companion.ended == [told] * ended
    harness.close()
    vehicle.close()


def test_logs_end_when_the_disk_is_full_and_the_flight_goes_on(tmp_path: Path) -> None:
    for name in ("autopilot.tlog", "detections.jsonl"):
        (tmp_path / name).symlink_to("/dev/full")
    vehicle = UdpPort(("127.0.0.1", 0), None, wait_s=LIMIT_S)
    link = Link(UdpPort(None, vehicle.address), TlogWriter(tmp_path / "autopilot.tlog"))
    companion = Reporter()
    inference = Inference(companion.detect, most_waiting=None)
    log = DetectionLog(tmp_path / "detections.jsonl")
    harness = Harness(companion, {AUTOPILOT_LINK: link}, inference, detections=log)
    message = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)
    texts = list[str]()
    for index in range(1000):
        texts += [one.text for one in harness.step(index, [(AUTOPILOT_LINK, message)], [frame(0)] if index < 2 else [])]
    assert texts == [
        "detections.jsonl ends: No space left on device",
        "autopilot link: autopilot.tlog ends: No space left on device",
    ]
    assert link.sent > 1000 and companion.log.count("time") == 1000
    harness.close()
    vehicle.close()


class Resting(Reporter):
    """One that says when it has use for frames."""

    looks = False


def test_who_does_not_say_that_it_rests_is_taken_to_look() -> None:
    for companion, looks in ((Reporter(), True), (Resting(), False)):
        inference = Inference(companion.detect, most_waiting=None)
        assert Harness(companion, {}, inference).looks == looks
        inference.close()
