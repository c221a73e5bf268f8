"""What surfaces look like close by: square textures that repeat, drawn from a seed.

Red, green, blue, and in the fourth channel how much of a tint a texel takes (255: all of it; 0: glass, mortar, print).
Textures of the ground hold factors instead of colours, 128 for 1: the ground map (`ground_map.py`) has the colours.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.kernel import F32, U8
from sitl_emu.world.render.maps import LEVELS, SIDE, Textures

Rng = np.random.Generator
BAYS, STOREYS = 4, 4
"""Windows along each side of a facade's texture."""


def cloudy(rng: Rng, first: int, octaves: int, side: int = SIDE, gain: float = 0.5) -> F32:
    """Noise that repeats, mean 0 and standard deviation 1; its broadest waves are a `first`th of the side."""
    cells = min(first, side)
    total = rng.normal(size=(cells, cells)).astype(np.float32)
    weight = 1.0
    for octave in range(1, octaves):
        cells, weight = min(first << octave, side), weight * gain
        total = _finer(total, cells) + np.float32(weight) * rng.normal(size=(cells, cells)).astype(np.float32)
    total = _finer(total, side)
    total -= total.mean()
    return np.asarray(total / total.std(), np.float32)


def _finer(wrapped: F32, side: int) -> F32:
    """The same that repeats, with more texels to a side."""
    cells = len(wrapped)
    if cells == side:
        return wrapped
    # Three cells over on each side, for the cubic's reach, then cut back
    scale, edge = side / cells, round(3 * side / cells)
    padded = cv2.resize(np.pad(wrapped, 3, mode="wrap"), None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    return np.asarray(padded[edge : edge + side, edge : edge + side], np.float32)


def _with_tint(colour: npt.NDArray[np.floating], tint: npt.NDArray[np.floating] | float = 1.0) -> U8:
    """(side, side, 3) or (side, side), 0 to 1, and the tint's share."""
    full = np.empty((*colour.shape[:2], 4), np.uint8)
    bytes_ = _bytes(colour)
    full[..., :3] = bytes_[..., None] if colour.ndim == 2 else bytes_
    full[..., 3] = _bytes(np.asarray(tint))
    return full


def _bytes(shares: npt.NDArray[np.floating]) -> U8:
    """From 0 to 1."""
    return np.clip(np.round(shares * np.float32(255.0)), 0, 255).astype(np.uint8)


def _factors(relief: F32, strength: float, colour: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> U8:
    """A ground's texture: brighter and darker about 1, with a cast towards a colour where it is bright."""
    # Nothing broad: that would be seen to repeat from high above
    wrapped = np.pad(relief, 48, mode="wrap")
    relief = relief - cv2.GaussianBlur(wrapped, (0, 0), 14.0)[48:-48, 48:-48]
    bright = np.float32(strength) * np.clip(relief, -2.5, 2.5)[..., None]
    cast = 1.0 + bright * np.array(colour, np.float32)
    cast /= cast.mean(axis=(0, 1))
    return _with_tint(cast * np.float32(128.0 / 255.0))


def noise(rng: Rng) -> U8:
    """Four independent, even fields of noise."""
    return np.stack([np.clip(128 + 52 * cloudy(rng, 4, 7), 0, 255).astype(np.uint8) for _ in range(4)], axis=2)


def clouds(rng: Rng) -> U8:
    """Soft heaps."""
    return _with_tint(np.clip(0.5 + 0.2 * cloudy(rng, 3, 8, gain=0.55), 0, 1))


def grass(rng: Rng) -> U8:
    """Blades that lie all ways, in tufts."""
    canvas = np.full((SIDE, SIDE), 0.0, np.float32)
    figures = rng.uniform((0, 0, 0, 7), (SIDE, SIDE, 2 * math.pi, 22), (5200, 4)).tolist()
    for (x, y, angle, length), value in zip(figures, rng.normal(0.1, 0.9, len(figures)).tolist(), strict=True):
        end = (x + length * math.cos(angle), y + length * math.sin(angle))
        for shift_x in (-SIDE, 0, SIDE) if not 24 < x < SIDE - 24 else (0,):
            for shift_y in (-SIDE, 0, SIDE) if not 24 < y < SIDE - 24 else (0,):
                start = (round(x + shift_x), round(y + shift_y))
                cv2.line(canvas, start, (round(end[0] + shift_x), round(end[1] + shift_y)), value, 1)
    canvas += 0.6 * cloudy(rng, 12, 3)
    return _factors(canvas, 0.15, (1.0, 1.03, 0.85))


def soil(rng: Rng) -> U8:
    """Clods and crumbs."""
    clods = cloudy(rng, 24, 5)
    lit = clods - np.roll(clods, (3, 3), axis=(0, 1))
    return _factors(0.5 * clods + 1.4 * lit, 0.12)


def asphalt(rng: Rng) -> U8:
    """Grain, a few lighter stones, cracks."""
    grain = cloudy(rng, 128, 3) + 0.4 * cloudy(rng, 6, 3)
    stones = (rng.random((SIDE, SIDE)) < 0.02).astype(np.float32)
    return _factors(grain + 1.5 * cv2.GaussianBlur(stones, (3, 3), 0.8), 0.085)


def gravel(rng: Rng) -> U8:
    """Stones, each with its shade and its shadow."""
    count, scale = 2600, 1
    points = rng.uniform(0, SIDE, (count, 2))
    tiled = np.concatenate([points + np.array((dx, dy)) for dx in (-SIDE, 0, SIDE) for dy in (-SIDE, 0, SIDE)])
    near = (np.abs(tiled - SIDE / 2) < SIDE / 2 + 40).all(axis=1)
    seeds = np.full((SIDE + 80, SIDE + 80), 255, np.uint8)
    for x, y in tiled[near]:
        cv2.circle(seeds, (round(x) + 40, round(y) + 40), scale, 0, -1)
    far, labels = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP)
    far, labels = far[40:-40, 40:-40], labels[40:-40, 40:-40]
    # A stone and its copies across the border share their shade by their place
    shades = rng.normal(size=4096)[np.arange(int(labels.max()) + 1) % 4096]
    inside = np.clip((5.5 - far) / 5.5, 0, 1)
    lit = np.roll(inside, (-2, -2), axis=(0, 1)) - np.roll(inside, (2, 2), axis=(0, 1))
    return _factors((1.1 * shades[labels] + 2.0 * inside - 1.6 * lit).astype(np.float32), 0.16)


def paving(rng: Rng) -> U8:
    """Slabs with joints, each of its own grey."""
    slabs = 6
    step = SIDE / slabs
    shades = cv2.resize(
        rng.normal(size=(slabs, slabs)).astype(np.float32), (SIDE, SIDE), interpolation=cv2.INTER_NEAREST
    )
    place = np.arange(SIDE) % step
    joint = ((place < 4) | (place > step - 2)).astype(np.float32)
    joints = np.maximum(joint[:, None], joint[None, :])
    return _factors(0.5 * shades - 2.3 * cv2.GaussianBlur(joints, (5, 5), 1.0) + 0.5 * cloudy(rng, 32, 4), 0.08)


def litter(rng: Rng) -> U8:
    """A forest's floor: leaves and twigs."""
    canvas = np.zeros((SIDE, SIDE), np.float32)
    for _ in range(2600):
        x, y, angle = rng.uniform(14, SIDE - 14), rng.uniform(14, SIDE - 14), rng.uniform(0, 180)
        axes = (int(rng.integers(2, 9)), int(rng.integers(1, 4)))
        cv2.ellipse(canvas, (round(x), round(y)), axes, angle, 0, 360, float(rng.normal()), -1)
    return _factors(canvas + 0.5 * cloudy(rng, 16, 5), 0.2, (1.0, 0.9, 0.7))


def ashes(rng: Rng) -> U8:
    """Charred ground: flakes of white ash on black."""
    flakes = np.clip(cloudy(rng, 40, 4) - 1.1, 0, 2)
    return _factors(0.6 * cloudy(rng, 12, 6) + 1.3 * flakes, 0.2, (0.95, 1.0, 1.05))


def plaster(rng: Rng) -> U8:
    """A rendered wall, with stains that run down."""
    grain = cloudy(rng, 64, 3)
    runs = cv2.blur(cloudy(rng, 32, 4), (1, 161))
    return _with_tint(0.93 + 0.018 * grain + 0.05 * runs)


def concrete(rng: Rng) -> U8:
    """Cast in panels, blotched."""
    field = 0.86 + 0.035 * cloudy(rng, 4, 6) + 0.02 * cloudy(rng, 96, 2)
    for line in range(0, SIDE, SIDE // 4):
        field[line : line + 2] -= 0.09
        field[:, line : line + 2] -= 0.06
    return _with_tint(field)


def brick(rng: Rng, rows: int = 28, per_row: int = 8) -> U8:
    """Courses of bricks; the mortar takes no tint."""
    field, tint = np.full((SIDE, SIDE), 0.62, np.float32), np.full((SIDE, SIDE), 0.25, np.float32)
    high, wide = SIDE / rows, SIDE / per_row
    shades = 0.85 + 0.09 * np.random.default_rng(rows).normal(size=(rows, per_row))
    for row in range(rows):
        for k in range(-1, per_row + 1):
            left = (k + 0.5 * (row % 2)) * wide
            joint = 2 if rows < 64 else 1
            y = slice(round(row * high) + joint, round((row + 1) * high))
            x = slice(max(round(left) + joint, 0), max(min(round(left + wide), SIDE), 0))
            field[y, x], tint[y, x] = shades[row, k % per_row], 1.0
    return _with_tint(field + 0.03 * cloudy(rng, 96, 3), tint)


def _facade(rng: Rng, wall: Callable[[Rng], U8], wide: float, high: float, frame: float) -> U8:
    """Windows in a wall, each with its own curtains; `wide` and `high` are their shares of a bay and a storey."""
    picture = wall(rng).astype(np.float32) / 255.0
    picture[..., :3] = picture[..., :3] * 0.5 + 0.5 * picture[..., :3].mean()
    bay, storey = SIDE // BAYS, SIDE // STOREYS
    for row in range(STOREYS):
        for column in range(BAYS):
            half_w, half_h = int(bay * wide / 2), int(storey * high / 2)
            cx, cy = column * bay + bay // 2, row * storey + int(storey * 0.52)
            y, x = slice(cy - half_h, cy + half_h), slice(cx - half_w, cx + half_w)
            # Reveal: dark above and left, where the wall's edge shades it; a light sill below
            picture[cy - half_h - 3 : cy + half_h + 1, cx - half_w - 3 : cx + half_w + 3, :3] *= 0.62
            picture[cy + half_h + 1 : cy + half_h + 7, cx - half_w - 7 : cx + half_w + 7] = (0.80, 0.79, 0.77, 0.3)
            picture[cy + half_h + 7 : cy + half_h + 11, cx - half_w - 6 : cx + half_w + 6, :3] *= 0.8
            picture[y, x] = (frame, frame, frame * 0.98, 0.45)
            depth = np.linspace(0.10, 0.24, 2 * half_h, dtype=np.float32)[:, None, None] + rng.uniform(-0.03, 0.08)
            for pane in (0, 1):
                left = cx - half_w + 5 + pane * (half_w - 2)
                glass = (slice(cy - half_h + 5, cy + half_h - 5), slice(left, left + half_w - 8))
                shape = picture[glass].shape
                picture[glass][..., :3] = depth[5:-5] * np.array((0.85, 1.0, 1.15), np.float32)
                picture[glass][..., 3] = 0.0
                style = rng.random()
                if style < 0.3:  # curtains
                    folds = 0.66 + 0.1 * np.sin(np.arange(shape[1]) * rng.uniform(0.5, 0.9))
                    picture[glass][..., :3] = 0.45 * picture[glass][..., :3] + 0.5 * folds[None, :, None]
                    picture[glass][..., 3] = 0.12
                elif style < 0.5:  # a blind, half down
                    drop = int(shape[0] * rng.uniform(0.2, 0.8))
                    slats = 0.62 + 0.12 * (np.arange(drop) % 5 < 3)
                    picture[glass][:drop, :, :3] = slats[:, None, None]
                    picture[glass][:drop, :, 3] = 0.1
    return np.clip(np.round(picture * 255.0), 0, 255).astype(np.uint8)


def facade_plaster(rng: Rng) -> U8:
    """A rendered house of flats."""
    return _facade(rng, plaster, 0.42, 0.56, 0.86)


def facade_brick(rng: Rng) -> U8:
    """A brick house with tall windows."""
    return _facade(rng, lambda own: brick(own, 128, 48), 0.38, 0.62, 0.84)


def facade_concrete(rng: Rng) -> U8:
    """Offices with wide windows."""
    return _facade(rng, concrete, 0.72, 0.52, 0.35)


def shopfront(rng: Rng) -> U8:
    """A ground floor: doors and shop windows; only its lowest quarter is used."""
    picture = plaster(rng).astype(np.float32) / 255.0
    picture[..., :3] *= 0.9
    bay = SIDE // BAYS
    top = SIDE - SIDE // STOREYS
    for column in range(BAYS):
        left = column * bay
        if column == 1:
            picture[top + 30 : SIDE, left + 38 : left + 90] = (0.30, 0.20, 0.13, 0.3)
            picture[top + 36 : top + 62, left + 44 : left + 84] = (0.16, 0.19, 0.22, 0.0)
            picture[SIDE - 6 : SIDE, left + 34 : left + 94] = (0.6, 0.59, 0.57, 0.0)
        else:
            picture[top + 24 : SIDE - 20, left + 12 : left + 116] = (0.25, 0.25, 0.26, 0.2)
            for pane in range(2):
                x = left + 16 + pane * 50
                picture[top + 28 : SIDE - 24, x : x + 46] = (0.13, 0.16, 0.19, 0.0)
                picture[SIDE - 62 : SIDE - 24, x + 6 : x + 40, :3] = rng.uniform(0.15, 0.45, 3)
        hue = rng.uniform(0.25, 0.7, 3)
        picture[top + 8 : top + 22, left + 10 : left + 118, :3] = hue
        picture[top + 8 : top + 22, left + 10 : left + 118, 3] = 0.2
    picture[SIDE - 10 :, :, :3] *= 0.75
    return np.clip(np.round(picture * 255.0), 0, 255).astype(np.uint8)


def tiles(rng: Rng) -> U8:
    """A tiled roof: rows that overlap, tiles of slightly different firing, moss in places."""
    rows, per_row = 24, 24
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(np.float32) / SIDE
    row = np.floor(y * rows)
    along = x * per_row + 0.5 * (row % 2)
    shades = rng.normal(size=(rows, per_row)).astype(np.float32)[row.astype(int), np.floor(along).astype(int) % per_row]
    down = y * rows - row
    across = along - np.floor(along)
    field = 0.82 + 0.06 * shades + 0.10 * np.sin(np.pi * across) - 0.30 * (down > 0.86) + 0.05 * down
    field += 0.02 * cloudy(rng, 12, 4)
    moss = 0.5 * np.clip(cloudy(rng, 9, 5) - 1.6, 0, 1)
    colour = np.repeat(field[..., None], 3, axis=2)
    colour = colour * (1 - moss[..., None]) + moss[..., None] * np.array((0.36, 0.38, 0.25), np.float32)
    return _with_tint(colour, 1 - 0.8 * moss)


def roofing(rng: Rng) -> U8:
    """A flat roof: bitumen sheets with seams, puddle marks, grit."""
    field = 0.80 + 0.05 * cloudy(rng, 3, 6) + 0.03 * cloudy(rng, 128, 2)
    for line in range(0, SIDE, SIDE // 5):
        field[:, line : line + 3] -= 0.12
    rings = np.abs(cloudy(rng, 4, 3))
    field -= 0.06 * (rings < 0.08)
    return _with_tint(field)


def rock(rng: Rng) -> U8:
    """Broken concrete and stone: coarse, with darker seams."""
    coarse = cloudy(rng, 6, 7, gain=0.6)
    seams = np.exp(-((cloudy(rng, 5, 4) / 0.12) ** 2))
    return _with_tint(0.80 + 0.075 * coarse - 0.16 * seams)


def wood(rng: Rng) -> U8:
    """Boards along v."""
    grain = cv2.blur(cloudy(rng, 64, 3), (1, 121)) * 2.0
    field = 0.82 + 0.05 * grain + 0.02 * cloudy(rng, 64, 2)
    field[:, :: SIDE // 8] -= 0.3
    field[:, 1 :: SIDE // 8] -= 0.2
    return _with_tint(field)


def paint(rng: Rng) -> U8:
    """Smooth and slightly dusty; a quarter of it mirrors."""
    return _with_tint(0.96 + 0.012 * cloudy(rng, 6, 5), 0.78)


def glass(rng: Rng) -> U8:
    """Dark, and a mirror."""
    return _with_tint(np.full((SIDE, SIDE, 3), (0.10, 0.12, 0.14)) + 0.004 * cloudy(rng, 4, 2)[..., None], 0.0)


def cloth(rng: Rng) -> U8:
    """Anything dull: cloth, skin, rubber."""
    return _with_tint(0.94 + 0.04 * cloudy(rng, 12, 5))


def leaves(rng: Rng) -> U8:
    """A crown's outside: leaf upon leaf, dark between."""
    canvas = np.full((SIDE, SIDE), 0.42, np.float32)
    for layer in range(3):
        for _ in range(1500):
            x, y = rng.uniform(0, SIDE, 2)
            axes, angle = (int(rng.integers(7, 15)), int(rng.integers(3, 7))), rng.uniform(0, 180)
            value = 0.55 + 0.16 * layer + float(rng.normal(0, 0.08))
            cv2.ellipse(canvas, (round(x), round(y)), axes, angle, 0, 360, value, -1)
    colour = np.clip(canvas, 0.3, 1.0)[..., None] * np.array((1.0, 1.0, 0.95), np.float32)
    return _with_tint(colour)


def weeds(rng: Rng) -> U8:
    """Broad leaves over the ground."""
    canvas = np.full((SIDE, SIDE), 0.5, np.float32)
    for _ in range(420):
        x, y = rng.uniform(0, SIDE, 2)
        turn = rng.uniform(0, 360)
        for leaf in range(5):
            angle = turn + 72 * leaf
            end = (x + 16 * np.cos(np.radians(angle)), y + 16 * np.sin(np.radians(angle)))
            value = float(rng.normal(0.92, 0.08))
            cv2.ellipse(canvas, (round(end[0]), round(end[1])), (15, 5), angle, 0, 360, value, -1)
    return _with_tint(np.clip(canvas, 0.4, 1.0))


def bark(rng: Rng) -> U8:
    """Ridges along v."""
    return _with_tint(0.75 + 0.12 * cv2.blur(cloudy(rng, 48, 3), (1, 41)) + 0.06 * cloudy(rng, 48, 3))


def stop_sign(_rng: Rng) -> U8:
    """White letters and rim on red."""
    face = np.zeros((SIDE, SIDE, 4), np.uint8)
    face[:] = (176, 24, 30, 0)
    corners = np.array(
        [(256 + 255 * np.cos(a), 256 + 255 * np.sin(a)) for a in np.radians(np.arange(22.5, 360, 45))], np.int32
    )
    cv2.polylines(face, [corners], True, (235, 235, 235, 0), 22, cv2.LINE_AA)
    cv2.putText(face, "STOP", (52, 316), cv2.FONT_HERSHEY_DUPLEX, 5.1, (235, 235, 235, 0), 24, cv2.LINE_AA)
    return face


DRAWN: dict[str, Callable[[Rng], U8]] = {
    "noise": noise, "clouds": clouds,
    "grass": grass, "soil": soil, "asphalt": asphalt, "gravel": gravel, "paving": paving, "litter": litter,
    "ashes": ashes,
    "plaster": plaster, "concrete": concrete, "brick": brick, "facade_plaster": facade_plaster,
    "facade_brick": facade_brick, "facade_concrete": facade_concrete, "shopfront": shopfront, "tiles": tiles,
    "roofing": roofing, "rock": rock, "wood": wood, "paint": paint, "glass": glass, "cloth": cloth, "leaves": leaves,
    "weeds": weeds, "bark": bark, "stop_sign": stop_sign,
}  # fmt: skip
"""All textures, by name; `NOISE` and `CLOUDS` of the shading are the first two."""
LAYER = {name: number for number, name in enumerate(DRAWN)}


def empty() -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.int32]]:
    """Room for all textures: untouched, it takes no memory. Texels, and where each level begins (maps.Textures)."""
    sides = [SIDE >> level for level in range(LEVELS)]
    starts = np.cumsum([0, *(len(DRAWN) * side * side for side in sides)])
    return np.zeros(int(starts[-1]), np.uint32), starts[:-1].astype(np.int32)


def draw(seed: int, number: int) -> U8:
    """One texture of a world, (SIDE, SIDE, 4)."""
    return list(DRAWN.values())[number](np.random.default_rng((seed, number)))


def add(textures: Textures, number: int, layer: U8) -> None:
    """Put one where it belongs, with its coarser levels."""
    for level, start in enumerate(textures.starts):
        side = SIDE >> level
        first = int(start) + number * side * side
        textures.texels[first : first + side * side] = np.ascontiguousarray(layer).reshape(-1).view(np.uint32)
        layer = np.asarray(cv2.resize(layer, (side // 2, side // 2), interpolation=cv2.INTER_AREA), np.uint8)
