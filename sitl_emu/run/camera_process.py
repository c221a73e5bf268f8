"""The process of one camera: told a time and a pose, it renders a frame into shared memory and says so.

It also takes the pictures of its vehicle's MAVLink camera, as JPEG files on that one's card, and sends its frames as
video where that is wanted. A frame is a pure function of world, seed, time, pose, motion and zoom, so it does not
matter when it is rendered. Automatic exposure with a time constant adds the frames before it, which are the same in
every run.
"""

import os
import time
from pathlib import Path

from sitl_emu.components.card import FOLDER, file_name
from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingError, RingWriter
from sitl_emu.run import cameras, kept_frames, worlds
from sitl_emu.run.configs import CameraConfig, VideoData
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.memory import large_goes_back, settle
from sitl_emu.run.messages import Photograph, Photographed, Ready, Render, Rendered, SendVideo
from sitl_emu.run.picture_files import jpeg
from sitl_emu.run.process import StartError, main
from sitl_emu.run.video_sender import Target, VideoSender
from sitl_emu.world.camera import STILL, Camera, Image, Scene, ShowsVehicles
from sitl_emu.world.description import WorldError
from sitl_emu.world.imaging.motion import Motion
from sitl_emu.world.lens import LensError

JPEG_QUALITY = 92
"""Ours: a picture of 640 x 480 takes some 100 kB."""
YIELDING = 5
"""Niceness: a frame has a tenth of a simulated second to be done, while all wait for a tick."""


def run(config: CameraConfig, control: ControlChannel) -> None:
    """Render what is asked for until the run ends."""
    os.nice(YIELDING)
    try:
        world = worlds.kept(config.world, is_met=False)
        with large_goes_back():
            scene = world.scene(config.shared_fd)
        described = config.camera
        camera = camera_of(config, scene)
        width, height = camera.intrinsics[:2]
        what = Format(Kind.IMAGE, Encoding.BGR8, height, width)
        ring = RingWriter(config.ring.name, what, config.ring.slots) if config.ring is not None else None
        kept = kept_frames.KeptFrames(config, "camera", kept_frames.image_file)
        video = _Video(config.video, described.rate_hz)
    except (worlds.WorldError, WorldError, RingError, LensError) as error:
        raise StartError(str(error)) from None
    try:
        settle()
        control.send(Ready())
        while isinstance(asked := control.receive(), Render | Photograph | SendVideo):
            if isinstance(asked, SendVideo):
                video.set_running(asked.running)
                continue
            worlds.put_loose(world, asked.loose)
            if isinstance(scene, ShowsVehicles):
                scene.put_vehicles(worlds.placed(asked.others))
            motion = Motion(*asked.motion) if asked.motion is not None else STILL
            zoom = cameras.zoom(described, asked.zoom_percent)
            image = camera.render(asked.pose, asked.time_us, asked.head, motion, zoom)
            if isinstance(asked, Photograph):
                _keep(image, Path(config.card) / FOLDER / file_name(asked.number))
                control.send(Photographed(asked.number))
            else:
                if ring is not None:
                    ring.write(asked.time_us, image)
                control.send(Rendered(asked.index))
                video.show(image)
                if asked.keep:
                    kept.keep(asked.time_us, image)
    finally:
        video.set_running(False)
        if ring is not None:
            ring.close()


def camera_of(config: CameraConfig, scene: Scene) -> Camera:
    """The camera that is described, with the run's noise. Raises LensError."""
    described = config.camera
    mount, intrinsics = cameras.mount(described), cameras.intrinsics(described)
    return Camera(scene, mount, intrinsics, config.name, described.sensor, config.seed)


class _Video:
    """The camera's video, while it is to be sent."""

    def __init__(self, data: VideoData | None, rate_hz: float) -> None:
        self._target = None if data is None else Target(data.host, data.port, data.bit_rate, rate_hz)
        self._sender: VideoSender | None = None

    def set_running(self, running: bool) -> None:
        """Send from now on, or no more."""
        if running and self._sender is None and self._target is not None:
            self._sender = VideoSender(self._target)
        elif not running and self._sender is not None:
            self._sender.close()
            self._sender = None

    def show(self, image: Image) -> None:
        """The newest frame."""
        if self._sender is not None:
            self._sender.show(image, time.monotonic())


def _keep(image: Image, path: Path) -> None:
    """Write a picture. Raises OSError."""
    path.write_bytes(jpeg(image, JPEG_QUALITY))


if __name__ == "__main__":
    main(run, CameraConfig)
