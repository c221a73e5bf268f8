"""Cover as cameras see it: trees of a canopy, rows of a crop, tufts of grass; a few kinds of each, turned.

Where plants stand is ours; as much of the ground is hidden from above as the cover's density says, about.
"""

import math

import numpy as np
import numpy.typing as npt

from sitl_emu.world import polygons
from sitl_emu.world.description import Cover
from sitl_emu.world.ground import Terrain
from sitl_emu.world.rays import heights
from sitl_emu.world.render import furniture
from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import WHITE, Model, of_triangles, turned
from sitl_emu.world.render.stage import Stage

KINDS_OF_TREE = 6
FEW = 60
"""Trees that have half as many kinds: making one takes 40 ms of a camera's first frame."""
PATCH_M = 2.0
"""Side of a square of crop or grass."""
ROW_M = 0.5
MOST_PLANTS = 9000
"""Of one cover; larger ones have larger plants or patches further apart."""


def add(stage: Stage, cover: Cover, terrain: Terrain, seed: int) -> None:
    """Plant one cover. Its leaves are one object."""
    number = stage.add_object(cover.name, cover.label or cover.kind)
    rng = np.random.default_rng((seed, 31))
    if cover.kind == "canopy":
        crown = max(0.26 * cover.height_m, 0.4)
        gap = crown * 1.7 / math.sqrt(max(cover.density, 0.05))
        places = _spread(cover, gap, 0.42, rng)
        kinds = KINDS_OF_TREE if len(places) > FEW else KINDS_OF_TREE // 2
        meshes = [_tree(stage, cover, crown, seed + kind) for kind in range(kinds)]
    else:
        places = _spread(cover, PATCH_M, 0.0, rng)
        meshes = [_patch(stage, cover, seed + kind) for kind in range(4)]
    ground = heights(terrain, places[:, 0], places[:, 1])
    for (north, east), height in zip(places, ground, strict=True):
        if cover.kind == "crop":
            heading = math.pi * float(rng.integers(2))
        else:
            heading = float(rng.uniform(0, 2 * math.pi))
        size = float(rng.uniform(0.8, 1.0))
        shade = rng.uniform(0.85, 1.12) * np.array((rng.uniform(0.94, 1.1), 1.0, rng.uniform(0.9, 1.05)))
        tint = (float(shade[0]), float(shade[1]), float(shade[2]))
        turn = turned(heading) * (size if cover.kind == "canopy" else 1.0)
        stage.place(meshes[int(rng.integers(len(meshes)))], number, (north, east, -height), turn, tint=tint)


def _spread(cover: Cover, gap: float, jitter: float, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """(n, 2) places within the polygon: a grid whose rows are shifted, each place moved by up to `jitter` gaps."""
    corners = np.array(cover.polygon_m)
    (south, west), (north, east) = corners.min(axis=0), corners.max(axis=0)
    gap = max(gap, math.sqrt((north - south) * (east - west) / MOST_PLANTS))
    rows, columns = np.arange(south + 0.5 * gap, north, gap), np.arange(west + 0.5 * gap, east, gap)
    n, e = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
    if jitter:
        n, e = n + rng.uniform(-jitter, jitter, len(n)) * gap, e + rng.uniform(-jitter, jitter, len(e)) * gap
    kept = polygons.inside(cover.polygon_m, n, e)
    return np.stack((n[kept], e[kept]), axis=1)


def _tree(stage: Stage, cover: Cover, crown: float, seed: int) -> tuple[int, int]:
    is_conifer = seed % 3 == 0
    low = cover.base_m if cover.base_m > 0.0 else 0.12 * cover.height_m

    def of(tufts: int) -> Model:
        return furniture.tree(cover.height_m, crown, seed, tufts, is_conifer, low)

    return stage.add_model(of(210), (of(80), 0.010 * crown), (of(34), 0.026 * crown), (of(14), 0.065 * crown))


def _patch(stage: Stage, cover: Cover, seed: int) -> tuple[int, int]:
    def of(share: float) -> Model:
        return _leaves(cover, seed, share)

    return stage.add_model(of(1.0), (of(0.45), 0.012), (of(0.18), 0.03), (of(0.06), 0.065))


def _leaves(cover: Cover, seed: int, share: float) -> Model:
    """A square of leaves: in rows for a crop, anywhere for grass; fewer and broader ones for a coarser level."""
    rng = np.random.default_rng((seed, 32))
    is_crop = cover.kind == "crop"
    count = int((130 if is_crop else 320) * (0.3 + 0.7 * cover.density) * share)
    broad = math.sqrt(1.0 / share) * (0.05 + 0.03 * cover.height_m if is_crop else 0.006 + 0.010 * cover.height_m)
    east = rng.uniform(-0.5, 0.5, count) * PATCH_M
    if is_crop:
        east = (np.round(east / ROW_M - 0.5) + 0.5) * ROW_M + rng.normal(scale=0.05, size=count)
    foot = np.stack((rng.uniform(-0.5, 0.5, count) * PATCH_M, east, np.zeros(count)), axis=1)
    angle = rng.uniform(0, 2 * math.pi, count)
    out = np.stack((np.cos(angle), np.sin(angle), np.zeros(count)), axis=1)
    side = np.stack((-np.sin(angle), np.cos(angle), np.zeros(count)), axis=1)
    high = cover.height_m * rng.uniform(0.55, 1.0, count)
    middle = foot + out * (0.18 * high)[:, None] - np.outer(high, (0, 0, 0.75))
    tip = (
        foot
        + out * (rng.uniform(0.35, 0.7, count) * high)[:, None]
        - np.outer(high * rng.uniform(0.7, 1.0, count), (0, 0, 1))
    )
    half = (broad * rng.uniform(0.6, 1.3, count))[:, None] * side
    corners = np.stack((foot, middle - half, middle + half, middle - half, tip, middle + half), axis=1).reshape(-1, 3)
    model = of_triangles(corners, np.arange(len(corners)), NUMBER["leaves" if is_crop else "blade"], WHITE, 1.3)
    bright = np.repeat(rng.uniform(0.7, 1.15, count), 2)[:, None] * np.array((1.0, 1.0, 1.0))
    tints = (np.array(cover.colour) * 1.25 * bright).astype(np.float32)
    lit = np.repeat(out * 0.5 + np.array((0.0, 0.0, -0.86)), 2, axis=0).astype(np.float32)
    if len(model.triangles) != len(tints):
        tints, lit = tints[: len(model.triangles)], lit[: len(model.triangles)]
    return Model(model.corners, model.uv, model.triangles, lit, model.materials, tints)
