"""Pictures of plants and litter from straight above, drawn once and stamped many times by the painter.

A sprite is drawn from leaves as polygons at 4 mm a pixel and then reduced to the painter's resolution, so that the
coarse picture a UAS sees from 15 m and the fine one from a rover's mast show the same plant. Colours are BGR.
Corn after its growth stages V5 to V8; weeds are a broad-leaved rosette and a tuft of grass. Leaf shape and colour are
by eye, not botanical models.
"""

import itertools
import math
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Bgr = tuple[float, float, float]

DRAWN_GSD_M = 0.004
HEIGHT_SCALE_M = 0.8
"""Plant height that the alpha value 255 stands for."""

CORN_VARIANTS = 12
SPRITES_PER_KIND = {
    "corn": CORN_VARIANTS,
    "pale_corn": 8,
    "lush_corn": 8,
    "disease": CORN_VARIANTS,
    "weed_broad": 8,
    "weed_grass": 8,
    "residue": 8,
    "litter": 4,
}


class Sprite(NamedTuple):
    """`bgra`: colour, and height as alpha (255 is `HEIGHT_SCALE_M`); `mask`: 255 where the sprite covers.

    Nowhere under the mask is the height 0.
    """

    bgra: Image
    mask: Image


class Blade(NamedTuple):
    """A leaf, or a straw, as it was drawn: `_Canvas.leaf` says what the figures are."""

    bearing_rad: float
    length_m: float
    width_m: float
    colour: Bgr
    heights_m: tuple[float, float]
    bend_rad: float
    start_m: tuple[float, float]
    taper: float
    segments: int
    lesions: dict[int, Bgr]
    """Colours of those upon it, by the number of the joint."""


class _Canvas:
    """A square picture that leaves are drawn on, with the height of what was drawn."""

    def __init__(self, span_m: float) -> None:
        side = int(span_m / DRAWN_GSD_M) | 1
        self.bgra = np.zeros((side, side, 4), np.uint8)
        self.mask = np.zeros((side, side), np.uint8)
        self.middle = side // 2
        self.blades: list[Blade] = []

    def leaf(
        self,
        bearing_rad: float,
        length_m: float,
        width_m: float,
        colour: Bgr,
        heights_m: tuple[float, float],
        bend_rad: float = 0.0,
        start_m: tuple[float, float] = (0.0, 0.0),
        taper: float = 0.45,
        segments: int = 7,
    ) -> list[tuple[int, int, int]]:
        """A tapering blade from `start_m`; returns its joints as (x, y, width) in pixels for marks upon it."""
        self.blades.append(
            Blade(bearing_rad, length_m, width_m, colour, heights_m, bend_rad, start_m, taper, segments, {})
        )
        x = self.middle + start_m[0] / DRAWN_GSD_M
        y = self.middle + start_m[1] / DRAWN_GSD_M
        step = length_m / DRAWN_GSD_M / segments
        joints = []
        for i in range(segments):
            along = (i + 0.5) / segments
            heading = bearing_rad + bend_rad * along
            x2, y2 = x + step * math.cos(heading), y + step * math.sin(heading)
            width = width_m / DRAWN_GSD_M * min(1.0, (along / 0.25) ** 0.5) * max(0.08, 1.0 - along**2.2) ** taper
            height = heights_m[0] + (heights_m[1] - heights_m[0]) * along
            # Higher leaf is nearer the sky: a little lighter. Alternate sides of the midrib keep blades apart.
            light = 0.82 + 0.3 * height / max(max(heights_m), 0.05) - 0.10 * along
            value = (*(min(255.0, c * light) for c in colour), 255.0 * height / HEIGHT_SCALE_M + 6.0)
            thickness = max(1, round(width))
            ends = ((round(x), round(y)), (round(x2), round(y2)))
            cv2.line(self.bgra, *ends, value, thickness)
            cv2.line(self.mask, *ends, 255, thickness)
            joints.append((round((x + x2) / 2), round((y + y2) / 2), thickness))
            x, y = x2, y2
        return joints

    def rib(self, joints: list[tuple[int, int, int]], lighter: float) -> None:
        """A pale midrib along a leaf."""
        for (x, y, _), (x2, y2, _) in itertools.pairwise(joints):
            b, g, r, a = (
                float(v) for v in self.bgra[min(max(y, 0), len(self.mask) - 1), min(max(x, 0), len(self.mask) - 1)]
            )
            cv2.line(self.bgra, (x, y), (x2, y2), (b * lighter, g * lighter, r * lighter, a), 1)

    def spot(self, x: int, y: int, axes: tuple[int, int], angle_deg: float, colour: Bgr) -> None:
        """An elliptic lesion, only where a leaf already is."""
        reach = max(axes) + 1
        left, top = max(x - reach, 0), max(y - reach, 0)
        around = slice(top, y + reach + 1), slice(left, x + reach + 1)
        mask = self.mask[around]
        blot = np.zeros_like(mask)
        cv2.ellipse(blot, (x - left, y - top), axes, angle_deg, 0, 360, 255, -1)
        self.bgra[around][(blot > 0) & (mask > 0), :3] = colour

    def reduce(self, gsd_m: float) -> Sprite:
        """The sprite at a coarser resolution; colour weighted by cover, so that no rim darkens."""
        side = max(3, round(len(self.mask) * DRAWN_GSD_M / gsd_m))
        cover = self.mask.astype(np.float32) / 255.0
        weighted = cv2.resize(
            self.bgra.astype(np.float32) * cover[..., None], (side, side), interpolation=cv2.INTER_AREA
        )
        reduced = cv2.resize(cover, (side, side), interpolation=cv2.INTER_AREA)
        bgra = weighted / np.maximum(reduced, 1e-3)[..., None]
        mask = np.where(reduced > 0.33, 255, 0).astype(np.uint8)
        # Leaves are drawn with a height of 6 at least: no part of the mask has none.
        return Sprite(np.clip(bgra, 0, 255).astype(np.uint8), mask)


