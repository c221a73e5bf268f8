"""Solids as they look: the very shape that is collided with, dressed by its label.

A box that is as large as a house and is labelled so has storeys, windows and a roof; a hull's steep roof has tiles.
"""

import math
from pathlib import Path

import numpy as np

from sitl_emu.world.bullet import read_mesh
from sitl_emu.world.description import Solid, WorldError
from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import Colour, Model, face, hull_triangles, lathe, merged, moved, of_triangles
from sitl_emu.world.render.textures import BAYS, STOREYS

BY_WORD: dict[str, tuple[str, float]] = {
    "roof": ("tiles", 4.0),
    "slab": ("concrete", 4.0),
    "concrete": ("concrete", 4.0),
    "parapet": ("concrete", 4.0),
    "beam": ("concrete", 4.0),
    "brick": ("brick", 2.0),
    "wall": ("plaster", 4.0),
    "silo": ("concrete", 4.0),
    "trunk": ("bark", 1.5),
    "log": ("bark", 1.5),
    "fence": ("wood", 2.0),
    "wood": ("wood", 2.0),
    "shed": ("wood", 2.0),
    "crate": ("wood", 1.2),
    "parcel": ("cloth", 1.0),
    "barrel": ("paint", 1.0),
    "tank": ("paint", 3.0),
    "pole": ("concrete", 2.0),
    "car": ("paint", 1.0),
    "debris": ("rock", 2.5),
    "rubble": ("rock", 2.5),
    "rock": ("rock", 2.5),
    "stone": ("rock", 2.5),
}
"""Material, and metres that its texture repeats in, by a word that a solid's label holds; else plaster."""
BAY_M, STOREY_M = 3.2, 3.0
HOUSE_M = (5.0, 2.6)
"""What a building at least measures along its walls, and upwards, to have windows."""
FACADES = ("facade_plaster", "facade_brick", "facade_concrete")
ROOF_UP = 0.35
"""A face whose normal points up by more than this belongs to a roof."""


def mesh_of(solid: Solid, folder: Path, seed: int) -> Model:
    """About the place that the solid is turned about: a box or cylinder's middle, else its own origin.

    Raises WorldError.
    """
    material, repeat_m = _material(solid.label)
    if solid.box is not None:
        north, east, up = solid.box.size_m
        if solid.label == "building" and min(north, east) >= HOUSE_M[0] and up >= HOUSE_M[1]:
            return _house((north, east, up), solid.colour, seed)
        corners = [(i * north / 2, j * east / 2, k * up / 2) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
        return _dressed(np.array(corners), hull_triangles(np.array(corners)), material, solid.colour, repeat_m)
    if solid.cylinder is not None:
        radius, half = solid.cylinder.radius_m, 0.5 * solid.cylinder.height_m
        profile = ((0.0, -half), (radius, -half), (radius, half), (0.0, half))
        return lathe(profile, 32, material, solid.colour, repeat_m)
    if solid.hull is not None:
        points = np.array(solid.hull.points_m) * (1.0, 1.0, -1.0)
        try:
            triangles = hull_triangles(points)
        except ValueError as error:
            raise WorldError(f"solids {solid.name!r}: its hull can't be drawn: {error}") from None
        return _dressed(points, triangles, material, solid.colour, repeat_m)
    assert solid.mesh is not None
    read, numbers = read_mesh(folder / solid.mesh.file, solid.mesh.scale)
    return _dressed(np.array(read), np.array(numbers).reshape(-1, 3), material, solid.colour, repeat_m)


def _material(label: str) -> tuple[int, float]:
    for word, (name, repeat_m) in BY_WORD.items():
        if word in label:
            return NUMBER[name], repeat_m
    return NUMBER["plaster"], 4.0


def _dressed(
    corners: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    triangles: np.ndarray[tuple[int, ...], np.dtype[np.int32]],
    material: int, colour: Colour, repeat_m: float,
) -> Model:  # fmt: skip
    """Any body; of a roof, the upright parts are walls."""
    whole = of_triangles(corners, triangles, material, colour, repeat_m)
    if material == NUMBER["tiles"]:
        upright = -whole.normals[:, 2] < ROOF_UP
        materials = np.where(upright, NUMBER["plaster"], material).astype(np.int32)
        tints = np.where(upright[:, None], np.array((0.80, 0.77, 0.71), np.float32), whole.tints).astype(np.float32)
        return Model(whole.corners, whole.uv, whole.triangles, whole.normals, materials, tints)
    return whole


def _house(size: tuple[float, float, float], colour: Colour, seed: int) -> Model:
    """Walls with whole bays and storeys of windows, shops below in some, and a flat roof."""
    rng = np.random.default_rng((seed, 3))
    north, east, up = (0.5 * side for side in size)
    facade = NUMBER[FACADES[int(rng.integers(len(FACADES)))]]
    has_shop = up > STOREY_M and rng.random() < 0.6
    rim = [(-north, -east), (-north, east), (north, east), (north, -east)]
    ground_m = min(1.15 * STOREY_M, 2.0 * up) if has_shop else 0.0
    # Bitumen and gravel, more or less of the house's own colour
    roof_tint = (0.30 + 0.5 * colour[0], 0.30 + 0.5 * colour[1], 0.30 + 0.5 * colour[2])
    parts = []
    for (n0, e0), (n1, e1) in zip(rim, (*rim[1:], rim[0]), strict=True):
        bays = max(1, round(math.hypot(n1 - n0, e1 - e0) / BAY_M))
        first = int(rng.integers(BAYS)) / BAYS
        u0, u1 = first, first + bays / BAYS
        storeys = max(1, round((2.0 * up - ground_m) / STOREY_M))
        seam = up - ground_m
        top, bottom = int(rng.integers(STOREYS)) / STOREYS, 0.0
        bottom = top + storeys / STOREYS
        parts.append(_wall((n0, e0), (n1, e1), -up, seam, (u0, u1), (top, bottom), facade, colour))
        if has_shop:
            parts.append(_wall((n0, e0), (n1, e1), seam, up, (u0, u1), (0.75, 1.0), NUMBER["shopfront"], colour))
    roof = [(-north, -east, -up), (-north, east, -up), (north, east, -up), (north, -east, -up)]
    uv = [(e / 6.0, n / 6.0) for n, e, _ in roof]
    parts.append(face(roof, uv, NUMBER["roofing"], roof_tint))
    floor = [(n, e, up) for n, e, _ in reversed(roof)]
    parts.append(face(floor, uv, NUMBER["concrete"], (0.5, 0.5, 0.5)))
    return moved(merged(parts), (0.0, 0.0, 0.0))


def _wall(
    a: tuple[float, float], b: tuple[float, float], top: float, bottom: float,
    u: tuple[float, float], v: tuple[float, float], material: int, colour: Colour,
) -> Model:  # fmt: skip
    corners = [(*a, top), (*a, bottom), (*b, bottom), (*b, top)]
    return face(corners, [(u[0], v[0]), (u[0], v[1]), (u[1], v[1]), (u[1], v[0])], material, colour)
