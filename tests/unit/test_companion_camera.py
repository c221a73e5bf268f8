"""Camera sources: the simulator's feed, recorded frames, video files, and what can't be opened."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingWriter
from sitl_emu.missions.companion.camera import CameraError, Image, open_camera
from tests.typed import now


def picture(value: int) -> Image:
    return np.full((48, 64, 3), value, np.uint8)


@pytest.fixture
def name(request: pytest.FixtureRequest) -> str:
    return f"sitl_emu_{request.node.name[:60]}_{os.getpid()}"


@pytest.mark.parametrize("encoding", [Encoding.BGR8, Encoding.RGB8])
def test_a_feed_of_images_is_a_camera_and_ends_with_its_writer(name: str, encoding: Encoding) -> None:
    name = name.translate({ord("["): "_", ord("]"): "_"})
    writer = RingWriter(name, Format(Kind.IMAGE, encoding, 48, 64), slots=4)
    camera = open_camera(f"shm:{name}")
    assert camera.clock == "vehicle" and camera.read() is None
    image = picture(9)
    image[..., 0] = 200
    writer.write(1000, image)
    writer.close()
    assert not now(camera.ended)
    frame = camera.read()
    assert frame is not None and (frame.time_usec, frame.index) == (1000, 0)
    assert frame.image[3, 3].tolist() == ([200, 9, 9] if encoding is Encoding.BGR8 else [9, 9, 200])
    assert now(camera.ended) and camera.read() is None
    camera.close()


def test_a_feed_of_something_else_is_no_camera(name: str) -> None:
    writer = RingWriter(name, Format(Kind.DEPTH, Encoding.M32, 48, 64))
    with pytest.raises(CameraError, match=f"shm:{name}: that feed carries depth, and no images"):
        open_camera(f"shm:{name}")
    writer.close()


def test_recorded_frames_come_in_the_order_of_their_times(tmp_path: Path) -> None:
    for time_us in (900000, 1000000, 66667):
        cv2.imwrite(str(tmp_path / f"uas-{time_us}.png"), picture(time_us % 251))
    camera = open_camera(str(tmp_path))
    frames = list(iter(camera.read, None))
    assert [frame.time_usec for frame in frames] == [66667, 900000, 1000000]
    assert int(frames[0].image[0, 0, 0]) == 66667 % 251
    assert camera.ended


def test_a_video_file_is_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "flight.avi"
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (64, 48))
    for i in range(6):
        video.write(picture(40 * i))
    video.release()
    camera = open_camera(str(path))
    frames = list(iter(camera.read, None))
    camera.close()
    assert len(frames) == 6
    assert camera.ended
    assert camera.clock == "file"
    assert frames[3].time_usec == pytest.approx(200_000, abs=1000)
    assert int(frames[3].image.mean()) == pytest.approx(120, abs=3)


@pytest.mark.parametrize(
    ("url", "text"),
    [
        ("shm:nothing_here", "is the simulator running"),
        ("/nowhere/video.mp4", "no such file, folder or device"),
    ],
)
def test_what_cannot_be_opened_is_told(url: str, text: str) -> None:
    with pytest.raises(CameraError, match=text):
        open_camera(url)


def test_a_folder_without_frames_is_told(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="no recorded frames"):
        open_camera(str(tmp_path))


def test_a_file_that_is_no_video_is_told(tmp_path: Path) -> None:
    (tmp_path / "x.mp4").write_text("no video")
    with pytest.raises(CameraError, match="can't be opened as video"):
        open_camera(str(tmp_path / "x.mp4"))


def test_a_picture_that_opencv_refuses_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise cv2.error("too large")

    cv2.imwrite(str(tmp_path / "1.png"), picture(1))
    monkeypatch.setattr(cv2, "imread", refuse)
    with pytest.raises(CameraError, match=r"1\.png: not a picture that can be read"):
        open_camera(str(tmp_path)).read()
