"""MAVSDK's camera and gimbal plugins against the m600's."""

import math
import queue
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk, System
from mavsdk.plugins.camera import Camera
from mavsdk.plugins.camera.camera import Mode, PhotosRange
from mavsdk.plugins.gimbal import Gimbal
from mavsdk.plugins.gimbal.gimbal import ControlMode, GimbalMode, SendMode

from tests.launched import launched

INSTANCE = 7
STEP_LIMIT_S = 30.0


@pytest.fixture(scope="module")
def system() -> Iterator[System]:
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with launched("m600", "--instance", str(INSTANCE)) as process, Mavsdk(station) as mavsdk:
        mavsdk.add_any_connection(f"udpin://0.0.0.0:{14540 + INSTANCE}")
        found = mavsdk.first_autopilot(timeout_s=30.0)
        assert found is not None
        assert process.poll() is None
        yield found


def until(subscribe: Callable[..., Any], unsubscribe: Callable[[Any], None], accept: Callable[[Any], bool]) -> Any:
    """The first value of a MAVSDK stream that is accepted; raises queue.Empty when none comes in time."""
    values: queue.Queue[Any] = queue.Queue()
    handle = subscribe(lambda value, _user_data: values.put(value))
    try:
        while True:
            value = values.get(timeout=STEP_LIMIT_S)
            if accept(value):
                return value
    finally:
        unsubscribe(handle)


def test_the_camera_plugin_takes_pictures_and_videos(system: System) -> None:
    camera = Camera(system)
    found = until(camera.subscribe_camera_list, camera.unsubscribe_camera_list, lambda value: bool(value.cameras))
    information = found.cameras[0]
    assert (information.vendor_name, information.model_name) == ("sitl-emu", "survey camera")
    assert information.horizontal_resolution_px == 640
    one = information.component_id

    camera.set_mode(one, Mode.PHOTO)
    captures: queue.Queue[Any] = queue.Queue()
    handle = camera.subscribe_capture_info(lambda value, _user_data: captures.put(value))
    camera.take_photo(one)
    first = captures.get(timeout=STEP_LIMIT_S)
    assert (first.index, first.is_success) == (0, True)
    assert first.position.latitude_deg == pytest.approx(47.3977, abs=1e-3)
    camera.start_photo_interval(one, 0.5)
    assert [captures.get(timeout=STEP_LIMIT_S).index for _ in range(3)] == [1, 2, 3]
    camera.stop_photo_interval(one)
    camera.unsubscribe_capture_info(handle)
    assert len(camera.list_photos(one, PhotosRange.ALL)) >= 4

    camera.set_mode(one, Mode.VIDEO)
    until(camera.subscribe_mode, camera.unsubscribe_mode, lambda value: value.mode == Mode.VIDEO)
    camera.start_video(one)
    until(camera.subscribe_storage, camera.unsubscribe_storage, lambda value: value.storage.video_on)
    camera.stop_video(one)
    camera.zoom_range(one, 50.0)
    camera.focus_range(one, 20.0)
    camera.reset_settings(one)
    camera.format_storage(one, 1)
    until(camera.subscribe_storage, camera.unsubscribe_storage, lambda value: value.storage.used_storage_mib == 0.0)


def test_the_gimbal_plugin_points_it(system: System) -> None:
    gimbal = Gimbal(system)
    found = until(gimbal.subscribe_gimbal_list, gimbal.unsubscribe_gimbal_list, lambda value: bool(value.gimbals))
    one = found.gimbals[0].gimbal_id
    gimbal.take_control(one, ControlMode.PRIMARY)
    gimbal.set_angles(one, 0.0, -45.0, 30.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)

    def there(value: Any) -> bool:
        angle = value.euler_angle_forward
        return math.isclose(angle.pitch_deg, -45.0, abs_tol=0.5) and math.isclose(angle.yaw_deg, 30.0, abs_tol=0.5)

    until(gimbal.subscribe_attitude, gimbal.unsubscribe_attitude, there)
    gimbal.set_angular_rates(one, 0.0, 0.0, -20.0, GimbalMode.YAW_FOLLOW, SendMode.STREAM)
    until(gimbal.subscribe_attitude, gimbal.unsubscribe_attitude, lambda value: value.euler_angle_forward.yaw_deg < 0.0)
    gimbal.release_control(one)
    with pytest.raises(Exception, match=r"(?i)denied|error|set_angles"):
        gimbal.set_angles(one, 0.0, 0.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
        time.sleep(0.0)