def _vary(rng: np.random.Generator, colour: Bgr, spread: float) -> Bgr:
    """A colour made lighter or darker, and its channels moved a little apart."""
    gain = 1.0 + spread * float(rng.normal())
    b, g, r = (c * gain + 5.0 * spread / 0.1 * float(n) for c, n in zip(colour, rng.normal(size=3), strict=True))
    return max(b, 5.0), max(g, 5.0), max(r, 5.0)


def _corn(rng: np.random.Generator, kind: str, height_m: float) -> _Canvas:
    """A corn plant: leaves to both sides of one plane, each set a little off it, upper ones short and erect."""
    scale = (height_m / 0.42) ** 0.55 * float(rng.uniform(0.88, 1.12)) * (1.22 if kind == "lush_corn" else 1.0)
    green: Bgr = {
        "corn": (52.0, 128.0, 84.0),
        "lush_corn": (46.0, 118.0, 66.0),
        "pale_corn": (72.0, 158.0, 142.0),
        "disease": (58.0, 122.0, 96.0),
    }[kind]
    canvas = _Canvas(0.95 * max(1.0, scale))
    plane = float(rng.uniform(0.0, math.pi))
    leaves = 8
    for i in range(leaves):
        rank = i / (leaves - 1)  # 0 the lowest leaf, 1 the whorl
        bearing = plane + math.pi * (i % 2) + float(rng.normal(scale=0.45))
        length = scale * (0.32 - 0.19 * abs(rank - 0.35) / 0.65) * float(rng.uniform(0.85, 1.1))
        width = scale * (0.056 - 0.02 * rank)
        heights = (height_m * (0.35 + 0.45 * rank), height_m * (0.25 + 0.75 * rank))
        colour = _vary(rng, green, 0.08)
        if kind == "pale_corn" and rng.uniform() < 0.6 - 0.3 * rank:
            colour = _vary(rng, (76.0, 150.0, 160.0), 0.08)
        if kind == "disease" and rng.uniform() < 0.75 - 0.35 * rank:
            # Blighted: from dull yellow-green over straw to dead brown, lowest leaves first.
            ill: Bgr = ((62.0, 132.0, 138.0), (78.0, 138.0, 170.0), (62.0, 98.0, 134.0))[int(rng.integers(3))]
            colour = _vary(rng, ill, 0.10)
        joints = canvas.leaf(bearing, length, width, colour, heights, bend_rad=float(rng.normal(scale=0.35)))
        canvas.rib(joints, 1.18)
        if kind == "disease":
            for joint, (x, y, thickness) in enumerate(joints):
                if rng.uniform() < 0.55:
                    lesion = _vary(rng, ((70.0, 112.0, 150.0), (52.0, 76.0, 104.0))[int(rng.integers(2))], 0.08)
                    axes = (int(rng.integers(2, 7)), max(1, thickness // 3))
                    canvas.spot(x, y, axes, math.degrees(bearing), lesion)
                    canvas.blades[-1].lesions[joint] = lesion
    return canvas


def _weed_broad(rng: np.random.Generator) -> _Canvas:
    """A broad-leaved rosette, 15 to 35 cm across (pigweed, velvetleaf): short, wide, blunt leaves all round."""
    scale = float(rng.uniform(0.7, 1.3))
    canvas = _Canvas(0.5)
    top = 0.16 * scale
    base = _vary(rng, (58.0, 132.0, 88.0), 0.10)
    leaves = int(rng.integers(9, 15))
    for i in range(leaves):
        rank = i / leaves
        bearing = i * 2.4 + float(rng.normal(scale=0.25))
        length = scale * 0.13 * (1.0 - 0.45 * rank) * float(rng.uniform(0.8, 1.15))
        canvas.leaf(
            bearing,
            length,
            length * 0.55,
            _vary(rng, base, 0.07),
            (top * (0.5 + 0.5 * rank), top * (0.4 + 0.6 * rank)),
            start_m=(0.02 * math.cos(bearing), 0.02 * math.sin(bearing)),
            taper=0.3,
            segments=4,
        )
    return canvas


def _weed_grass(rng: np.random.Generator) -> _Canvas:
    """A tuft of grass, 20 to 35 cm across (foxtail): many thin blades from one place."""
    scale = float(rng.uniform(0.75, 1.25))
    canvas = _Canvas(0.55)
    base = _vary(rng, (60.0, 140.0, 104.0), 0.10)
    top = 0.22 * scale
    for _ in range(int(rng.integers(26, 40))):
        bearing = float(rng.uniform(0.0, math.tau))
        start = tuple(float(v) for v in rng.normal(scale=0.03, size=2))
        canvas.leaf(
            bearing,
            scale * float(rng.uniform(0.08, 0.18)),
            0.010,
            _vary(rng, base, 0.09),
            (top * 0.6, top * float(rng.uniform(0.3, 1.0))),
            bend_rad=float(rng.normal(scale=0.5)),
            start_m=(start[0], start[1]),
            segments=4,
        )
    return canvas


def _residue(rng: np.random.Generator, pieces: int) -> _Canvas:
    """Last year's stalks and husks, lying anyhow."""
    canvas = _Canvas(0.62)
    for _ in range(pieces):
        straw: Bgr = ((96.0, 148.0, 178.0), (80.0, 128.0, 160.0), (66.0, 104.0, 136.0), (112.0, 160.0, 184.0))[
            int(rng.integers(4))
        ]
        x, y = (float(v) for v in rng.uniform(-0.2, 0.2, size=2))
        canvas.leaf(
            float(rng.uniform(0.0, math.tau)),
            float(rng.uniform(0.06, 0.26)),
            float(rng.uniform(0.008, 0.022)),
            _vary(rng, straw, 0.10),
            (0.015, 0.015),
            start_m=(x, y),
            taper=0.05,
            segments=3,
        )
    return canvas


def draw(seed: int, kind: str, index: int, plant_height_m: float) -> _Canvas:
    """Sprite number `index` of a kind, at the drawn resolution: a function of its arguments alone."""
    rng = np.random.Generator(np.random.PCG64([seed, sorted(SPRITES_PER_KIND).index(kind), index]))
    if kind == "weed_broad":
        return _weed_broad(rng)
    if kind == "weed_grass":
        return _weed_grass(rng)
    if kind == "residue":
        return _residue(rng, 26)
    if kind == "litter":
        return _residue(rng, 3)
    return _corn(rng, kind, plant_height_m)


def library(seed: int, plant_height_m: float, gsd_m: float) -> dict[str, list[Sprite]]:
    """All sprites of a field at one resolution."""
    return {
        kind: [draw(seed, kind, i, plant_height_m).reduce(gsd_m) for i in range(count)]
        for kind, count in SPRITES_PER_KIND.items()
    }
