"""Camera protocol v2: a vehicle with a camera (component 100), and silence on one without."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

PAGE = "https://mavlink.io/en/services/camera.html"
CAMERA = 100
REQUEST_MESSAGE, SET_CAMERA_MODE, IMAGE_START_CAPTURE, IMAGE_STOP_CAPTURE = 512, 530, 2000, 2001
VIDEO_START_CAPTURE, VIDEO_STOP_CAPTURE = 2500, 2501
CAMERA_INFORMATION, CAMERA_SETTINGS, STORAGE_INFORMATION, CAMERA_CAPTURE_STATUS = 259, 260, 261, 262
CAMERA_IMAGE_CAPTURED = 263
ACCEPTED = 0
CAPTURE_VIDEO, CAPTURE_IMAGE, HAS_MODES = 1, 2, 4
IMAGE, VIDEO = 0, 1
AT_INTERVAL = 2
"""Bit of image_status."""

pytestmark = pytest.mark.covers("MAV_CMD_REQUEST_MESSAGE", source=PAGE)


def ask(station: Any, number: int, *params: float, answer: str = "", confirmation: int = 0) -> tuple[int | None, Any]:
    """The result of a command to the camera, and a message that it sends because of it."""
    padded = params + (0.0,) * (7 - len(params))
    station.mav.command_long_send(station.system, CAMERA, number, confirmation, *padded)
    result = message = None
    end_s = time.monotonic() + 3.0
    while (result is None or (answer and message is None)) and time.monotonic() < end_s:
        heard = station.receive(["COMMAND_ACK", answer] if answer else "COMMAND_ACK", end_s - time.monotonic())
        if heard is None or heard.get_srcComponent() != CAMERA:
            continue
        if heard.get_type() != "COMMAND_ACK":
            message = heard
        elif heard.command == number:
            result = heard.result
            if result != ACCEPTED:
                break
    return result, message


@pytest.fixture(scope="module")
def information(station: Any) -> Any:
    """CAMERA_INFORMATION, None on a vehicle without a camera."""
    return ask(station, REQUEST_MESSAGE, CAMERA_INFORMATION, answer="CAMERA_INFORMATION")[1]


@pytest.fixture
def camera(information: Any) -> Any:
    """The same, for tests that need a camera."""
    if information is None:
        pytest.skip("this vehicle has no camera")
    return information


@pytest.fixture
def mode_kept(station: Any, camera: Any) -> Iterator[None]:
    """The camera goes back to the mode that it was in."""
    before = settings(station) if camera.flags & HAS_MODES else None
    yield
    if before is not None and settings(station).mode_id != before.mode_id:
        assert ask(station, SET_CAMERA_MODE, 0, before.mode_id)[0] == ACCEPTED


def settings(station: Any) -> Any:
    return ask(station, REQUEST_MESSAGE, CAMERA_SETTINGS, answer="CAMERA_SETTINGS")[1]


def capture_status(station: Any) -> Any:
    return ask(station, REQUEST_MESSAGE, CAMERA_CAPTURE_STATUS, answer="CAMERA_CAPTURE_STATUS")[1]


def test_without_a_camera_nobody_answers(station: Any, information: Any) -> None:
    if information is not None:
        pytest.skip("this vehicle has a camera")
    assert ask(station, IMAGE_START_CAPTURE, 0, 0, 1, 1) == (None, None)


@pytest.mark.covers("CAMERA_INFORMATION", source=PAGE)
def test_a_camera_says_what_it_is_and_can(camera: Any) -> None:
    assert camera.resolution_h > 0
    assert camera.resolution_v > 0
    assert camera.flags & (CAPTURE_IMAGE | CAPTURE_VIDEO)


@pytest.mark.covers("HEARTBEAT", source=PAGE)
def test_a_camera_has_a_heartbeat_of_its_own(station: Any, camera: Any) -> None:
    beats = [beat for beat in station.collect("HEARTBEAT", 2.5, at_least=4) if beat.get_srcComponent() == CAMERA]
    assert {beat.type for beat in beats} == {30}
    assert {beat.autopilot for beat in beats} == {8}


@pytest.mark.covers("CAMERA_SETTINGS", "STORAGE_INFORMATION", "CAMERA_CAPTURE_STATUS", source=PAGE)
@pytest.mark.parametrize(
    ("message_id", "name"),
    [
        (CAMERA_SETTINGS, "CAMERA_SETTINGS"),
        (STORAGE_INFORMATION, "STORAGE_INFORMATION"),
        (CAMERA_CAPTURE_STATUS, "CAMERA_CAPTURE_STATUS"),
    ],
)
def test_what_is_asked_for_is_acknowledged_and_sent(station: Any, camera: Any, message_id: int, name: str) -> None:
    result, message = ask(station, REQUEST_MESSAGE, message_id, answer=name)
    assert result == ACCEPTED
    assert message is not None


@pytest.mark.covers("MAV_CMD_SET_CAMERA_MODE", "CAMERA_SETTINGS", source=PAGE)
@pytest.mark.usefixtures("mode_kept")
def test_a_mode_is_set_and_told(station: Any, camera: Any) -> None:
    if not camera.flags & HAS_MODES:
        pytest.skip("this camera has no modes")
    for mode in (VIDEO, IMAGE):
        assert ask(station, SET_CAMERA_MODE, 0, mode)[0] == ACCEPTED
        assert settings(station).mode_id == mode


@pytest.mark.covers("MAV_CMD_IMAGE_START_CAPTURE", "CAMERA_IMAGE_CAPTURED", "CAMERA_CAPTURE_STATUS", source=PAGE)
def test_an_image_is_announced_counted_and_can_be_asked_for_again(station: Any, camera: Any) -> None:
    before = capture_status(station).image_count
    sequence = before + 1
    result, image = ask(station, IMAGE_START_CAPTURE, 0, 0, 1, sequence, answer="CAMERA_IMAGE_CAPTURED")
    assert result == ACCEPTED
    assert (image.capture_result, image.image_index) == (1, before)
    assert capture_status(station).image_count == before + 1
    assert ask(station, REQUEST_MESSAGE, CAMERA_IMAGE_CAPTURED, before, answer="CAMERA_IMAGE_CAPTURED")[1] is not None
    # A command whose ack was lost is sent again with its sequence number: no second image
    assert ask(station, IMAGE_START_CAPTURE, 0, 0, 1, sequence, confirmation=1)[0] == ACCEPTED
    assert station.receive("CAMERA_IMAGE_CAPTURED", 1.5) is None
    assert capture_status(station).image_count == before + 1


@pytest.mark.covers("MAV_CMD_IMAGE_START_CAPTURE", "MAV_CMD_IMAGE_STOP_CAPTURE", source=PAGE)
def test_a_series_runs_until_it_is_stopped(station: Any, camera: Any) -> None:
    assert ask(station, IMAGE_START_CAPTURE, 0, 1.0, 0)[0] == ACCEPTED
    try:
        images = station.collect("CAMERA_IMAGE_CAPTURED", 3.5, at_least=2)
        status = capture_status(station)
    finally:
        assert ask(station, IMAGE_STOP_CAPTURE)[0] == ACCEPTED
    assert len(images) >= 2
    assert status.image_status & AT_INTERVAL
    assert not capture_status(station).image_status & AT_INTERVAL


@pytest.mark.covers("MAV_CMD_VIDEO_START_CAPTURE", "MAV_CMD_VIDEO_STOP_CAPTURE", "CAMERA_CAPTURE_STATUS", source=PAGE)
@pytest.mark.usefixtures("mode_kept")
def test_a_video_is_recorded(station: Any, camera: Any) -> None:
    if not camera.flags & CAPTURE_VIDEO:
        pytest.skip("this camera records no videos")
    if camera.flags & HAS_MODES:
        assert ask(station, SET_CAMERA_MODE, 0, VIDEO)[0] == ACCEPTED
    assert ask(station, VIDEO_START_CAPTURE, 0, 0)[0] == ACCEPTED
    try:
        assert capture_status(station).video_status == 1
    finally:
        assert ask(station, VIDEO_STOP_CAPTURE)[0] == ACCEPTED
    assert capture_status(station).video_status == 0
