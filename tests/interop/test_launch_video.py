"""Video of a launched m600 in a world, as a ground station finds and sees it: by MAVLink, RTP and FFmpeg's decoder."""

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from mavsdk.plugins.camera import Camera as CameraPlugin
from mavsdk.plugins.camera.camera import VideoStreamInfo
from mavsdk.plugins.gimbal import Gimbal
from mavsdk.plugins.gimbal.gimbal import ControlMode, GimbalMode, SendMode
from pymavlink import mavutil

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.core.attitude import Quaternion, heading, product, quaternion
from sitl_emu.run import cameras, site
from sitl_emu.world.camera import Camera, Posed
from tests.interop.mavsdk_vehicle import Vehicle, connected, until
from tests.launched import launched
from tests.rtp import IDR, Ear, Image, decoded, psnr_db, units

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
INSTANCE = 0
CAMERA = 100
LOOKS = ((-90.0, 0.0), (-5.0, 0.0), (-15.0, 70.0))
"""Pitch and yaw against the heading; the first is how the gimbal hangs at the start."""
NEW_FRAMES = 3


class Watched(NamedTuple):
    """A vehicle at rest whose video is heard."""

    vehicle: Vehicle
    ear: Ear

    def frame(self) -> Image:
        """What it sees now: the first key frame, and what follows it, after all that was on its way is heard."""
        self.ear.drain()
        pictures = [self.ear.picture()]
        while IDR not in units(pictures[0]):
            pictures[0] = self.ear.picture()
        pictures += [self.ear.picture() for _ in range(NEW_FRAMES)]
        seen = decoded(pictures)
        assert len(seen) == len(pictures), "from the first packet of the key frame on"
        return seen[-1]


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    ear = Ear(ports.video(INSTANCE))
    with connected("m600", INSTANCE, "1", "--world", str(YARD), "--camera") as vehicle:
        vehicle.until_ready()
        yield Watched(vehicle, ear)
    ear.close()


@pytest.fixture(scope="module")
def ground(watched: Watched) -> Iterator[Any]:
    """The ground station's link; one for all tests, as the vehicle speaks to who spoke first."""
    link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(INSTANCE).local}", source_system=254)
    yield link
    link.close()


def drawn(pose: Posed, camera: Camera, look: tuple[float, float], zoom: float = 1.0) -> Image:
    """What is to be seen from where it stands."""
    pitch_deg, yaw_deg = look
    level = quaternion(0.0, 0.0, heading(pose.q))
    head: Quaternion = product(level, quaternion(0.0, math.radians(pitch_deg), math.radians(yaw_deg)))
    return camera.render(pose, 1_000_000, head, zoom=zoom)


def is_there(look: tuple[float, float], value: Any) -> bool:
    angle = value.euler_angle_forward
    return math.dist(look, (angle.pitch_deg, angle.yaw_deg)) < 0.3


