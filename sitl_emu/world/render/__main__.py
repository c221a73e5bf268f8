"""Compile the renderer's kernels and keep them, so that a first camera need not: `python -m sitl_emu.world.render`."""

from pathlib import Path

import numpy as np

from sitl_emu.world.description import read
from sitl_emu.world.render.scene import MeshScene
from sitl_emu.world.world import World

SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]

if __name__ == "__main__":
    described = read({"name": "small", "fires": [{"name": "fire", "polygon_m": SQUARE}]}, "small")
    renderer = MeshScene(World(described, Path()), Path()).renderer(16, 12, 8.0)
    renderer.draw(np.array((0.0, 0.0, -3.0)), np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))), 0.0)
