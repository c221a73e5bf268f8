"""Draws what a pinhole camera sees of a corn field: our own renderer, numpy and OpenCV, no GL.

For a grid of one pixel in eight, rays are met with the terrain by fixed-point iteration; the map coordinates of the
pixels between are interpolated, and `cv2.remap` looks them up in painted layers (see painter.py). Plants stand up by
shells: the same picture, looked up again where the rays meet surfaces one above the other, shows what grows at least
so high. Two resolutions: the whole field at 5 cm a pixel (whole.py), and where the camera is near, a mosaic of tiles of
1.6 cm (mosaic.py); both are painted as they come into view.

Geometry: a point of the ground appears within 0.2 px of its pinhole projection (a test measures it). The iteration
converges while terrain slope times the tangent of the ray's angle from the vertical stays below 1.
A picture is a function of field and pose alone: when and where it is painted changes nothing that is seen.
It does not draw a sky (rays that rise end 120 m away), obstacles, vehicles or their shadows.
"""

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.mosaic import TILE_GSD_M, Mosaic
from sitl_emu.world.kinds.corn_field.painter import Layers, Painter, Planted, plant
from sitl_emu.world.kinds.corn_field.sprites import HEIGHT_SCALE_M, Image
from sitl_emu.world.kinds.corn_field.whole import FIELD_GSD_M, WholeField

FloatArray = npt.NDArray[np.float64]

NEAR_M = 5.0
"""Below this distance along the optical axis the mosaic is used."""
MAX_RANGE_M = 120.0
GRID_STEP_PX = 8


