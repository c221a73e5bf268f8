"""The process of one camera in a run: told a time and a pose, it renders a frame into shared memory and says so.

A frame is a pure function of world, seed, time and pose, so it does not matter when it is rendered.
"""

import os

from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingError, RingWriter
from sitl_emu.run import cameras, worlds
from sitl_emu.run.configs import CameraConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.messages import Ready, Render, Rendered
from sitl_emu.run.process import StartError, main, settle
from sitl_emu.world.camera import Camera
from sitl_emu.world.description import WorldError
from sitl_emu.world.lens import LensError

YIELDING = 5
"""Niceness: a frame has a tenth of a simulated second to be done, while all wait for a tick."""


def run(config: CameraConfig, control: ControlChannel) -> None:
    """Render what is asked for until the run ends."""
    os.nice(YIELDING)
    try:
        world = worlds.kept(config.world)
        scene = world.scene(config.shared_fd)
        camera = Camera(scene, cameras.mount(config.camera), cameras.intrinsics(config.camera), config.name)
        width, height = camera.intrinsics[:2]
        ring = RingWriter(config.ring.name, Format(Kind.IMAGE, Encoding.BGR8, height, width), config.ring.slots)
    except (worlds.WorldError, WorldError, RingError, LensError) as error:
        raise StartError(str(error)) from None
    try:
        settle()
        control.send(Ready())
        while isinstance(asked := control.receive(), Render):
            worlds.put_loose(world, asked.loose)
            ring.write(asked.time_us, camera.render(asked.pose, asked.time_us, asked.head))
            control.send(Rendered(asked.index))
    finally:
        ring.close()


if __name__ == "__main__":
    main(run, CameraConfig)
