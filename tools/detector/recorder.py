"""Looks at a world of meshes as a vehicle's camera does, and keeps what the renderer knows of each look."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import quaternion
from sitl_emu.world.camera import Camera, Pose
from sitl_emu.world.lens import Intrinsics, Mount
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.scene import MeshRenderer, MeshScene, View
from tools.detector import variation
from tools.detector.variation import Shot

FloatArray = npt.NDArray[np.float64]
DOWN = Mount(0.0, 0.0, 0.0, 90.0)


class Recorder:
    """A scene for one camera that keeps what was last looked at, with haze of its own."""

    def __init__(self, scene: MeshScene, haze_1_m: float) -> None:
        self.scene, self.haze_1_m = scene, haze_1_m
        self.seed, self.moves = scene.seed, True

    def ground_m(self, north_m: float, east_m: float) -> float:
        """See camera.Scene."""
        return self.scene.ground_m(north_m, east_m)

    def renderer(self, width: int, height: int, focal_px: float) -> "Recorder":
        """See camera.Scene."""
        self._inner = MeshRenderer(self.scene, width, height, focal_px)
        self._size = (focal_px, width, height)
        return self

    def draw(
        self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float, zoom: float = 1.0
    ) -> npt.NDArray[np.uint8]:
        """See camera.Renderer."""
        focal_px, *size = self._size
        self.camera = Pinhole(position_ned_m, camera_to_ned, focal_px * zoom, *size)
        self.view: View = self._inner.look(position_ned_m, camera_to_ned, time_s, self.haze_1_m, zoom)
        return self.view.picture


class Eye:
    """A camera that hangs straight down, over one world."""

    def __init__(self, drawn: variation.Drawn, lens: Intrinsics) -> None:
        self.recorder = Recorder(MeshScene(drawn, Path()), drawn.haze_1_m)
        self._terrain = drawn.terrain
        self._camera = Camera(self.recorder, DOWN, lens)

    def take(self, shot: Shot) -> npt.NDArray[np.uint8]:
        """The picture from a place, (height, width, 3), BGR; what is known of it is then in `recorder`."""
        up = self._terrain.height_m(shot.north_m, shot.east_m) + shot.above_m
        pose = Pose(shot.north_m, shot.east_m, -up, quaternion(shot.roll_rad, shot.tilt_rad, shot.heading_rad))
        return self._camera.render(pose, round(shot.time_s * 1e6))
