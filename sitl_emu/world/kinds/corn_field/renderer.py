"""Draws what a pinhole camera sees of a corn field: the painted ground, plants upon it, and what lies beyond.

For a grid of one pixel in eight, rays are met with the terrain; the map coordinates of the pixels between are
interpolated, and `cv2.remap` looks them up in painted layers (painter.py): the whole field at 5 cm a pixel (whole.py),
and about a camera that is near a mosaic of tiles of 1.6 cm (mosaic.py); both are painted as they come into view.

Plants within standing.REACH_M of a camera that is lower than `STANDING_M` are drawn as meshes (standing.py). Those
further off, and all that a higher camera sees, stand up by shells: the painted picture, looked up again where the rays
meet surfaces one above the other, shows what grows at least so high. Sky and the land around are backdrop.py's.

Geometry: a point of the ground appears within 0.2 px of its pinhole projection (a test measures it). Where the view is
steep, the terrain is met by fixed-point iteration, which converges while its slope times the tangent of the ray's angle
from the vertical stays below 1; a view with flatter rays is marched along.
A picture is a function of field, pose and vehicles alone: when and where it is painted changes nothing that is seen.
Other vehicles, and things such as cars and persons, are visitors.py's. It draws neither solids nor loose bodies.
"""

import math
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.kinds.corn_field import backdrop, haze, standing
from sitl_emu.world.kinds.corn_field.field import CornField
from sitl_emu.world.kinds.corn_field.mosaic import TILE_GSD_M, Mosaic
from sitl_emu.world.kinds.corn_field.painter import Layers, Painter, Planted, plant, tint_of
from sitl_emu.world.kinds.corn_field.sprites import HEIGHT_SCALE_M, Image
from sitl_emu.world.kinds.corn_field.visitors import Visitors
from sitl_emu.world.kinds.corn_field.whole import FIELD_GSD_M, WholeField
from sitl_emu.world.render.kernel import F32
from sitl_emu.world.render.raster import Pinhole

FloatArray = npt.NDArray[np.float64]

Surface = tuple[FloatArray, FloatArray]
"""North and east of where the grid's rays meet it."""

STANDING_M = 11.0
"""Below this height over the ground plants near the camera are meshes: lower than a survey is flown (12 m and more)."""
NEAR_M = 9.0
"""Below it the ground near the camera is the mosaic's."""
LOOKS_AHEAD_M = 6.0
"""How far before a camera that looks ahead the mosaic's middle lies: half of it reaches 10 m."""
FINE_M = 24.0
"""Above it a pixel sees more of the ground than the painting's: the look-up is done at twice the size and reduced."""
SOFT = ((40.0, (1, 3)), (90.0, (3, 3)))
"""From the square root of this times its height on, over the ground, a camera that looks ahead sees the ground
foreshortened to more than the painting's pixels in one of its own; so many pixels are mixed there."""
SOFT_FROM, SOFT_TO = 0.75, 1.5
"""Of that reach: where it begins, and where all is mixed, so that no line is seen between."""
SHELLS = 2
MAX_RANGE_M = 120.0
FLAT_SLOPE = 0.2
"""Fall of a ray over its way along the ground, below which it is marched."""
STEPS_M = 0.2 * 1.25 ** np.arange(31)
"""Along the ground: to 160 m, each a quarter longer than the one before."""
FAR_M = 5000.0
GRID_STEP_PX = 8


class View(NamedTuple):
    """What one picture is drawn from."""

    position: FloatArray
    camera_to_ned: FloatArray
    rays: FloatArray
    """(3, n) of the grid, NED."""
    zoom: float
    """Times the focal length."""
    above_m: float
    """The camera over the ground."""
    is_flat: bool
    """Whether some rays graze the ground, or rise."""
    stands: bool
    """Whether plants near the camera are meshes."""
    surfaces: list[Surface]
    """The ground, and each shell of the plants upon it."""

    @property
    def seen_from_m(self) -> float:
        """The height from which a camera that has not zoomed would see the ground below as large."""
        return self.above_m / self.zoom


