"""Compile the kernels of renderer, image sensor and rays and keep them, so that a first camera or lidar need not.

`python -m sitl_emu.world.render`.
"""

from pathlib import Path

import numpy as np

from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world import marching
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.description import read
from sitl_emu.world.imaging.motion import Motion
from sitl_emu.world.lens import NADIR, Intrinsics
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.terrain import HeightMap
from sitl_emu.world.world import World

SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]

if __name__ == "__main__":
    fire, wood = (
        {"name": "fire", "polygon_m": SQUARE},
        {"name": "wood", "kind": "crop", "polygon_m": SQUARE, "height_m": 2},
    )
    described = read({"name": "small", "fires": [fire]}, "small")
    scene = MeshScene(World(described, Path()), Path())
    camera = Camera(scene, NADIR, Intrinsics(16, 16), sensor=ImageSensor(exposure_s=0.03, auto_exposure=False))
    camera.render(Pose(0.0, 0.0, -3.0, (1.0, 0.0, 0.0, 0.0)), 0, motion=Motion((9.0, 0.0, 0.0), (0.0, 0.0, 9.0)))
    wooded = World(
        read({"name": "wooded", "cover": [wood]}, "wooded"), Path(), HeightMap(np.zeros((2, 2)), 0.0, 0.0, 1.0)
    )
    down = np.tile((0.0, 0.0, 1.0), (marching.MANY, 1))
    wooded.raycast(-20.0 * down, down, 0.0, 30.0)