def test_the_picture_is_that_of_the_world_and_follows_the_gimbal(watched: Watched) -> None:
    here = site.in_world(str(YARD), 1, print)
    data = vehicles.load("m600")
    simulator = here.simulator(data, 0, f"{data.model}-{INSTANCE}")
    for _ in range(250):
        simulator.tick(None)
    described = cameras.of_data(data)
    assert here.world is not None
    camera = Camera(here.world.scene(), cameras.mount(described), cameras.intrinsics(described), "m600-0")
    gimbal = Gimbal(watched.vehicle.system)
    one = until(gimbal, "gimbal_list", lambda value: bool(value.gimbals)).gimbals[0].gimbal_id
    gimbal.take_control(one, ControlMode.PRIMARY)
    expected = {look: drawn(simulator.pose(), camera, look) for look in LOOKS}
    for look, there in expected.items():
        pitch_deg, yaw_deg = look
        gimbal.set_angles(one, 0.0, pitch_deg, yaw_deg, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
        until(gimbal, "attitude", partial(is_there, look))
        seen = watched.frame()
        assert seen.shape == (480, 640, 3)
        fits = {other: psnr_db(seen, picture) for other, picture in expected.items()}
        assert fits[look] > 27.0, f"{look}: {fits}"
        assert all(fits[other] < fits[look] - 6.0 for other in LOOKS if other != look), f"{look}: {fits}"
        assert np.std(there) > 5.0, "there is something to see"


def test_the_picture_and_its_announced_field_of_view_follow_the_zoom(watched: Watched, ground: Any) -> None:
    here, data = site.in_world(str(YARD), 1, print), vehicles.load("m600")
    simulator = here.simulator(data, 0, f"{data.model}-{INSTANCE}")
    for _ in range(250):
        simulator.tick(None)
    described = cameras.of_data(data)
    assert here.world is not None
    camera = Camera(here.world.scene(), cameras.mount(described), cameras.intrinsics(described), "m600-0")
    gimbal, plugin = Gimbal(watched.vehicle.system), CameraPlugin(watched.vehicle.system)
    hangs_on = until(gimbal, "gimbal_list", lambda value: bool(value.gimbals)).gimbals[0].gimbal_id
    one = until(plugin, "camera_list", lambda value: bool(value.cameras)).cameras[0].component_id
    gimbal.take_control(hangs_on, ControlMode.PRIMARY)
    gimbal.set_angles(hangs_on, 0.0, *LOOKS[2], GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    until(gimbal, "attitude", partial(is_there, LOOKS[2]))
    expected = {zoom: drawn(simulator.pose(), camera, LOOKS[2], zoom) for zoom in (1.0, 2.5, 4.0)}
    for zoom, percent in ((2.5, 50.0), (1.0, 0.0), (4.0, 100.0)):
        plugin.zoom_range(one, percent)
        seen = watched.frame()
        fits = {other: psnr_db(seen, picture) for other, picture in expected.items()}
        assert fits[zoom] > 27.0, f"{zoom}: {fits}"
        assert all(fits[other] < fits[zoom] - 6.0 for other in fits if other != zoom), f"{zoom}: {fits}"
    assert asked(ground, INSTANCE + 1, 269, "VIDEO_STREAM_INFORMATION").hfov == 28
    plugin.zoom_range(one, 0.0)


def test_mavsdk_finds_the_stream_and_stops_and_starts_it(watched: Watched) -> None:
    plugin = CameraPlugin(watched.vehicle.system)
    one = until(plugin, "camera_list", lambda value: bool(value.cameras)).cameras[0].component_id
    told = until(plugin, "video_stream_info", lambda update: update.video_stream_info.stream_id == 1).video_stream_info
    settings = told.settings
    assert (settings.uri, settings.bit_rate_b_s, settings.frame_rate_hz) == ("5600", 2_000_000, 15.0)
    assert (settings.horizontal_resolution_pix, settings.vertical_resolution_pix) == (640, 480)
    assert told.status == VideoStreamInfo.VideoStreamStatus.IN_PROGRESS

    def told_as(status: VideoStreamInfo.VideoStreamStatus) -> None:
        until(plugin, "video_stream_info", lambda update: update.video_stream_info.status == status)

    watched.frame()
    plugin.stop_video_streaming(one, 1)
    told_as(VideoStreamInfo.VideoStreamStatus.NOT_RUNNING)
    assert watched.ear.falls_silent(), "what was on its way is heard, and then nothing for a second"
    plugin.start_video_streaming(one, 1)
    watched.frame()
    told_as(VideoStreamInfo.VideoStreamStatus.IN_PROGRESS)


def test_pymavlink_is_told_of_the_stream_and_of_none_where_there_is_none(ground: Any) -> None:
    information = asked(ground, INSTANCE + 1, 259, "CAMERA_INFORMATION")
    assert information.flags & 256, "CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM"
    stream = asked(ground, INSTANCE + 1, 269, "VIDEO_STREAM_INFORMATION")
    assert (stream.type, stream.uri, stream.encoding, stream.flags, stream.count) == (1, "5600", 1, 1, 1)
    status = asked(ground, INSTANCE + 1, 270, "VIDEO_STREAM_STATUS")
    assert (status.stream_id, status.flags, status.framerate) == (1, 1, 15.0)
    with launched("iris", "--instance", str(INSTANCE + 1)):
        link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(INSTANCE + 1).local}", source_system=254)
        try:
            assert not asked(link, INSTANCE + 2, 259, "CAMERA_INFORMATION").flags & 256
        finally:
            link.close()


def asked(link: Any, system: int, message_id: int, kind: str) -> Any:
    """A message of the camera's, asked for until it comes."""
    for _ in range(60):
        link.mav.heartbeat_send(6, 8, 0, 0, 4)
        link.mav.command_long_send(system, CAMERA, 512, 0, message_id, 0, 0, 0, 0, 0, 0)
        message = link.recv_match(type=kind, blocking=True, timeout=0.5)
        if message is not None:
            return message
    raise TimeoutError(f"no {kind}")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("iris", "--camera"), "--camera: without --world there is nothing to see"),
        (("sihsim_hex", "--world", "flat", "--camera"), "--camera: sihsim_hex: no camera is on board"),
    ],
)
def test_where_there_is_nothing_to_see_it_says_so(arguments: tuple[str, ...], said: str) -> None:
    with launched(*arguments, "--instance", str(INSTANCE + 2)) as process:
        output, _ = process.communicate(timeout=60.0)
        assert process.returncode == 2 and said in output and len(output.splitlines()) == 1
