"""Paints any rectangle of a corn field from straight above, at any resolution: what the renderer looks up.

Two layers come out: the bare ground, and the same with all plants upon it and their height as alpha. The same plants,
outlines and colours appear at every resolution, so that a UAS at 15 m and a rover's mast see one field.

The picture's row 0 is the south edge and column 0 the west edge: x grows east and y north.
A rectangle may be painted some rows at a time, to the same pixels as at once: places are worked out from its corner.
Light is painted: hillside shading and the plants' shadows, from the field's sun. Clouds are not.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.kinds.corn_field.crop import KINDS, Plants, grow
from sitl_emu.world.kinds.corn_field.field import ROW_SPACING_M, SURROUNDINGS_M, CornField
from sitl_emu.world.kinds.corn_field.objects import FieldObject, outline
from sitl_emu.world.kinds.corn_field.sprites import SPRITES_PER_KIND, Image, Sprite, library

SOIL_DARK_BGR, SOIL_LIGHT_BGR = (34.0, 48.0, 62.0), (122.0, 148.0, 172.0)
GRASS_DARK_BGR, GRASS_LIGHT_BGR = (22.0, 62.0, 44.0), (92.0, 178.0, 142.0)
GRASS_STRIP_M = 7.0
WANDER_M = 6.0
"""Between places where the field's border is drawn off its line."""
TRACKS_M, TRACK_M, TRACK_DEPTH = (0.7, 2.3), 0.28, 11.0
"""Of a tractor's wheels: how far within the outline, half of their width, and how much darker they are; ours."""
_PLANT_REACH_M = 0.95
"""Half of the largest sprite, and a plant's shadow: how far outside a rectangle a plant may matter."""
BUCKET_M = 4.0


class Layers(NamedTuple):
    """One painted rectangle; both pictures (rows, columns, 4) with the fourth channel as said."""

    ground: Image
    """Without plants; fourth channel unused (four channels are quicker to remap than three)."""
    canopy: Image
    """With plants; fourth channel: plant height, 255 for HEIGHT_SCALE_M, 0 for none."""
    north0_m: float
    east0_m: float
    gsd_m: float
    squeeze: int = 1
    """Rows of the canopy that one of the ground's stands for."""


class _Cut(NamedTuple):
    """What is painted of a rectangle, its rim included: the rows `first` to before `last`, of so many."""

    north0_m: float
    """Of the rectangle's south-west corner, not the cut's."""
    east0_m: float
    first: int
    last: int
    rows: int
    columns: int


class _Box(NamedTuple):
    """The pixels around a thing that lies in a rectangle, and those of them that a cut has."""

    north0_m: float
    """Of its south-west corner."""
    east0_m: float
    shape: tuple[int, int]
    """Rows and columns of all."""
    rows: slice
    """Those that the cut has, counted from the box's first row."""
    own: tuple[slice, slice]
    """The same in the cut's pictures."""


class Planted(NamedTuple):
    """What grows in a field, as painters of all resolutions look it up."""

    plants: Plants
    sprite: npt.NDArray[np.int16]
    """Of each plant: its index among the sprites of all kinds, in the order of KINDS."""
    buckets: dict[tuple[int, int], npt.NDArray[np.int32]]
    """Plant indices by 4 m square, in stamping order."""


def plant(field: CornField) -> Planted:
    """A field's plants, sorted."""
    plants = grow(field)
    before = np.cumsum([0, *SPRITES_PER_KIND.values()])
    rows = np.floor(plants.north_m / BUCKET_M).astype(np.int32)
    columns = np.floor(plants.east_m / BUCKET_M).astype(np.int32)
    key = rows * 10_000 + columns
    order = np.argsort(key, kind="stable").astype(np.int32)
    starts = np.flatnonzero(np.diff(key[order], prepend=key[order[0]] - 1))
    groups = np.split(order, starts[1:])
    buckets = {(int(rows[group[0]]), int(columns[group[0]])): group for group in groups}
    return Planted(plants, (before[plants.kind] + plants.variant).astype(np.int16), buckets)


