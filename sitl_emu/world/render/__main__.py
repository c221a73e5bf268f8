"""Compile the kernels of renderer and image sensor and keep them, so that a first camera need not.

`python -m sitl_emu.world.render`.
"""

from pathlib import Path

from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.description import read
from sitl_emu.world.imaging.motion import Motion
from sitl_emu.world.lens import NADIR, Intrinsics
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.world import World

SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]

if __name__ == "__main__":
    described = read({"name": "small", "fires": [{"name": "fire", "polygon_m": SQUARE}]}, "small")
    scene = MeshScene(World(described, Path()), Path())
    camera = Camera(scene, NADIR, Intrinsics(16, 16), sensor=ImageSensor(exposure_s=0.03, auto_exposure=False))
    camera.render(Pose(0.0, 0.0, -3.0, (1.0, 0.0, 0.0, 0.0)), 0, motion=Motion((9.0, 0.0, 0.0), (0.0, 0.0, 9.0)))