class Renderer:
    """The eyes on one field: `draw` for any number of poses and one set of intrinsics.

    `width` and `height` in pixels (multiples of 8), `focal_px` for both axes; the principal point is the centre.
    `shared_memory`: see whole.py.
    """

    def __init__(
        self, field: CornField, width: int, height: int, focal_px: float, shared_memory: int | None = None
    ) -> None:
        if width % GRID_STEP_PX or height % GRID_STEP_PX:
            raise ValueError(f"width and height must be multiples of {GRID_STEP_PX}, not {width} x {height}")
        self.field = field
        self._width, self._height = width, height
        # Grid points at the centres of 8 x 8 blocks, one block beyond each edge: cv2.resize interpolates between.
        x = (
            np.arange(-1, width // GRID_STEP_PX + 1) * GRID_STEP_PX + (GRID_STEP_PX - 1) / 2 - (width - 1) / 2
        ) / focal_px
        y = (
            np.arange(-1, height // GRID_STEP_PX + 1) * GRID_STEP_PX + (GRID_STEP_PX - 1) / 2 - (height - 1) / 2
        ) / focal_px
        self._grid_shape = (len(y), len(x))
        self._rays = np.stack((np.tile(x, len(y)), np.repeat(y, len(x)), np.ones(len(x) * len(y))))
        self._whole = WholeField(field, lambda: self._painter(FIELD_GSD_M), shared_memory)
        self._near = Mosaic(lambda: self._painter(TILE_GSD_M))
        self._painters: dict[float, Painter] = {}
        self._planted: Planted | None = None

    def draw(self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float = 0.0) -> Image:
        """The picture (height, width, 3), BGR, taken from a place (3,) with an attitude (3, 3); the field stands still.

        Camera axes: x right, y down in the picture, z along the optical axis.
        """
        rays = camera_to_ned @ self._rays
        # A ray that rises or grazes is bent to end at MAX_RANGE_M: nothing is drawn of a sky.
        above = max(-float(position_ned_m[2]) - self.field.terrain.height_m(*position_ned_m[:2].tolist()), 0.05)
        horizontal = np.hypot(rays[0], rays[1])
        down = np.maximum(rays[2], np.maximum(horizontal * (above / MAX_RANGE_M), 1e-6))
        slope_north, slope_east = rays[0] / down, rays[1] / down

        layers, shells = self._layers_for(position_ned_m, camera_to_ned, above)
        camera_height = -float(position_ned_m[2])
        height = np.full(slope_north.shape, camera_height - above)
        for _ in range(5):
            north, east = self._meet(position_ned_m, slope_north, slope_east, camera_height - height)
            height = self._heights(north, east)
        picture = self._look_up(layers.ground, layers, north, east)
        for shell in range(shells):
            lift = (shell + 0.4) / shells * self.field.plant_height_m
            north, east = self._meet(position_ned_m, slope_north, slope_east, camera_height - height - lift)
            north, east = self._meet(
                position_ned_m, slope_north, slope_east, camera_height - self._heights(north, east) - lift
            )
            seen = self._look_up(layers.canopy, layers, north, east)
            # A shell shows the leaves about its own height, and not again those that a higher one will.
            unit = self.field.plant_height_m / HEIGHT_SCALE_M * 255.0 / shells
            least, most = max(unit * (shell - 0.35), 2.0), 255.0 if shell == shells - 1 else unit * (shell + 1.35)
            mask = cv2.inRange(cv2.extractChannel(seen, 3), least, most)
            cv2.copyTo(seen, mask, picture)
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGRA2BGR), np.uint8)

    @staticmethod
    def _meet(
        position: FloatArray, slope_north: FloatArray, slope_east: FloatArray, drop: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Where rays have fallen by `drop`; at least a little, so that nothing meets behind the lens."""
        drop = np.maximum(drop, 0.05)
        return position[0] + slope_north * drop, position[1] + slope_east * drop

    def _heights(self, north: FloatArray, east: FloatArray) -> FloatArray:
        """Terrain heights by cv2.remap: six times quicker than HeightMap.heights_m, and within 3 mm of it."""
        terrain = self.field.terrain
        x = ((east - terrain.east0_m) / terrain.spacing_m).astype(np.float32)
        y = ((north - terrain.north0_m) / terrain.spacing_m).astype(np.float32)
        return np.asarray(
            cv2.remap(terrain.grid_m, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float64
        ).reshape(north.shape)

    def _look_up(self, picture: Image, layers: Layers, north: FloatArray, east: FloatArray) -> Image:
        """The painted layer as seen where the grid's rays meet it (north, east)."""
        grid = np.empty((*self._grid_shape, 2), np.float32)
        grid[..., 0] = ((east - layers.east0_m) / layers.gsd_m - 0.5).reshape(self._grid_shape)
        grid[..., 1] = ((north - layers.north0_m) / layers.gsd_m - 0.5).reshape(self._grid_shape)
        step = GRID_STEP_PX
        full = cv2.resize(
            grid, (self._grid_shape[1] * step, self._grid_shape[0] * step), interpolation=cv2.INTER_LINEAR
        )
        inner = full[step:-step, step:-step]
        if layers is self._whole.layers:
            self._whole.paint(float(grid[..., 1].min()), float(grid[..., 1].max()))
        return np.asarray(
            cv2.remap(picture, inner, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101), np.uint8
        )

    def _layers_for(self, position: FloatArray, camera_to_ned: FloatArray, above_m: float) -> tuple[Layers, int]:
        """The layers fit for this distance, and how many shells tell at it."""
        axis_down = max(float(camera_to_ned[2, 2]), 0.05)
        if above_m / axis_down > NEAR_M:
            return self._whole.layers, 2
        reach = above_m / axis_down
        centre_north = float(position[0]) + reach * float(camera_to_ned[0, 2])
        centre_east = float(position[1]) + reach * float(camera_to_ned[1, 2])
        return self._near.around(centre_north, centre_east), 6

    def _painter(self, gsd_m: float) -> Painter:
        """Made when there is something to paint: what others have painted needs none."""
        if self._planted is None:
            self._planted = plant(self.field)
        if gsd_m not in self._painters:
            self._painters[gsd_m] = Painter(self.field, gsd_m, self._planted)
        return self._painters[gsd_m]