class Painter:
    """Paints rectangles of one field at one resolution (`gsd_m`, metres a pixel)."""

    def __init__(self, field: CornField, gsd_m: float, planted: Planted | None = None) -> None:
        """`planted`: what grows in the field (`plant`), where that is known already."""
        self.field, self.gsd_m = field, gsd_m
        self._planted = plant(field) if planted is None else planted
        self._slopes = _slopes(field)
        rng = np.random.Generator(np.random.PCG64([field.seed, 0x5011]))
        cells = (
            int((field.size_m[0] + 2 * SURROUNDINGS_M) / 1.0) + 8,
            int((field.size_m[1] + 2 * SURROUNDINGS_M) / 1.0) + 8,
        )
        # Moisture: broad blotches and smaller ones, on a 1 m grid over the whole field.
        broad = cv2.resize(
            rng.normal(size=(cells[0] // 9 + 2, cells[1] // 9 + 2)), cells[::-1], interpolation=cv2.INTER_CUBIC
        )
        self._blotches = (9.0 * broad + 5.0 * rng.normal(size=cells)).astype(np.float32)
        wander = np.random.Generator(np.random.PCG64([field.seed, 0x3EA2]))
        self._wander = wander.normal(scale=0.5, size=[each // 6 + 3 for each in cells]).astype(np.float32)
        """How far the grass's edges wander, in metres, on a grid of WANDER_M."""
        grain = np.random.Generator(np.random.PCG64([field.seed, 0x62A1, round(gsd_m * 1e4)]))
        noise = grain.normal(size=(256, 256)).astype(np.float32)
        clods = cv2.GaussianBlur(np.tile(noise, (3, 3)), (0, 0), 0.05 / gsd_m)[256:512, 256:512]
        # Clods of 5 cm and single grains, repeated every 256 pixels: the eye does not find it among the plants.
        self._grain = (noise * 5.0 + clods / clods.std() * 8.0).astype(np.float32)
        self._soil = _ramp(field, SOIL_DARK_BGR, SOIL_LIGHT_BGR)
        self._grass = _ramp(field, GRASS_DARK_BGR, GRASS_LIGHT_BGR)
        self._tint = tint_of(field)
        self._sprites = self._tinted_sprites()
        self._sides = np.array([len(sprite.mask) for sprite in self._sprites])

    def _tinted_sprites(self) -> list[Sprite]:
        """Kind by kind, in the order of KINDS."""
        by_kind = library(self.field.seed, self.field.plant_height_m, self.gsd_m)
        sprites = [sprite for kind in KINDS for sprite in by_kind[kind]]
        for sprite in sprites:
            for c in range(3):
                np.copyto(sprite.bgra[..., c], cv2.convertScaleAbs(sprite.bgra[..., c], alpha=self._tint[c]))
        return sprites

    def paint(
        self, north0_m: float, east0_m: float, rows: int, columns: int, part: tuple[int, int] | None = None
    ) -> Layers:
        """The rectangle whose south-west corner is (north0_m, east0_m), `rows` by `columns` pixels.

        `part`: only its rows from the first of these to before the second; they are the same pixels.
        """
        gsd = self.gsd_m
        pad = math.ceil(_PLANT_REACH_M / gsd)
        first, last = (0, rows) if part is None else part
        # Painted with a rim, then cut: shadows and plants reach in from outside.
        tall, wide = rows + 2 * pad, columns + 2 * pad
        halo = min(math.ceil(math.hypot(*self._shadow_px())) + 1, pad)
        cut = _Cut(north0_m - pad * gsd, east0_m - pad * gsd, pad + first - halo, pad + last + halo, tall, wide)
        ground = self._paint_ground(cut)
        plants = self._stamp(cut)
        cover = np.asarray(cv2.inRange(cv2.extractChannel(plants, 3), 1.0, 255.0), np.uint8)
        ground = self._shadow(ground, cover)
        canopy = cv2.cvtColor(ground, cv2.COLOR_BGR2BGRA)
        canopy[..., 3] = 0
        cv2.copyTo(plants, cover, canopy)
        ground = cv2.cvtColor(ground, cv2.COLOR_BGR2BGRA)
        self._shade(ground, canopy, cut)
        inner = (slice(halo, halo + last - first), slice(pad, pad + columns))
        return Layers(
            np.ascontiguousarray(ground[inner]),
            np.ascontiguousarray(canopy[inner]),
            north0_m + first * gsd,
            east0_m,
            gsd,
        )

    def _paint_ground(self, cut: _Cut) -> Image:
        gsd, field = self.gsd_m, self.field
        rows, columns = cut.last - cut.first, cut.columns
        row0, column0 = round(cut.north0_m / gsd) + cut.first, round(cut.east0_m / gsd)
        light = self._window(self._blotches, -SURROUNDINGS_M - 4.0, 1.0, cut)
        grain = np.roll(self._grain, (-(row0 % 256), -(column0 % 256)), axis=(0, 1))
        light += np.tile(grain, (rows // 256 + 1, columns // 256 + 1))[:rows, :columns]
        # Brightness added by slopes towards the sun.
        light += 105.0 + self._window(self._slopes, -SURROUNDINGS_M, field.terrain.spacing_m, cut)
        # The planter's press wheel leaves a slight furrow along each row.
        east = cut.east0_m + (np.arange(columns, dtype=np.float32) + 0.5) * gsd
        phase = (east - field.row_east_m[0]) * (math.tau / ROW_SPACING_M)
        light -= (5.0 * np.cos(phase)).astype(np.float32)[None, :]
        outside = self._outside(cut)
        for along_m in TRACKS_M:
            # Where the planter turned: two wheels' tracks around the field, within the headland.
            light -= TRACK_DEPTH * np.clip(1.0 - abs(outside + along_m) / TRACK_M, 0.0, 1.0)
        np.clip(light, 0.0, 255.0, out=light)
        level = light.astype(np.uint8)
        ground = np.asarray(cv2.LUT(cv2.merge((level, level, level)), self._soil), np.uint8)
        self._paint_grass(ground, level, outside)
        for thing in field.objects:
            if thing.kind in ("bare_soil", "puddle"):
                self._paint_patch(ground, level, thing, cut)
        return ground

    def _outside(self, cut: _Cut) -> npt.NDArray[np.float32]:
        """How far each pixel of a cut lies outside the outline, the larger of both axes; less than 0 within."""
        gsd, size = self.gsd_m, self.field.size_m
        north = cut.north0_m + (np.arange(cut.first, cut.last) + 0.5) * gsd
        east = cut.east0_m + (np.arange(cut.columns) + 0.5) * gsd
        out_north = np.maximum(-north, north - size[0])
        out_east = np.maximum(-east, east - size[1])
        straight = np.maximum(out_north[:, None], out_east[None, :]).astype(np.float32)
        return np.asarray(straight + self._window(self._wander, -SURROUNDINGS_M - 6.0, WANDER_M, cut), np.float32)

    def _paint_grass(self, ground: Image, level: Image, out: npt.NDArray[np.float32]) -> None:
        """A grass strip around the outline; beyond it lies tilled soil."""
        if float(out.max()) < -1.0:
            return
        fray = (level.astype(np.float32) - 105.0) * 0.012
        grass = ((out + fray > 0.6) & (out + fray < GRASS_STRIP_M)).astype(np.uint8) * 255
        contrast = cv2.convertScaleAbs(level, alpha=2.2, beta=-126.0)
        cv2.copyTo(np.asarray(cv2.LUT(cv2.merge((contrast, contrast, contrast)), self._grass)), grass, ground)

    def _paint_patch(self, ground: Image, level: Image, thing: FieldObject, cut: _Cut) -> None:
        """Bare soil, dry and paler; or a puddle, that mirrors the sky and has a dark, wet rim."""
        box = self._box(thing, 1.4 * thing.radius_m, cut)
        if box is None:
            return
        part, part_level = ground[box.own], level[box.own]
        rng = np.random.Generator(np.random.PCG64([thing.seed, 4]))
        soft = self._soft_mask(thing, 1.0, 0.10, box)
        if thing.kind == "bare_soil":
            dry = cv2.convertScaleAbs(part_level, alpha=0.85, beta=float(rng.uniform(18.0, 52.0)))
            new = np.asarray(cv2.LUT(cv2.merge((dry, dry, dry)), self._soil), np.float32)
            part[:] = (part * (1.0 - soft) + new * soft).astype(np.uint8)
            return
        wet = part.astype(np.float32) * (1.0 - 0.45 * soft)
        water = self._soft_mask(thing, 0.86, 0.03, box)
        mirror = float(rng.uniform(0.25, 0.75))
        muddy, sky = np.array((58.0, 72.0, 84.0)), np.array((176.0, 160.0, 146.0))
        colour = (muddy * (1.0 - mirror) + sky * mirror) * self._tint
        ripple = (part_level.astype(np.float32)[..., None] - 105.0) * 0.12
        part[:] = np.clip(wet * (1.0 - water) + (colour + ripple) * water, 0, 255).astype(np.uint8)

    def _box(self, thing: FieldObject, reach_m: float, cut: _Cut) -> _Box | None:
        """The pixels as far as `reach_m` around a thing; None where the cut has none of them."""
        gsd = self.gsd_m
        top = max(0, int((thing.north_m - reach_m - cut.north0_m) / gsd))
        left = max(0, int((thing.east_m - reach_m - cut.east0_m) / gsd))
        bottom = min(cut.rows, int((thing.north_m + reach_m - cut.north0_m) / gsd) + 1)
        right = min(cut.columns, int((thing.east_m + reach_m - cut.east0_m) / gsd) + 1)
        first, last = max(top, cut.first), min(bottom, cut.last)
        if first >= last or left >= right:
            return None
        return _Box(
            cut.north0_m + top * gsd,
            cut.east0_m + left * gsd,
            (bottom - top, right - left),
            slice(first - top, last - top),
            (slice(first - cut.first, last - cut.first), slice(left, right)),
        )

    def _soft_mask(self, thing: FieldObject, scale: float, edge_m: float, box: _Box) -> npt.NDArray[np.float32]:
        """(rows, columns, 1): 1 within the outline, scaled about its centre, 0 outside, over a soft edge."""
        points = outline(thing._replace(radius_m=thing.radius_m * scale))
        xy = (points[:, ::-1] - (box.east0_m, box.north0_m)) / self.gsd_m - 0.5
        mask = np.zeros(box.shape, np.uint8)
        cv2.fillPoly(mask, [np.round(xy * 16.0).astype(np.int32)], 255, cv2.LINE_AA, 4)
        sigma = edge_m / self.gsd_m
        if sigma > 0.5:
            mask = np.asarray(cv2.GaussianBlur(mask, (0, 0), sigma), np.uint8)
        return mask[box.rows, :, None].astype(np.float32) / 255.0

    def _stamp(self, cut: _Cut) -> Image:
        """All plants (rows, columns, 4), on nothing; where there is one, its height is not 0."""
        gsd, rows = self.gsd_m, cut.last - cut.first
        picture = np.zeros((rows, cut.columns, 4), np.uint8)
        reach = int(self._sides.max())
        first_row = math.floor((cut.north0_m + (cut.first - reach) * gsd) / BUCKET_M)
        first_column = math.floor(cut.east0_m / BUCKET_M)
        last_row = math.floor((cut.north0_m + (cut.last + reach) * gsd) / BUCKET_M)
        last_column = math.floor((cut.east0_m + cut.columns * gsd) / BUCKET_M)
        plants, sprite, buckets = self._planted
        groups = [
            buckets[key]
            for key in ((i, j) for i in range(first_row, last_row + 1) for j in range(first_column, last_column + 1))
            if key in buckets
        ]
        if not groups:
            return picture
        index = np.sort(np.concatenate(groups))
        number = sprite[index]
        side = self._sides[number]
        top = np.floor((plants.north_m[index] - cut.north0_m) / gsd).astype(int) - side // 2
        left = np.floor((plants.east_m[index] - cut.east0_m) / gsd).astype(int) - side // 2
        # Plants that the painted rim would cut are left out; of the tallest, leaf tips reach the part that is kept.
        whole = (top >= 0) & (left >= 0) & (top + side <= cut.rows) & (left + side <= cut.columns)
        seen = whole & (top < cut.last) & (top + side > cut.first)
        places = (each[seen].tolist() for each in (number, side, top - cut.first, left))
        copy_to, sprites = cv2.copyTo, self._sprites
        for number_, side_, y, x in zip(*places, strict=True):
            bgra, mask = sprites[number_]
            if y < 0 or y + side_ > rows:
                inside = slice(max(-y, 0), rows - y)
                copy_to(bgra[inside], mask[inside], picture[max(y, 0) : y + side_, x : x + side_])
            else:
                copy_to(bgra, mask, picture[y : y + side_, x : x + side_])
        return picture

    def _shadow_px(self) -> tuple[float, float]:
        """How far shadows fall, in columns and rows."""
        light = self.field.light
        length = 0.55 * self.field.plant_height_m / math.tan(math.radians(light.elevation_deg)) / self.gsd_m
        away = math.radians(light.azimuth_deg) + math.pi
        return length * math.sin(away), length * math.cos(away)

    def _shadow(self, ground: Image, cover: Image) -> Image:
        """Plants darken the ground beside them, away from the sun."""
        columns, rows = self._shadow_px()
        shift = np.array(((1.0, 0.0, columns), (0.0, 1.0, rows)))
        fallen = cv2.warpAffine(cover, shift, cover.shape[::-1], flags=cv2.INTER_NEAREST)
        # Under the leaves it is dark too, wherever the sun stands: seen between plants from a low mast.
        dark = cv2.convertScaleAbs(ground, alpha=0.58)
        return np.asarray(cv2.copyTo(dark, fallen | cover, ground), np.uint8)

    def _shade(self, ground: Image, canopy: Image, cut: _Cut) -> None:
        """Shade spots: what something outside the picture keeps the sun from, ground and plants alike."""
        for thing in self.field.objects:
            if thing.kind != "shade":
                continue
            box = self._box(thing, 1.6 * thing.radius_m + 0.2, cut)
            if box is None:
                continue
            soft = self._soft_mask(thing, 1.0, 0.08, box)
            depth = np.array((0.42, 0.50, 0.55), np.float32)  # skylight is blue, so blue stays longest
            for picture in (ground, canopy):
                part = picture[box.own][..., :3]
                part[:] = (part * (1.0 - depth * soft)).astype(np.uint8)

    def _window(
        self, grid: npt.NDArray[np.float32], start_m: float, spacing_m: float, cut: _Cut
    ) -> npt.NDArray[np.float32]:
        """A coarse grid, whose point (0, 0) lies at start_m north and east, drawn out over a cut."""
        step = self.gsd_m / spacing_m
        x0 = (cut.east0_m + self.gsd_m / 2 - start_m) / spacing_m
        y0 = (cut.north0_m + self.gsd_m / 2 - start_m) / spacing_m
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        drawn = np.empty((cut.last - cut.first, cut.columns), np.float32)
        # Row by row, in OpenCV's own single precision: so a row does not depend on which others are drawn with it.
        ys = np.arange(cut.first, cut.last, dtype=np.float32) * np.float32(step) + np.float32(y0)
        to_grid = np.array(((step, 0.0, x0), (0.0, step, 0.0)))
        for row, y in zip(drawn, ys.tolist(), strict=True):
            to_grid[1, 2] = y
            cv2.warpAffine(grid, to_grid, (cut.columns, 1), row[None], flags, cv2.BORDER_REPLICATE)
        return drawn


def _slopes(field: CornField) -> npt.NDArray[np.float32]:
    """Brightness added by slopes towards the sun, on the terrain's own grid."""
    terrain, light = field.terrain, field.light
    d_north, d_east = np.gradient(terrain.grid_m, terrain.spacing_m)
    azimuth = math.radians(light.azimuth_deg)
    towards = -(d_north * math.cos(azimuth) + d_east * math.sin(azimuth)) / math.tan(math.radians(light.elevation_deg))
    return np.asarray(70.0 * towards, np.float32)


def tint_of(field: CornField) -> npt.NDArray[np.float64]:
    """Factor on blue, green and red that light and exposure make."""
    light = field.light
    return np.array((light.gain / light.warmth, light.gain, light.gain * light.warmth))


def _ramp(field: CornField, dark: tuple[float, ...], light: tuple[float, ...]) -> Image:
    """Look-up table (1, 256, 3) from brightness to colour."""
    t = np.linspace(0.0, 1.0, 256)[:, None]
    colours = (np.array(dark) * (1.0 - t) + np.array(light) * t) * tint_of(field)
    return np.clip(colours, 0, 255).astype(np.uint8).reshape(1, 256, 3)


def orthophoto(field: CornField, gsd_m: float = 0.1) -> Image:
    """The field's outline from straight above, north up, BGR: for maps and reports."""
    layers = Painter(field, gsd_m).paint(0.0, 0.0, round(field.size_m[0] / gsd_m), round(field.size_m[1] / gsd_m))
    return np.ascontiguousarray(layers.canopy[::-1, :, :3])
