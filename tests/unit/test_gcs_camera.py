"""The ground station's half of the camera protocol against our camera, on simulated time."""

from typing import Any

import pytest

from sitl_emu.components.video_stream import VideoStream
from sitl_emu.gcs.camera import IMAGE_MODE, VIDEO_MODE, Camera
from sitl_emu.gcs.command import Command

from .gcs_link import converse
from .test_components_camera import DATA, Rig


def introduced(rig: Rig, **how: Any) -> Camera:
    camera = Camera(1)
    converse(rig, camera, 10.0, lambda: camera.done, **how)
    assert camera.ready
    return camera


def do(rig: Rig, camera: Camera, command: Command, seconds: float = 0.5) -> Any:
    """Drive a command; what the camera hears besides goes to it as well."""

    class Both:
        def on_time(self, now_us: int) -> list[Any]:
            return command.on_time(now_us) + camera.on_time(now_us)

        def on_message(self, now_us: int, msg: Any) -> list[Any]:
            return command.on_message(now_us, msg) + camera.on_message(now_us, msg)

    converse(rig, Both(), seconds)
    assert command.outcome is not None
    return command.outcome.text


def test_a_camera_introduces_itself() -> None:
    camera = introduced(Rig(video=VideoStream(5600)))
    assert camera.information.resolution_h == DATA.resolution_h_px
    assert camera.settings.mode_id == IMAGE_MODE
    assert camera.storage[1].total_capacity == pytest.approx(DATA.storage_mib)
    assert camera.capture_status.image_count == 0
    assert list(camera.streams) == [1] and camera.streams[1].uri == "5600"


def test_a_stream_is_stopped_and_started() -> None:
    rig = Rig(video=VideoStream(5600))
    camera = introduced(rig)
    assert camera.stream_status == {}
    assert do(rig, camera, camera.stop_streaming()) == "accepted"
    assert camera.stream_status[1].flags == 0
    assert do(rig, camera, camera.start_streaming()) == "accepted"
    assert camera.stream_status[1].flags == 1


@pytest.mark.parametrize("name", ["COMMAND_ACK", "CAMERA_INFORMATION", "STORAGE_INFORMATION"])
def test_what_is_lost_is_asked_for_again(name: str) -> None:
    camera = introduced(Rig(), lost=frozenset({name}))
    assert camera.capture_status is not None


def test_without_a_camera_it_says_so() -> None:
    camera = Camera(1, 103)
    converse(Rig(), camera, 30.0, lambda: camera.done)
    assert (camera.ready, camera.refusal) == (False, "no answer to 10 tries")


def test_an_image_is_taken_once_though_its_ack_is_lost() -> None:
    rig = Rig()
    camera = introduced(rig)
    command = camera.take_image()
    converse(rig, command, 3.0, lambda: command.done, lost=frozenset({"COMMAND_ACK"}))
    assert command.sent == 2
    assert do(rig, camera, camera.take_image()) == "accepted"
    camera.refresh()
    converse(rig, camera, 2.0)
    assert sorted(camera.images) == [0, 1]


def test_a_companion_that_starts_again_takes_another_image_at_once() -> None:
    rig = Rig()
    for count in (1, 2):
        camera = introduced(rig)
        assert do(rig, camera, camera.take_image()) == "accepted"
        camera.refresh()
        converse(rig, camera, 0.3)
        assert camera.capture_status.image_count == count


def test_an_announcement_that_was_lost_is_asked_for() -> None:
    rig = Rig()
    camera = introduced(rig)
    command = camera.take_images(0.5, 4)
    command.on_time(0)
    rig.ask(command.command, *command.params)
    rig.run(1.2)  # the first announcements go by unheard
    converse(rig, camera, 3.0)
    assert sorted(camera.images) == [0, 1, 2, 3]
    assert camera.missed == 0


def test_an_image_that_the_camera_has_no_record_of_is_missed() -> None:
    rig = Rig()
    camera = introduced(rig)
    rig.ask(camera.take_image().command, 0, 0, 1, 9)
    rig.run(1.0)
    assert do(rig, camera, camera.format_storage()) == "accepted"
    camera.refresh()
    converse(rig, camera, 2.0)
    assert (camera.images, camera.missed, camera.done) == ({}, 1, True)


def test_a_card_that_was_emptied_counts_from_zero() -> None:
    rig = Rig()
    camera = introduced(rig)
    do(rig, camera, camera.take_image(), 1.0)
    assert do(rig, camera, camera.format_storage(reset_image_log=True), 1.0) == "accepted"
    do(rig, camera, camera.take_image(), 1.0)
    assert list(camera.images) == [0]
    assert camera.storage[1].used_capacity < DATA.storage_mib


def test_modes_videos_focus_and_settings() -> None:
    rig = Rig()
    camera = introduced(rig)
    assert do(rig, camera, camera.start_video()) == "denied"
    assert do(rig, camera, camera.set_mode(VIDEO_MODE)) == "accepted"
    assert camera.settings.mode_id == VIDEO_MODE
    assert do(rig, camera, camera.start_video(status_hz=5.0), 1.0) == "accepted"
    assert camera.capture_status.video_status == 1
    assert do(rig, camera, camera.set_mode(IMAGE_MODE)) == "temporarily rejected"
    assert do(rig, camera, camera.stop_video()) == "accepted"
    assert camera.capture_status.video_status == 0
    assert do(rig, camera, camera.focus_to(40.0)) == "accepted"
    assert camera.settings.focusLevel == pytest.approx(40.0)
    assert do(rig, camera, camera.reset_settings()) == "accepted"
    assert (camera.settings.mode_id, camera.settings.focusLevel) == (IMAGE_MODE, 0.0)


def test_zoom_goes_from_wide_to_near() -> None:
    rig = Rig()
    camera = introduced(rig)
    assert do(rig, camera, camera.zoom_to(50.0)) == "accepted"
    assert camera.settings.zoomLevel == pytest.approx(50.0)


def test_a_series_goes_on_until_it_is_stopped() -> None:
    rig = Rig()
    camera = introduced(rig)
    assert do(rig, camera, camera.take_images(1.0), 2.5) == "accepted"
    assert do(rig, camera, camera.stop_images()) == "accepted"
    assert len(camera.images) == 3
    converse(rig, camera, 3.0)
    assert len(camera.images) == 3
