"""The ground's colours as a map from above, painted from land use and a seed, or from a photo.

No texture repeats here: broad and fine noise of the whole map's size; close by, the shading adds a detail texture,
whose number the map carries in its fourth channel.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.description import LAND_USES, Cover, Ground, WorldDescription
from sitl_emu.world.render.kernel import F32, HALF, ONE, U8, ZERO, f4, streamed_kernel
from sitl_emu.world.render.maps import GroundMap
from sitl_emu.world.render.textures import LAYER

I16 = npt.NDArray[np.int16]

FINEST_M = 0.1
MOST_TEXELS = 2000
"""Along a side; a larger world has coarser texels."""
AT_ONCE = 1 << 19
"""Of a map's noise, so that it is in memory but once: a map of 16 MB has three."""
LEVELS = 7
STEPS = np.float32(4096.0)
"""To which a map's noise is rounded, of its deviation: halves take half the memory of floats."""
WOBBLE_M, BUILT_WOBBLE_M = 1.6, 0.4
"""How far the borders of natural land uses stray from their polygons, about; and where they border on built ones."""


class Look(NamedTuple):
    """How a land use is painted."""

    detail: str
    patches: tuple[float, float, float]
    """The colour that broad patches go towards."""
    patchy: float
    """How far they go."""
    fine: float
    """Standard deviation of fine brightness."""
    is_built: bool = False
    """Its borders are straight."""


LOOKS: dict[str, Look] = {
    "grass": Look("grass", (0.46, 0.43, 0.29), 0.7, 0.06),
    "soil": Look("soil", (0.54, 0.45, 0.35), 0.45, 0.07),
    "asphalt": Look("asphalt", (0.33, 0.32, 0.31), 0.5, 0.035, True),
    "concrete": Look("paving", (0.52, 0.50, 0.46), 0.4, 0.03, True),
    "gravel": Look("gravel", (0.44, 0.42, 0.37), 0.5, 0.03),
    "sand": Look("soil", (0.68, 0.60, 0.45), 0.4, 0.04),
    "rock": Look("gravel", (0.38, 0.37, 0.35), 0.6, 0.08),
    "mud": Look("soil", (0.25, 0.21, 0.16), 0.6, 0.05),
    "forest_floor": Look("litter", (0.24, 0.27, 0.12), 0.6, 0.10),
    "charred": Look("ashes", (0.22, 0.21, 0.20), 0.5, 0.09),
    "snow": Look("soil", (0.84, 0.88, 0.93), 0.4, 0.015),
}


BUILT = tuple(LAYER[look.detail] for look in LOOKS.values() if look.is_built)
"""Detail textures of land uses whose borders are straight."""


class Frame(NamedTuple):
    """What part of the world a map shows."""

    north0_m: float
    east0_m: float
    gsd_m: float
    rows: int
    columns: int


def frame_of(south: float, west: float, north: float, east: float) -> Frame:
    """Of a rectangle in the world."""
    gsd_m = max(FINEST_M, max(north - south, east - west) / MOST_TEXELS)
    return Frame(south, west, gsd_m, max(round((north - south) / gsd_m), 8), max(round((east - west) / gsd_m), 8))


