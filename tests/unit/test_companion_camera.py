"""Camera sources: the frame ring, recorded frames, video files, and what can't be opened."""

import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from sitl_emu.missions.companion.camera import CameraError, FrameRingReader, FrameRingWriter, Image, open_camera

ROOT = Path(__file__).parents[2]


def picture(value: int) -> Image:
    return np.full((48, 64, 3), value, np.uint8)


def ring_name(test: str) -> str:
    return f"sitl_emu_{test}_{os.getpid()}"


def test_frames_go_through_the_ring_in_order_with_their_time() -> None:
    writer = FrameRingWriter(ring_name("order"), 64, 48, slots=4)
    reader = open_camera(f"shm:{writer.name}")
    assert reader.read() is None
    for i in range(3):
        writer.write(1000 * i, picture(i))
    frames = [reader.read() for _ in range(4)]
    assert [(f.time_usec, f.index, int(f.image[5, 5, 1])) for f in frames if f] == [
        (0, 0, 0),
        (1000, 1, 1),
        (2000, 2, 2),
    ]
    assert frames[3] is None
    assert reader.clock == "vehicle"
    reader.close()
    writer.close()


def test_a_slow_reader_is_told_how_many_it_lost() -> None:
    writer = FrameRingWriter(ring_name("slow"), 64, 48, slots=4)
    reader = FrameRingReader(writer.name)
    for i in range(10):
        writer.write(i, picture(i))
    assert [frame.index for frame in iter(reader.read, None)] == [6, 7, 8, 9]
    assert reader.lost == 6
    assert reader.read_index(5) is None
    assert reader.read_index(10) is None
    reader.close()
    writer.close()


def test_a_frame_rendered_in_place_is_published_by_commit() -> None:
    writer = FrameRingWriter(ring_name("place"), 64, 48)
    writer.next_image[:] = 7
    reader = FrameRingReader(writer.name)
    assert reader.read() is None
    writer.commit(5)
    frame = reader.read()
    assert frame is not None
    assert int(frame.image.max()) == int(frame.image.min()) == 7
    reader.close()
    writer.close()


def test_a_reader_that_ends_leaves_the_ring_to_others() -> None:
    writer = FrameRingWriter(ring_name("leave"), 64, 48)
    writer.write(0, picture(1))
    for _ in range(2):
        read = f"from missions.companion.camera import *; assert FrameRingReader({writer.name!r}).read() is not None"
        subprocess.run([sys.executable, "-c", read], check=True, cwd=ROOT, timeout=60)
    assert Path("/dev/shm", writer.name).exists()
    writer.close()
    assert not Path("/dev/shm", writer.name).exists()


def test_a_ring_that_is_there_already_is_told_with_the_remedy() -> None:
    writer = FrameRingWriter(ring_name("twice"), 64, 48)
    with pytest.raises(CameraError, match=f"remove /dev/shm/{writer.name}"):
        FrameRingWriter(writer.name, 64, 48)
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


WRITE = """
import sys
import numpy as np
from sitl_emu.missions.companion.camera import FrameRingWriter
ring = FrameRingWriter(sys.argv[1], 8, 8, slots=4)
print("there", flush=True)
sys.stdin.readline()
for i in range(60000):
    ring.write(i, ring.next_image)
sys.stdin.readline()
ring.close()
"""


def test_the_count_of_frames_never_goes_back_under_a_readers_eyes() -> None:
    name = ring_name("count")
    command = [sys.executable, "-c", WRITE, name]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT, text=True) as writer:
        assert writer.stdout is not None
        assert writer.stdin is not None
        assert writer.stdout.readline() == "there\n"
        reader, last, steps_back = FrameRingReader(name), 0, 0
        writer.stdin.write("go\n")
        writer.stdin.flush()
        while last < 60000:
            written = reader.written
            steps_back += written < last
            last = max(last, written)
        reader.close()
        writer.communicate("end\n", timeout=30)
    assert steps_back == 0
