"""The plants of a field as triangles: the leaves of the very sprites that the painter stamps, standing up.

So the plants before a rover and those that a UAS sees painted from 15 m are the same, and so is the shade they throw on
the painted ground. A leaf rises from its stalk, arches and hangs; near by it is folded along its midrib.
Mesh axes are NED; colours are the painter's (BGR, 0 to 255), with the light of the field's sun worked in, as neither
moves: once for the side of a leaf that the sun shines on, once for the other, through which it shines.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.description import Light
from sitl_emu.world.kinds.corn_field.sprites import SPRITES_PER_KIND, Bgr, Blade, draw
from sitl_emu.world.render.raster import Meshes

F64 = npt.NDArray[np.float64]

LEVELS = 3
"""Of detail, the finest first."""
ERRORS_M = (0.0, 0.0045, 0.0135)
"""How far a level is taken to lie from the finest: with `standing.ERROR_PX`, they change at some 4 and 12 m."""
SEGMENTS = (7, 3, 2)
ARCH = 0.10
"""How far a leaf's middle rises over the line between its ends, of its length: by eye, as all figures here."""
FOLD = 0.28
"""How far a blade's edges stand above its midrib, of half its width."""
STALK_M = 0.011
"""Radius of a stalk at the ground."""
STALK_BGR: Bgr = (60.0, 118.0, 92.0)
STALKED = ("corn", "pale_corn", "lush_corn", "disease")
SUNNY, SHADY = (0.76, 0.66), (0.62, 0.55)
"""Light on a leaf's sunny side, and through it: from the sky, and from the sun by how steeply it falls in."""
GROUND_LIGHT = 0.74
"""Of the light above the crop what is left at its foot."""
THROUGH = (0.86, 1.06, 1.02)
"""Blue, green, red of what shines through a leaf."""


class PlantMeshes(NamedTuple):
    """Meshes of all sprites of a field."""

    meshes: Meshes
    first_level: npt.NDArray[np.int32]
    """Of each sprite, in the order of SPRITES_PER_KIND."""
    radius_m: F64
    lit: npt.NDArray[np.float32]
    """(t, 2, 3): colour of a triangle on its sunny side and on the other."""


class _Part(NamedTuple):
    """Some triangles, three corners of their own each."""

    corners: F64
    """(n, 3, 3)"""
    colours: F64
    """(n, 3), without light."""


def build(seed: int, plant_height_m: float, tint: F64, light: Light) -> PlantMeshes:
    """All plants of a field; `tint`: factors of the light on blue, green and red."""
    corners, colours, levels, firsts, radii = [], [], list[tuple[int, int, int, int]](), list[int](), list[float]()
    count = 0
    for kind, number in SPRITES_PER_KIND.items():
        for index in range(number):
            blades = draw(seed, kind, index, plant_height_m).blades
            firsts.append(len(levels))
            for level in range(LEVELS):
                part = _plant(kind, blades, plant_height_m, level)
                corners.append(part.corners.reshape(-1, 3))
                colours.append(part.colours)
                triangles = len(part.colours)
                levels.append((3 * count, 3 * (count + triangles), count, count + triangles))
                count += triangles
            radii.append(max(float(np.linalg.norm(each, axis=1).max()) for each in corners[-LEVELS:]))
    spots = np.concatenate(corners)
    return _packed(spots, np.concatenate(colours) * tint, levels, firsts, radii, plant_height_m, light)