class Renderer:
    """The eyes on one field: `draw` for any number of poses and one set of intrinsics.

    `width` and `height` in pixels (multiples of 8), `focal_px` for both axes; the principal point is the centre.
    `shared_memory`: see whole.py.
    """

    def __init__(
        self, field: CornField, width: int, height: int, focal_px: float, shared_memory: int | None = None,
        visitors: Visitors | None = None,
    ) -> None:  # fmt: skip
        """`visitors`: vehicles and things that it shows."""
        if width % GRID_STEP_PX or height % GRID_STEP_PX:
            raise ValueError(f"width and height must be multiples of {GRID_STEP_PX}, not {width} x {height}")
        self.field = field
        self._width, self._height, self._visitors = width, height, visitors
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
        self._standing: standing.Standing | None = None
        self._focal_px = float(focal_px)
        rows, columns = self._whole.layers.canopy.shape[:2]
        self._backdrop = backdrop.of(field, tint_of(field), columns, rows)
        self._haze = haze.of(field)
        # Interleaved gradient noise: of any few neighbours, some lie below each share
        row, column = np.mgrid[0:height, 0:width]
        self._thresholds = (52.9829189 * ((0.06711056 * column + 0.00583715 * row) % 1.0) % 1.0).astype(np.float32)

    def draw(
        self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float = 0.0, zoom: float = 1.0
    ) -> Image:
        """The picture (height, width, 3), BGR, taken from a place (3,) with an attitude (3, 3).

        Camera axes: x right, y down in the picture, z along the optical axis. `zoom`: times the focal length.
        """
        view = self._view(position_ned_m, camera_to_ned, zoom)
        layers = self._whole.layers
        box = _box(layers, view.surfaces[0])
        self._whole.paint(*(min(max(row, 0.0), len(layers.canopy) - 1.0) for row in (box[0], box[1])))
        seen = self._from_high(view) if view.seen_from_m > FINE_M else self._from_low(view)
        if view.is_flat:
            self._soften(seen, view)
        self._veil(seen, view)
        if view.is_flat or _leaves(box, layers):
            self._put_backdrop(seen, view)
        return self._put_standing(seen, view, time_s)

    def _put_standing(self, seen: Image, view: View, time_s: float) -> Image:
        """What stands before the ground: plants near a low camera, and other vehicles and things with their shadows."""
        vehicles = self._visitors.at(time_s) if self._visitors is not None else None
        if vehicles is not None and self._visitors is not None:
            self._visitors.shade(seen, self._pinhole(view), vehicles)
        nearer = None
        if view.stands:
            seen = self._plants().draw(seen, self._pinhole(view))
            nearer = self._plants().nearness
        if vehicles is not None and self._visitors is not None:
            seen = self._visitors.draw(seen, self._pinhole(view), vehicles, nearer)
        return seen

    def _view(self, position: FloatArray, camera_to_ned: FloatArray, zoom: float) -> View:
        """What follows from a camera's place and attitude; `surfaces`: the ground, and the shells above it."""
        rays = camera_to_ned @ (self._rays / np.array(((zoom,), (zoom,), (1.0,))))
        above = max(-float(position[2]) - self.field.terrain.height_m(*position[:2].tolist()), 0.05)
        is_flat = bool((rays[2] < FLAT_SLOPE * np.hypot(rays[0], rays[1])).any())
        lifts = [0.0, *((shell + 0.4) / SHELLS * self.field.plant_height_m for shell in range(SHELLS))]
        surfaces = (self._marched if is_flat else self._fallen)(position, rays, above, lifts)
        return View(position, camera_to_ned, rays, zoom, above, is_flat, above / zoom < STANDING_M, surfaces)

    def _from_high(self, view: View) -> Image:
        """Ground and plants as one surface: how high they stand is not to be seen from there."""
        layers = self._whole.layers
        scale = 1 if view.is_flat else 2
        picture = _remapped(layers.canopy, self._pixels(layers, view.surfaces[1], scale))
        seen = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGRA2BGR), np.uint8)
        if scale > 1:
            seen = np.asarray(cv2.resize(seen, (self._width, self._height), interpolation=cv2.INTER_AREA), np.uint8)
        return seen

    def _from_low(self, view: View) -> Image:
        """The ground, and the plants that are painted, by shells."""
        layers = self._whole.layers
        picture = _remapped(layers.ground, self._pixels(layers, view.surfaces[0], squeeze=layers.squeeze))
        if view.seen_from_m < NEAR_M:
            self._put_near(picture, view)
        self._put_shells(picture, view)
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGRA2BGR), np.uint8)

    def _soften(self, seen: Image, view: View) -> None:
        """Where the ground is so foreshortened that a pixel sees much of it, pixels mix with their neighbours."""
        for from_m, size in SOFT:
            beyond = self._mixed_beyond(view, math.sqrt(from_m * view.above_m * view.zoom))
            if beyond is not None:
                cv2.copyTo(cv2.blur(seen, size), beyond, seen)

    def _veil(self, seen: Image, view: View) -> None:
        """Haze before the painted field."""
        near = haze.nearness(*view.surfaces[0], view.position, view.above_m)
        if self._haze.is_seen(haze.farthest_m(near)):
            full = self._drawn_out(near.astype(np.float32).reshape(self._grid_shape))
            haze.veil(np.ascontiguousarray(full), self._haze, seen)

    def _mixed_beyond(self, view: View, reach_m: float) -> Image | None:
        """A mask (height, width) of the more pixels the farther beyond so much the ground lies; None: of none."""
        away = np.hypot(view.surfaces[0][0] - view.position[0], view.surfaces[0][1] - view.position[1])
        if float(away.max()) < SOFT_FROM * reach_m:
            return None
        share = np.clip((away / reach_m - SOFT_FROM) / (SOFT_TO - SOFT_FROM), 0.0, 1.0).astype(np.float32)
        return np.asarray(
            cv2.compare(self._drawn_out(share.reshape(self._grid_shape)), self._thresholds, cv2.CMP_GT), np.uint8
        )

    def _beyond(self, view: View, surface: Surface, reach_m: float) -> Image | None:
        """A mask (height, width) of what lies further off than so much over the ground; None: nothing."""
        away = np.hypot(surface[0] - view.position[0], surface[1] - view.position[1])
        if float(away.max()) < reach_m:
            return None
        grid = np.minimum(away, 2.0 * reach_m).astype(np.float32).reshape(self._grid_shape)
        return np.asarray(cv2.inRange(self._drawn_out(grid), reach_m, 1e9), np.uint8)

    def _put_backdrop(self, seen: Image, view: View) -> None:
        """What lies beyond the painted field."""
        sky = np.empty((view.rays.shape[1], 3), np.uint8)
        backdrop.sky(view.rays, self._backdrop.air, sky)
        above = np.ascontiguousarray(self._drawn_out(sky.reshape(*self._grid_shape, 3)))
        ground = np.ascontiguousarray(self._pixels(self._whole.layers, view.surfaces[0]))
        backdrop.paint(ground, self._pinhole(view), view.above_m, self._backdrop, above, seen)

    def _put_near(self, picture: Image, view: View) -> None:
        """The finer ground about the place that a low camera looks at."""
        axis = view.camera_to_ned[:, 2]
        reach = min(view.above_m / max(float(axis[2]), 0.05), LOOKS_AHEAD_M * view.zoom)
        near = self._near.around(*(float(view.position[k] + reach * axis[k]) for k in range(2)))
        pixels = self._pixels(near, view.surfaces[0])
        cv2.remap(near.ground, pixels, None, cv2.INTER_LINEAR, picture, cv2.BORDER_TRANSPARENT)

    def _put_shells(self, picture: Image, view: View) -> None:
        """The painted plants, by shells; where those near the camera stand, only what lies further off."""
        layers = self._whole.layers
        for shell, surface in enumerate(view.surfaces[1:]):
            beyond = self._beyond(view, surface, standing.REACH_M) if view.stands else None
            if view.stands and beyond is None:
                continue
            seen = _remapped(layers.canopy, self._pixels(layers, surface))
            # A shell shows the leaves about its own height, and not again those that a higher one will.
            unit = self.field.plant_height_m / HEIGHT_SCALE_M * 255.0 / SHELLS
            least, most = max(unit * (shell - 0.35), 2.0), 255.0 if shell == SHELLS - 1 else unit * (shell + 1.35)
            mask = cv2.inRange(cv2.extractChannel(seen, 3), least, most)
            cv2.copyTo(seen, mask if beyond is None else cv2.bitwise_and(mask, beyond), picture)

    def _fallen(self, position: FloatArray, rays: FloatArray, above: float, lifts: list[float]) -> list[Surface]:
        """Where rays meet the ground lifted so far, by fixed-point iteration."""
        horizontal = np.hypot(rays[0], rays[1])
        down = np.maximum(rays[2], np.maximum(horizontal * (above / MAX_RANGE_M), 1e-6))
        slope_north, slope_east = rays[0] / down, rays[1] / down
        camera_height = -float(position[2])
        height = np.full(slope_north.shape, camera_height - above)
        for _ in range(5):
            north, east = self._meet(position, slope_north, slope_east, camera_height - height)
            height = self._heights(north, east)
        met = [(north, east)]
        for lift in lifts[1:]:
            north, east = self._meet(position, slope_north, slope_east, camera_height - height - lift)
            drop = camera_height - self._heights(north, east) - lift
            met.append(self._meet(position, slope_north, slope_east, drop))
        return met

    def _marched(self, position: FloatArray, rays: FloatArray, above: float, lifts: list[float]) -> list[Surface]:
        """The same by steps along each ray, which may graze or rise: what meets nothing ends far outside the field."""
        horizontal = np.maximum(np.hypot(rays[0], rays[1]), 1e-3)
        north, east, rise = rays[0] / horizontal, rays[1] / horizontal, -rays[2] / horizontal
        ground = self._heights(position[0] + np.outer(STEPS_M, north), position[1] + np.outer(STEPS_M, east))
        over = -float(position[2]) + np.outer(STEPS_M, rise) - ground
        met = list[Surface]()
        for lift in lifts:
            left = over - lift
            under = left < 0.0
            step = np.maximum(under.argmax(axis=0), 1)
            last, this = np.take_along_axis(left, np.stack((step - 1, step)), axis=0)
            share = np.clip(last / np.where(last - this > 1e-9, last - this, 1.0), 0.0, 1.0)
            away = STEPS_M[step - 1] + share * (STEPS_M[step] - STEPS_M[step - 1])
            away = np.where(under.any(axis=0), away, np.clip(-above / np.minimum(rise, -1e-9), STEPS_M[-1], FAR_M))
            met.append((position[0] + away * north, position[1] + away * east))
        return met

    @staticmethod
    def _meet(
        position: FloatArray, slope_north: FloatArray, slope_east: FloatArray, drop: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Where rays have fallen by `drop`; at least a little, so that nothing meets behind the lens."""
        drop = np.maximum(drop, 0.05)
        return position[0] + slope_north * drop, position[1] + slope_east * drop

    def _heights(self, north: FloatArray, east: FloatArray) -> FloatArray:
        """Terrain heights by cv2.remap: six times quicker than HeightMap.heights_m, and within 3 mm of it.

        (OpenCV 4 takes places to the nearest 32nd of a cell, 5 is exact; pictures alone are drawn by it.)
        """
        terrain = self.field.terrain
        x = ((east - terrain.east0_m) / terrain.spacing_m).astype(np.float32)
        y = ((north - terrain.north0_m) / terrain.spacing_m).astype(np.float32)
        return np.asarray(
            cv2.remap(terrain.grid_m, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float64
        ).reshape(north.shape)

    def _pixels(self, layers: Layers, surface: Surface, scale: int = 1, squeeze: int = 1) -> F32:
        """(height, width, 2): where on a painted layer each pixel looks, from where the grid's rays meet it.

        `scale`: of so many times as many pixels along each side. `squeeze`: see Layers.
        """
        north, east = surface
        grid = np.empty((*self._grid_shape, 2), np.float32)
        grid[..., 0] = ((east - layers.east0_m) / layers.gsd_m - 0.5).reshape(self._grid_shape)
        grid[..., 1] = ((north - layers.north0_m) / (layers.gsd_m * squeeze) - 0.5).reshape(self._grid_shape)
        return self._drawn_out(grid, scale)

    def _drawn_out(self, grid: npt.NDArray[Any], scale: int = 1) -> npt.NDArray[Any]:
        """A figure of the grid's rays, for all pixels: a part of a larger array, which OpenCV takes as it is."""
        step = GRID_STEP_PX * scale
        full = cv2.resize(
            grid, (self._grid_shape[1] * step, self._grid_shape[0] * step), interpolation=cv2.INTER_LINEAR
        )
        return np.asarray(full[step:-step, step:-step])

    def _plants(self) -> standing.Standing:
        """Made when a camera is low: from higher up nobody needs them."""
        if self._standing is None:
            self._planted = self._planted or plant(self.field)
            self._standing = standing.Standing(self.field, self._planted, self._width, self._height)
        return self._standing

    def _pinhole(self, view: View) -> Pinhole:
        at, turn = (np.ascontiguousarray(each, np.float64) for each in (view.position, view.camera_to_ned))
        return Pinhole(at, turn, self._focal_px * view.zoom, self._width, self._height)

    def _painter(self, gsd_m: float) -> Painter:
        """Made when there is something to paint: what others have painted needs none."""
        if self._planted is None:
            self._planted = plant(self.field)
        if gsd_m not in self._painters:
            self._painters[gsd_m] = Painter(self.field, gsd_m, self._planted)
        return self._painters[gsd_m]


def _remapped(picture: Image, pixels: F32) -> Image:
    return np.asarray(cv2.remap(picture, pixels, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def _box(layers: Layers, surface: Surface) -> tuple[float, float, float, float]:
    """First and last row and column of a layer that are looked at."""
    north, east = surface
    first_row, last_row = ((float(each) - layers.north0_m) / layers.gsd_m - 0.5 for each in (north.min(), north.max()))
    first, last = ((float(each) - layers.east0_m) / layers.gsd_m - 0.5 for each in (east.min(), east.max()))
    return first_row, last_row, first, last


def _leaves(box: tuple[float, float, float, float], layers: Layers) -> bool:
    """Whether any pixel looks beyond a layer."""
    rows, columns = layers.canopy.shape[:2]
    return box[0] < 0.0 or box[2] < 0.0 or box[1] >= rows or box[3] >= columns
