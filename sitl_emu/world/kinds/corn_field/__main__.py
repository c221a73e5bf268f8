"""Compile the kernels that draw a corn field and keep them, so that a first camera need not.

`python -m sitl_emu.world.kinds.corn_field`.
"""

import numpy as np

from sitl_emu.world.kinds.corn_field.field import build
from sitl_emu.world.kinds.corn_field.scene import FieldScene

LOOKING_NORTH = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))

if __name__ == "__main__":
    scene = FieldScene(build(1, (60.0, 60.0), 1, 0))
    scene.renderer(16, 16, 8.0).draw(np.array((10.0, 10.0, -1.0 - scene.ground_m(10.0, 10.0))), LOOKING_NORTH)