def _packed(
    corners: F64,
    colours: F64,
    levels: Sequence[tuple[int, int, int, int]],
    firsts: Sequence[int],
    radii: Sequence[float],
    plant_height_m: float,
    light: Light,
) -> PlantMeshes:
    count = len(colours)
    a, b, c = (corners.reshape(-1, 3, 3)[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    normals[normals[:, 2] > 0.0] *= -1.0
    numbers = np.concatenate([np.tile(np.arange(3 * (last - first)), 1) for _, _, first, last in levels])
    meshes = Meshes(
        corners.astype(np.float32),
        np.zeros((3 * count, 2), np.float32),
        numbers.reshape(-1, 3).astype(np.int32),
        normals.astype(np.float32),
        np.ones(count, np.int32),
        np.ones((count, 3), np.float32),
        np.array(levels, np.int32),
        np.tile(np.array(ERRORS_M, np.float32), len(firsts)),
    )
    heights = -corners.reshape(-1, 3, 3)[:, :, 2].mean(axis=1)
    return PlantMeshes(
        meshes, np.array(firsts, np.int32), np.array(radii), _lit(normals, heights / plant_height_m, colours, light)
    )


def _lit(normals: F64, height: F64, colours: F64, light: Light) -> npt.NDArray[np.float32]:
    azimuth, elevation = math.radians(light.azimuth_deg), math.radians(light.elevation_deg)
    to_sun = np.array(
        (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), -math.sin(elevation))
    )
    steep = np.abs(normals @ to_sun)
    open_ = GROUND_LIGHT + (1.0 - GROUND_LIGHT) * np.clip(height, 0.0, 1.0)
    sunny = (SUNNY[0] + SUNNY[1] * steep) * open_
    shady = (SHADY[0] + SHADY[1] * steep) * open_
    faces = np.stack((colours * sunny[:, None], colours * shady[:, None] * np.array(THROUGH)), axis=1)
    # The side that the normal shows comes first; where the sun is behind it, that is the shady one.
    faces[normals @ to_sun < 0.0] = faces[normals @ to_sun < 0.0][:, ::-1]
    return np.asarray(np.clip(faces, 0.0, 255.0), np.float32)


def _plant(kind: str, blades: Sequence[Blade], height_m: float, level: int) -> _Part:
    parts = [_leaf(blade, kind, level) for blade in _kept(kind, blades, level)]
    if kind in STALKED:
        parts.append(_stalk(0.82 * height_m, level))
    return _Part(np.concatenate([part.corners for part in parts]), np.concatenate([part.colours for part in parts]))


def _kept(kind: str, blades: Sequence[Blade], level: int) -> list[Blade]:
    """Far away half of a tuft's many blades do, each twice as wide."""
    if level < LEVELS - 1 or kind not in ("weed_grass", "residue"):
        return list(blades)
    return [blade._replace(width_m=2.0 * blade.width_m) for blade in blades[::2]]


def _leaf(blade: Blade, kind: str, level: int) -> _Part:
    """A blade along its bent midrib; `_Canvas.leaf` draws the same from above."""
    segments = min(SEGMENTS[level], blade.segments)
    t = np.linspace(0.0, 1.0, segments + 1)
    middle = (t[:-1] + t[1:]) / 2.0
    heading = blade.bearing_rad + blade.bend_rad * middle
    step = blade.length_m / segments
    east = blade.start_m[0] + np.concatenate(([0.0], np.cumsum(step * np.cos(heading))))
    north = blade.start_m[1] + np.concatenate(([0.0], np.cumsum(step * np.sin(heading))))
    low, high = blade.heights_m
    lies = kind in ("residue", "litter")
    up = low + (high - low) * t + (0.0 if lies else ARCH * blade.length_m * 4.0) * t * (1.0 - t)
    along = np.clip(t, 0.06, 0.99)
    width = blade.width_m * np.minimum(1.0, np.sqrt(along / 0.25)) * np.maximum(0.08, 1.0 - along**2.2) ** blade.taper
    turn = blade.bearing_rad + blade.bend_rad * t
    rib = np.stack((north, east, -np.maximum(up, 0.004)), axis=1)
    half = 0.5 * width[:, None] * np.stack((np.cos(turn), -np.sin(turn), np.zeros_like(t)), axis=1)
    lift = np.zeros((len(t), 3))
    if level == 0 and not lies:
        lift[:, 2] = -FOLD * 0.5 * width
    left, right = rib - half + lift, rib + half + lift
    if level == 0 and kind != "weed_grass":
        quads = [_quads(left, rib), _quads(rib, right)]
    else:
        quads = [_quads(left, right)]
    colours = _colours(blade, middle, low + (high - low) * middle, segments)
    return _Part(np.concatenate(quads), np.concatenate([np.repeat(colours, 2, axis=0)] * len(quads)))


def _quads(one: F64, other: F64) -> F64:
    """Two triangles between each two joints of two lines."""
    pairs = np.stack(
        (np.stack((one[:-1], one[1:], other[:-1]), axis=1), np.stack((other[:-1], one[1:], other[1:]), axis=1)), axis=1
    )
    return np.asarray(pairs.reshape(-1, 3, 3))


def _colours(blade: Blade, along: F64, heights_m: F64, segments: int) -> F64:
    """Of each segment, as the sprite has it: higher leaf is a little lighter, its tip darker."""
    light = 0.82 + 0.3 * heights_m / max(*blade.heights_m, 0.05) - 0.10 * along
    colours = np.array(blade.colour)[None, :] * light[:, None]
    for joint, colour in blade.lesions.items():
        at = joint * segments // blade.segments
        colours[at] += (np.array(colour) - colours[at]) * (0.75 if segments == blade.segments else 0.4)
    return colours


def _stalk(height_m: float, level: int) -> _Part:
    """Three sides, thinner to the top."""
    sides = 3 if level < LEVELS - 1 else 2
    turns = np.arange(sides + 1) * (2.0 * math.pi / 3.0)
    ring = np.stack((np.cos(turns), np.sin(turns), np.zeros_like(turns)), axis=1) * STALK_M
    top = 0.5 * ring + np.array((0.0, 0.0, -height_m))
    corners = _quads(ring, top)
    return _Part(corners, np.tile(np.array(STALK_BGR), (len(corners), 1)))
