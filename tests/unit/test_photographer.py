"""What a launch's cameras are asked for. Their processes are fakes; the world and the vehicles are real."""

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.core.frame_ring import FOLDER, Encoding, Format, Kind, RingWriter
from sitl_emu.core.simulator_api import CameraZoom, HilActuatorControls, PictureTaken
from sitl_emu.run import photographer, site
from sitl_emu.run.children import Child
from sitl_emu.run.configs import CameraConfig, RingData, VideoData
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import End, FrameTaken, Message, Photograph, Photographed, Ready, Render, Rendered, SendVideo
from sitl_emu.run.photographer import Photographer, Sitter
from sitl_emu.world.simulation import Simulation

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
ARMED = HilActuatorControls(0, 1, (0.0,) * 16, 128)
FRAME_S = 1.0 / 15.0


class Ended:
    """A process that has done its work."""

    pid, returncode = 0, 0

    def poll(self) -> int:
        return 0

    def wait(self, _limit_s: float | None = None) -> int:
        return 0


class Bench:
    """An iris with a camera whose video is sent, and a rover that has none."""

    def __init__(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, *, read: bool = False, process: Any = None
    ) -> None:
        """`read`: whether somebody reads its frames; `process`: what draws, if not one that has ended."""
        self.now_s = 100.0
        self.configs: list[CameraConfig] = []
        self.cameras: list[ControlChannel] = []

        def start(title: str, module: str, config: CameraConfig, end: socket.socket, _folder: Path) -> Any:
            assert module == "camera_process"
            self.configs.append(config)
            self.cameras.append(ControlChannel(end.dup(), title))
            drawing: Any = process or Ended()
            return Child(title, drawing, folder / "log")

        monkeypatch.setattr(photographer, "start_process", start)
        here = site.in_world(str(YARD), 1, print)
        assert here.world is not None
        data = [vehicles.load(model) for model in ("iris", "rover")]
        simulators = [here.simulator(each, 3.0 * place, f"{each.model}-{place}") for place, each in enumerate(data)]
        self.ring = RingData(name=f"sitl_emu-test-{os.getpid()}-photographer", slots=8)
        self.simulation = Simulation(simulators, here.solids, here.areas)
        self.simulation.tick([None, None])
        videos = (VideoData(host="127.0.0.1", port=5600, bit_rate=10), None)
        sitters = [
            Sitter(each.model, each.model, each, folder, to, ring)
            for each, to, ring in zip(data, videos, (self.ring if read else None, None), strict=True)
        ]
        self.photographer = Photographer(here.world, here.seed, self.simulation, sitters, lambda: self.now_s)

    def heard(self, camera: int = 0) -> list[Message]:
        """What a camera's process was told since."""
        heard = list[Message]()
        while (message := self.cameras[camera].poll()) is not None:
            heard.append(message)
        return heard

    def film(self, flying: tuple[int, ...] = (0, 1)) -> list[Message]:
        self.photographer.taken()
        self.photographer.film(flying, [None, ARMED])
        return self.heard()


@contextlib.contextmanager
def opened(made: Bench) -> Iterator[Bench]:
    yield made
    made.photographer.close()
    for camera in made.cameras:
        camera.close()


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    with opened(Bench(tmp_path, monkeypatch)) as made:
        yield made


@pytest.fixture
def read_bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """Somebody reads the frames of the iris."""
    with opened(Bench(tmp_path, monkeypatch, read=True)) as made:
        yield made


def test_a_camera_whose_video_is_sent_is_set_up_before_the_vehicle_flies(bench: Bench) -> None:
    (config,) = bench.configs
    assert config.video == VideoData(host="127.0.0.1", port=5600, bit_rate=10) and config.ring is None
    assert bench.film() == [], "it was not told to send any"
    bench.photographer.send_video(0, True)
    assert bench.heard() == [SendVideo(True)]
    assert bench.film() == [], "it is not ready"


def test_a_frame_is_asked_for_when_it_is_due_and_the_one_before_is_done(bench: Bench) -> None:
    bench.photographer.send_video(0, True)
    bench.cameras[0].send(Ready())
    bench.heard()
    (first,) = bench.film()
    assert isinstance(first, Render) and first.index == 0 and first.time_us == 4000
    bench.now_s += 10 * FRAME_S
    assert bench.film() == [], "it draws still: frames are left out, and nobody waits"
    bench.cameras[0].send(Rendered(0))
    (second,) = bench.film()
    bench.cameras[0].send(Rendered(1))
    assert isinstance(second, Render) and second.index == 1
    assert bench.film() == [], "it is not due"
    bench.now_s += 0.5 * FRAME_S
    assert bench.film() == []
    bench.now_s += 0.6 * FRAME_S
    assert len(bench.film()) == 1