def fractal(rng: np.random.Generator, frame: Frame, broadest_m: float, finest_m: float, gain: float = 0.55) -> F32:
    """Noise over a map, mean 0 and deviation about 1, with waves between two lengths; nothing repeats."""
    octaves = max(round(math.log2(broadest_m / max(finest_m, frame.gsd_m))), 0)
    cell_px = max(finest_m / frame.gsd_m, 1.0)
    rows, columns = (math.ceil(count / cell_px / 2**octaves) + 2 for count in (frame.rows, frame.columns))
    total = rng.standard_normal((rows, columns), np.float32)
    weight, power = 1.0, 1.0
    for _ in range(octaves):
        rows, columns = 2 * rows, 2 * columns
        total = cv2.resize(total, (columns, rows), interpolation=cv2.INTER_CUBIC)
        weight *= gain
        power += weight * weight
        for some in np.array_split(total, -(-total.size // AT_ONCE)):
            noise = rng.standard_normal(some.shape, np.float32)
            noise *= np.float32(weight)
            some += noise
    if cell_px > 1.0:
        total = cv2.resize(total, None, fx=cell_px, fy=cell_px, interpolation=cv2.INTER_LINEAR)
    # Cubic steps between random heights keep two thirds of their spread
    total *= np.float32(1.25 / math.sqrt(power))
    return np.ascontiguousarray(total[: frame.rows, : frame.columns], np.float32)


def _in_steps(noise: F32) -> I16:
    """Noise in STEPS of its deviation, eight of them at most; `noise` is spent."""
    noise *= STEPS
    return np.asarray(np.clip(np.rint(noise, out=noise), -32767, 32767, out=noise).astype(np.int16))


class Part(NamedTuple):
    """Some texels of a map."""

    window: tuple[slice, slice]
    mask: npt.NDArray[np.bool_]
    """Of the window."""


WHITE = f4(255.0)
STEP = f4(1.0 / STEPS)
OWN_PATCHES = np.array((1.12, 1.03, 0.9), np.float32)
"""What broad patches of a colour of one's own go towards, as factors."""


@streamed_kernel
def _paint(
    texels: U8, broad: I16, other: I16, fine: I16, mask: npt.NDArray[np.bool_], first_row: int, first_column: int,
    mean: F32, towards: F32, patchy: np.float32, fineness: np.float32, detail: int,
) -> None:  # fmt: skip
    for i in range(mask.shape[0]):
        row = first_row + i
        some = texels[row, first_column:]
        far, near, finest = broad[row, first_column:], other[row, first_column:], fine[row, first_column:]
        for k in range(mask.shape[1]):
            if not mask[i, k]:
                continue
            at_far, at_near, at_finest = STEP * f4(far[k]), STEP * f4(near[k]), STEP * f4(finest[k])
            share = min(max(HALF + f4(0.38) * at_far + f4(0.22) * at_near, ZERO), ONE) * patchy
            bright = (ONE + fineness * at_finest + f4(0.6) * fineness * at_near) * WHITE
            for c in range(3):
                some[k, c] = np.uint8(min(max((mean[c] + share * towards[c]) * bright + HALF, ZERO), WHITE))
            some[k, 3] = detail


class Painter:
    """Paints one map, south-west corner first."""

    def __init__(self, frame: Frame, seed: int) -> None:
        self.frame = frame
        rng = np.random.default_rng((seed, 11))
        self.broad = _in_steps(fractal(rng, frame, 40.0, 0.8))
        self.other = _in_steps(fractal(rng, frame, 14.0, 0.4))
        self.fine = _in_steps(fractal(rng, frame, 0.8, 0.1, 0.8))
        window = slice(0, frame.rows), slice(0, frame.columns)
        self.everywhere = Part(window, np.broadcast_to(np.True_, (frame.rows, frame.columns)).copy())
        self.texels = np.zeros((frame.rows, frame.columns, 4), np.uint8)
        """Red, green, blue, and the number of the detail texture."""

    def use(self, name: str, where: "Part | None" = None, colour: Sequence[float] | None = None) -> None:
        """Paint a land use, everywhere or within a part; `colour`: its mean, if not the land use's own."""
        look, mean = LOOKS[name], np.array(LAND_USES[name] if colour is None else colour, np.float32)
        towards = np.array(look.patches, np.float32) if colour is None else mean * OWN_PATCHES
        part = self.everywhere if where is None else where
        rows, columns = part.window
        _paint(
            self.texels, self.broad, self.other, self.fine, part.mask, rows.start, columns.start, mean, towards - mean,
            np.float32(look.patchy), np.float32(look.fine), LAYER[look.detail],
        )  # fmt: skip

    def polygon(self, corners: Sequence[tuple[float, float]], wobbles: bool) -> "Part":
        """The texels within a polygon (north, east)."""
        frame = self.frame
        pixels = np.array(
            [((e - frame.east0_m) / frame.gsd_m - 0.5, (n - frame.north0_m) / frame.gsd_m - 0.5) for n, e in corners]
        )
        margin = math.ceil(4.0 * WOBBLE_M / frame.gsd_m) if wobbles else 1
        low = np.clip(np.floor(pixels.min(axis=0)) - margin, 0, (frame.columns, frame.rows)).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0)) + margin + 1, 0, (frame.columns, frame.rows)).astype(int)
        window = slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
        mask = np.zeros((max(high[1] - low[1], 0), max(high[0] - low[0], 0)), np.uint8)
        if not mask.size:
            return Part(window, mask > 0)
        cv2.fillPoly(mask, [np.round((pixels - low) * 16).astype(np.int32)], 255, cv2.LINE_8, 4)
        if not wobbles:
            return Part(window, mask > 0)
        # The border strays where a blurred mask is cut at a height that noise tells
        built = np.isin(self.texels[window][..., 3], BUILT)
        soft = np.where(built, _blurred(mask, BUILT_WOBBLE_M / frame.gsd_m), _blurred(mask, WOBBLE_M / frame.gsd_m))
        other, fine = (noise[window] / STEPS for noise in (self.other, self.fine))
        strays = np.clip(45.0 * other + 38.0 * fine, -110.0, 110.0)
        return Part(window, np.asarray(soft > 127.5 + strays))

    def photo(self, picture: U8, ground: Ground) -> None:
        """Lay a photo (BGR, north up) where it belongs."""
        frame = self.frame
        scale = frame.gsd_m / ground.gsd_m
        left = (frame.east0_m - ground.east0_m) / ground.gsd_m + 0.5 * scale - 0.5
        below = (frame.north0_m - ground.north0_m) / ground.gsd_m + 0.5 * scale - 0.5
        to_photo = np.array(((scale, 0.0, left), (0.0, -scale, picture.shape[0] - 1 - below)), np.float32)
        if scale > 1.0:
            picture = np.asarray(cv2.blur(picture, (max(round(scale), 1),) * 2), np.uint8)
        flags, size = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, (frame.columns, frame.rows)
        laid = cv2.warpAffine(picture, to_photo, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        covered = np.full(picture.shape[:2], 255, np.uint8)
        there = cv2.warpAffine(covered, to_photo, size, flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP) > 0
        self.texels[there, :3] = laid[there][:, ::-1]
        self.texels[there, 3] = LAYER["soil"]


def _blurred(mask: U8, deviation_px: float) -> U8:
    """As by a Gaussian, of two boxes, whose size costs nothing."""
    side = 2 * round(0.5 * (math.sqrt(6.0 * deviation_px * deviation_px + 1.0) - 1.0)) + 1
    return np.asarray(cv2.blur(cv2.blur(mask, (side, side)), (side, side)), np.uint8)


def paint(described: WorldDescription, frame: Frame, photo: U8 | None) -> U8:
    """The ground of a description, and the colour of grass that covers it: `Painter.texels`."""
    ground, seed = described.ground, described.seed
    painter = Painter(frame, seed)
    if ground.use:
        painter.use(ground.use)
    else:
        painter.use(_nearest_use(ground.colour), None, ground.colour)
    if photo is not None:
        painter.photo(photo, ground)
    for land in ground.land:
        painter.use(land.use, painter.polygon(land.polygon_m, not LOOKS[land.use].is_built))
    for cover in described.cover:
        if cover.kind == "grass":
            painter.use(
                "grass",
                painter.polygon(cover.polygon_m, True),
                [0.6 * own + 0.5 * usual for own, usual in zip(cover.colour, LAND_USES["grass"], strict=True)],
            )
    return painter.texels


def details(ground: Ground, covers: Sequence[Cover]) -> set[int]:
    """The detail textures that `paint` may name."""
    uses = {ground.use or _nearest_use(ground.colour), *(land.use for land in ground.land)}
    uses |= {"grass" for cover in covers if cover.kind == "grass"} | ({"soil"} if ground.orthophoto else set())
    return {LAYER[LOOKS[use].detail] for use in uses}


def _nearest_use(colour: Sequence[float]) -> str:
    """What ground of a colour is likely to be made of: green is grass, brown is soil, grey is gravel."""
    red, green, blue = colour
    if green > 1.05 * red and green > blue:
        return "grass"
    return "soil" if red > 1.1 * blue else "gravel"


def packed(frame: Frame, texels: U8) -> GroundMap:
    """What was painted, for the shading, with coarser levels."""
    parts, starts, sizes, start = [], [], [], 0
    for _ in range(LEVELS):
        if min(texels.shape[:2]) < 4:
            break
        parts.append(np.ascontiguousarray(texels).reshape(-1).view(np.uint32))
        starts.append(start)
        sizes.append(texels.shape[:2])
        start += texels.size // 4
        half = (texels.shape[1] // 2, texels.shape[0] // 2)
        even = texels[: 2 * half[1], : 2 * half[0]]
        texels = np.asarray(cv2.resize(even, half, interpolation=cv2.INTER_AREA), np.uint8)
        texels[..., 3] = even[::2, ::2, 3]
    far = parts[-1].view(np.uint8).reshape(-1, 4)[:, :3].mean(axis=0) / 255.0
    corner = np.array((frame.north0_m, frame.east0_m, frame.gsd_m, *far), np.float32)
    return GroundMap(np.concatenate(parts), np.array(starts, np.int32), np.array(sizes, np.int32), corner)
