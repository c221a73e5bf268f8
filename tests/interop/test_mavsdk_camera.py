"""MAVSDK camera: images, series, videos, settings and storage of an iris' camera."""

import queue
from typing import Any

import pytest
from mavsdk.plugins.camera import Camera
from mavsdk.plugins.camera.camera import Mode, PhotosRange

from tests.interop.mavsdk_vehicle import STEP_LIMIT_S, Vehicle, until


def test_the_camera_takes_pictures_and_videos(vehicle: Vehicle) -> None:
    camera = Camera(vehicle.system)
    information = until(camera, "camera_list", lambda value: bool(value.cameras)).cameras[0]
    assert (information.vendor_name, information.model_name) == ("sitl-emu", "nadir camera")
    assert information.horizontal_resolution_px == 640
    one = information.component_id

    camera.set_mode(one, Mode.PHOTO)
    captures: queue.Queue[Any] = queue.Queue()
    handle = camera.subscribe_capture_info(lambda value, _user_data: captures.put(value))
    camera.take_photo(one)
    first = captures.get(timeout=STEP_LIMIT_S)
    assert first.is_success
    assert first.position.latitude_deg == pytest.approx(47.3977, abs=1e-3)
    camera.start_photo_interval(one, 1.0)
    assert [captures.get(timeout=STEP_LIMIT_S).index - first.index for _ in range(3)] == [1, 2, 3]
    camera.stop_photo_interval(one)
    camera.unsubscribe_capture_info(handle)
    assert len(camera.list_photos(one, PhotosRange.ALL)) >= 4

    camera.set_mode(one, Mode.VIDEO)
    until(camera, "mode", lambda value: value.mode == Mode.VIDEO)
    camera.start_video(one)
    until(camera, "storage", lambda value: value.storage.video_on)
    camera.stop_video(one)
    camera.focus_range(one, 20.0)
    camera.focus_in_start(one)
    camera.focus_out_start(one)
    camera.focus_stop(one)
    camera.reset_settings(one)
    camera.format_storage(one, 1)
    until(camera, "storage", lambda value: value.storage.used_storage_mib == 0.0)
