"""A picture taken over MAVLink in a launch with a world: a file of what stands there, fetched by a ground station."""

import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pymavlink import mavutil

from tests.launched import launched

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
INSTANCE = 41
SYSTEM, CAMERA = INSTANCE + 1, 100
IMAGE_START_CAPTURE = 2000
REJECTED = 1
"""MAV_RESULT_TEMPORARILY_REJECTED."""
LIMIT_S = 60.0


def wait(link: Any, kind: str) -> Any:
    """The next message of a kind."""
    end = time.monotonic() + LIMIT_S
    while time.monotonic() < end:
        link.mav.heartbeat_send(6, 8, 0, 0, 4)
        message = link.recv_match(type=kind, blocking=True, timeout=0.5)
        if message is not None and message.get_srcSystem() == SYSTEM:
            return message
    raise TimeoutError(f"no {kind}")


def take_picture(link: Any, number: int) -> Any:
    """CAMERA_IMAGE_CAPTURED of a picture."""
    result = REJECTED
    while result == REJECTED:  # so soon after the last one
        link.mav.command_long_send(SYSTEM, CAMERA, IMAGE_START_CAPTURE, 0, 0, 0, 1, number, 0, 0, 0)
        result = wait(link, "COMMAND_ACK").result
    assert result == 0
    return wait(link, "CAMERA_IMAGE_CAPTURED")


@pytest.mark.parametrize("world", [str(YARD), None])
def test_a_picture_is_a_file_where_there_is_a_world_to_see(world: str | None, tmp_path: Path) -> None:
    in_world = ["--world", world] if world else []
    with launched("rover", "--instance", str(INSTANCE), "--state", str(tmp_path), *in_world) as process:
        link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{18570 + INSTANCE}", source_system=255)
        try:
            wait(link, "HOME_POSITION")
            first, second = take_picture(link, 1), take_picture(link, 2)
        finally:
            link.close()
        assert process.poll() is None
    root = next(tmp_path.glob("rover-*"))
    if world is None:
        assert first.file_url == second.file_url == "" and not (root / "camera").exists()
        return
    assert [first.file_url, second.file_url] == [f"mftp://[;comp=1]/camera/IMG_{n:04d}.jpg" for n in (1, 2)]
    picture = np.asarray(cv2.imread(str(root / "camera/IMG_0002.jpg"))).astype(float)
    assert picture.shape == (480, 640, 3)
    blue, green, _ = picture.reshape(-1, 3).mean(axis=0)
    assert green > 1.1 * blue, "from its mast it sees the yard's grass"
