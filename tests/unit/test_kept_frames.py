"""What a run keeps of its feeds: one a second, small, and readable by others."""

import io
from pathlib import Path

import cv2
import numpy as np

from sitl_emu.missions.companion.camera import open_camera
from sitl_emu.run.configs import ProcessConfig
from sitl_emu.run.kept_frames import KeptFrames, depth_file, every, folder_of, image_file, points_file


def test_one_a_second_is_kept() -> None:
    assert [every(rate_hz) for rate_hz in (30.0, 15.0, 1.0)] == [30, 15, 1]
    assert every(0.5) == 1, "all of those that come less often"


def test_they_are_a_camera_source_by_themselves(tmp_path: Path) -> None:
    """So `sitl-emu detect FOLDER` and a companion on a bench take them."""
    feed = KeptFrames(ProcessConfig(folder=str(tmp_path), start_us=0, seed=1, name="a"), "camera", image_file)
    for second in (2, 0, 1):
        feed.keep(second * 1_000_000, np.full((48, 64, 3), second, np.uint8))
    source = open_camera(str(folder_of(tmp_path, "a", "camera")))
    times = []
    while not source.ended:
        frame = source.read()
        times += [frame.time_usec] if frame is not None else []
    assert times == [0, 1_000_000, 2_000_000]


def test_a_wide_picture_becomes_smaller_and_a_small_one_stays() -> None:
    for (height, width), shape in (((480, 640), (360, 480, 3)), ((48, 64), (48, 64, 3))):
        suffix, data = image_file(np.full((height, width, 3), 90, np.uint8))
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert suffix == ".jpg" and image is not None and image.shape == shape and abs(int(image.mean()) - 90) < 3


def test_depth_comes_back_to_the_millimetre_and_nothing_as_zero() -> None:
    suffix, data = depth_file(np.array([[1.2345, np.inf], [70.0, 0.5]], np.float32))
    back = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert suffix == ".png" and back is not None and back.tolist() == [[1234, 0], [65535, 500]]


def test_points_come_back_as_they_were() -> None:
    points = np.array([[1.0, 2.0, -3.5], [0.1, 0.0, 9.0]], np.float32)
    suffix, data = points_file(points)
    assert suffix == ".npy" and np.array_equal(np.load(io.BytesIO(data)), points)