def test_a_frame_shows_the_others_and_how_the_vehicle_moves(bench: Bench) -> None:
    bench.photographer.send_video(0, True)
    bench.cameras[0].send(Ready())
    bench.heard()
    (asked,) = bench.film()
    assert isinstance(asked, Render) and asked.motion is not None
    (other,) = asked.others
    pose = bench.simulation.simulators[1].pose()
    assert (other.name, other.model, other.turning) == ("rover", "rover", True)
    assert other.pose == (pose.north_m, pose.east_m, pose.down_m, pose.q)


def test_no_frame_is_asked_for_of_what_is_stopped_or_shut_down(bench: Bench) -> None:
    bench.photographer.send_video(0, True)
    bench.cameras[0].send(Ready())
    bench.heard()
    assert bench.film(flying=(1,)) == []
    bench.photographer.send_video(0, False)
    assert bench.heard() == [SendVideo(False)]
    assert bench.film() == []
    bench.photographer.send_video(0, True)
    assert bench.heard() == [SendVideo(True)] and len(bench.film()) == 1


def test_pictures_are_taken_beside_the_video_and_by_cameras_without_one(bench: Bench) -> None:
    bench.photographer.send_video(0, True)
    bench.cameras[0].send(Ready())
    bench.photographer.taken()
    bench.heard()
    bench.photographer.take(0, 3, [None, ARMED])
    bench.photographer.take(1, 8, [None, ARMED])
    (asked,) = bench.heard()
    assert isinstance(asked, Photograph) and (asked.number, asked.time_us, len(asked.others)) == (3, 4000, 1)
    assert asked.zoom_percent == 0.0
    bench.photographer.zooms[0] = CameraZoom(25.0)
    bench.photographer.take(0, 4, [None, ARMED])
    (asked,) = bench.heard()
    assert isinstance(asked, Photograph) and asked.zoom_percent == 25.0
    assert bench.configs[1].name == "rover" and bench.configs[1].video is None
    bench.cameras[0].send(Photographed(3))
    assert bench.photographer.taken() == [(0, PictureTaken(3, True))]


def test_a_camera_that_dies_ends_its_video_and_is_told_once(bench: Bench) -> None:
    (Path(bench.configs[0].card) / "log").write_text("no memory\n")
    bench.photographer.send_video(0, True)
    bench.cameras.pop(0).close()
    assert bench.photographer.taken() == []
    (complaint,) = bench.photographer.complaints
    assert complaint.startswith("camera iris")
    for _ in range(3):
        bench.photographer.film((0, 1), [None, None])
        assert bench.photographer.taken() == []


def test_frames_that_are_read_are_drawn_without_video_and_told_when_they_are_there(read_bench: Bench) -> None:
    (config,) = read_bench.configs
    assert config.ring == read_bench.ring
    read_bench.cameras[0].send(Ready())
    (asked,) = read_bench.film()
    assert isinstance(asked, Render) and asked.time_us == 4000 and not asked.keep
    assert read_bench.photographer.frames == []
    read_bench.simulation.tick([None, None])
    read_bench.cameras[0].send(Rendered(0))
    read_bench.film()
    assert read_bench.photographer.frames == [(0, FrameTaken("camera", 0, 4000))]
    read_bench.photographer.forget_frames()
    read_bench.now_s += FRAME_S
    assert read_bench.film() == [] and read_bench.photographer.frames == []


def test_a_camera_that_begins_anew_has_frames_that_nobody_reads(read_bench: Bench) -> None:
    (Path(read_bench.configs[0].card) / "log").write_text("no memory\n")
    left = RingWriter(read_bench.ring.name, Format(Kind.IMAGE, Encoding.BGR8, 2, 2))
    os.close(left._file)
    del left  # as a process that was killed leaves it
    read_bench.cameras.pop(0).close()
    read_bench.photographer.taken()
    assert not (FOLDER / read_bench.ring.name).exists()
    read_bench.photographer.take(0, 1, [None, None])
    read_bench.cameras[0].send(Ready())
    assert read_bench.configs[-1].ring is None
    read_bench.photographer.taken()
    read_bench.heard()
    read_bench.now_s += FRAME_S
    assert read_bench.film() == []


def test_at_the_end_each_process_is_told(bench: Bench) -> None:
    bench.photographer.take(1, 1, [None, None])
    bench.photographer.close()
    assert bench.cameras[0].receive() == End()
    assert isinstance(bench.cameras[1].receive(), Photograph) and bench.cameras[1].receive() == End()
