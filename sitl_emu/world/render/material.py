"""Materials: a texture and how it takes light, by name."""

from typing import NamedTuple

import numpy as np

from sitl_emu.world.render import maps
from sitl_emu.world.render.maps import Materials
from sitl_emu.world.render.textures import LAYER


class Material(NamedTuple):
    """One row."""

    kind: int
    texture: str
    gloss: float = 0.0


ROWS: dict[str, Material] = {
    "ground": Material(maps.GROUND, "noise"),
    "water": Material(maps.WATER, "noise"),
    "plaster": Material(maps.TEXTURED, "plaster"),
    "concrete": Material(maps.TEXTURED, "concrete"),
    "brick": Material(maps.TEXTURED, "brick"),
    "facade_plaster": Material(maps.TEXTURED, "facade_plaster", 0.9),
    "facade_brick": Material(maps.TEXTURED, "facade_brick", 0.9),
    "facade_concrete": Material(maps.TEXTURED, "facade_concrete", 0.9),
    "shopfront": Material(maps.TEXTURED, "shopfront", 0.7),
    "tiles": Material(maps.TEXTURED, "tiles"),
    "roofing": Material(maps.TEXTURED, "roofing"),
    "rock": Material(maps.TEXTURED, "rock"),
    "wood": Material(maps.TEXTURED, "wood"),
    "paint": Material(maps.TEXTURED, "paint", 1.0),
    "glass": Material(maps.TEXTURED, "glass", 1.0),
    "cloth": Material(maps.TEXTURED, "cloth"),
    "leaves": Material(maps.LEAF, "leaves"),
    "blade": Material(maps.LEAF, "cloth"),
    "weeds": Material(maps.TEXTURED, "weeds"),
    "bark": Material(maps.TEXTURED, "bark"),
    "stop_sign": Material(maps.TEXTURED, "stop_sign"),
}
NUMBER = {name: number for number, name in enumerate(ROWS)}


def table() -> Materials:
    """As the shading reads them."""
    rows = ROWS.values()
    return Materials(
        np.array([row.kind for row in rows], np.int32),
        np.array([LAYER[row.texture] for row in rows], np.int32),
        np.array([row.gloss for row in rows], np.float32),
    )
