"""Persons, vehicles, trees and signs as meshes: they stand on their origin and look north. Their shapes are ours."""

import functools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.material import NUMBER
from sitl_emu.world.render.model import (
    Colour,
    Model,
    box,
    cross,
    ellipsoid,
    face,
    hull,
    lathe,
    lengths,
    merged,
    moved,
    of_planes,
)

F64 = npt.NDArray[np.float64]

PAINT, GLASS, CLOTH, LEAVES, BARK = (NUMBER[name] for name in ("paint", "glass", "cloth", "leaves", "bark"))
RUBBER: Colour = (0.09, 0.09, 0.10)
GREY: Colour = (0.55, 0.56, 0.58)
SKINS: tuple[Colour, ...] = ((0.87, 0.68, 0.56), (0.72, 0.52, 0.40), (0.45, 0.31, 0.23))
TROUSERS: tuple[Colour, ...] = ((0.15, 0.18, 0.28), (0.22, 0.21, 0.20), (0.42, 0.37, 0.30), (0.10, 0.10, 0.12))
HAIR: tuple[Colour, ...] = ((0.12, 0.09, 0.07), (0.30, 0.20, 0.12), (0.55, 0.50, 0.45))
PERSON_M = 1.75
"""Height of the figure that others are scaled from."""


class Detail(NamedTuple):
    """How finely something round is made."""

    limb: int
    sides: int
    rings: int
    wheel: tuple[int, int]
    """Sides of tyre and rim; a rim of none is not there."""
    swells: float
    """How much thicker a body of so few sides is, to fill as much of a picture as one of many."""


DETAILS = (Detail(7, 10, 6, (14, 10), 1.0), Detail(4, 6, 4, (8, 6), 1.06), Detail(3, 4, 3, (5, 0), 1.18))
"""The finest first."""
PERSON_ERRORS_M, VEHICLE_ERRORS_M = (0.018, 0.05), (0.03, 0.10)
"""How far the coarser ones lie from it, about: of a torso's and of a wheel's radius."""
SKIN, TOP, LEGS, HAIR_, COAT = ((-float(k), 0.0, 0.0) for k in range(1, 6))
"""Colours that `_dressed` puts in."""


def _dressed(model: Model, colours: dict[Colour, Colour]) -> Model:
    """A shape that many share, in colours of its own."""
    tints = model.tints.copy()
    for number, colour in colours.items():
        tints[model.tints[:, 0] == number[0]] = colour
    return Model(model.corners, model.uv, model.triangles, model.normals, model.materials, tints)


def _limb(
    start: tuple[float, float, float], end: tuple[float, float, float], radius: float, tint: Colour, detail: Detail
) -> Model:
    """A tapered limb between two points (north, east, up)."""
    a, b = np.array(start), np.array(end)
    length, radius = float(np.linalg.norm(b - a)), radius * detail.swells
    rod = lathe(((0.0, 0.0), (radius * 0.8, 0.01), (radius, length * 0.7), (radius * 0.9, length), (0.0, length)),
                detail.limb, CLOTH, tint)  # fmt: skip
    along = (b - a) * (1.0, 1.0, -1.0) / length
    side = cross(along, np.array((1.0, 0.0, 0.0) if abs(along[0]) < 0.9 else (0.0, 1.0, 0.0)))
    side /= np.linalg.norm(side)
    # The rod's own axis is up, which is -z
    turn = np.stack((side, cross(-along, side), -along), axis=1)
    return moved(rod, a * (1.0, 1.0, -1.0), turn)


def person(height_m: float, colour: Colour, seed: int, detail: Detail = DETAILS[0]) -> Model:
    """Somebody in mid-step, in a top of a colour."""
    rng = np.random.default_rng((seed, 1))
    skin, legs, hair = (palette[int(rng.integers(len(palette)))] for palette in (SKINS, TROUSERS, HAIR))
    # One of a few steps, whose shapes are made once
    step = round(0.03 + 0.0238 * round(float(rng.uniform(0.0, 8.0))), 4)
    whole = _dressed(_figure(step, detail), {SKIN: skin, TOP: colour, LEGS: legs, HAIR_: hair})
    return _scaled(whole, height_m / PERSON_M)


@functools.lru_cache(maxsize=32)
def _figure(step: float, detail: Detail) -> Model:
    """A person of PERSON_M whose feet are twice `step` apart."""

    def ball(at: tuple[float, float, float], radii: tuple[float, float, float], tint: Colour) -> Model:
        across = (radii[0] * detail.swells, radii[1] * detail.swells, radii[2])
        return moved(ellipsoid(across, CLOTH, tint, detail.sides, detail.rings), (at[0], at[1], -at[2]))

    parts = [
        ball((0.0, 0.0, 1.60), (0.105, 0.085, 0.125), SKIN),
        ball((-0.015, 0.0, 1.655), (0.112, 0.092, 0.10), HAIR_),
        _limb((0.0, 0.0, 1.42), (0.0, 0.0, 1.53), 0.055, SKIN, detail),
        ball((0.0, 0.0, 1.30), (0.125, 0.205, 0.20), TOP),
        ball((0.0, 0.0, 1.08), (0.115, 0.165, 0.24), TOP),
        ball((0.0, 0.0, 0.92), (0.12, 0.17, 0.14), LEGS),
    ]
    for side in (-1.0, 1.0):
        ahead = side * step
        knee = (0.5 * ahead + 0.03, side * 0.09, 0.50)
        foot = (ahead, side * 0.09, 0.06)
        parts += [_limb((0.0, side * 0.09, 0.92), knee, 0.085, LEGS, detail), _limb(knee, foot, 0.062, LEGS, detail)]
        parts.append(ball((foot[0] + 0.05, foot[1], 0.045), (0.13, 0.05, 0.045), RUBBER))
        elbow = (-0.5 * ahead, side * 0.27, 1.14)
        hand = (-ahead + 0.05, side * 0.26, 0.90)
        parts.append(_limb((0.0, side * 0.20, 1.42), elbow, 0.055, TOP, detail))
        parts.append(_limb(elbow, hand, 0.042, SKIN, detail))
        parts.append(ball((hand[0], hand[1], 0.86), (0.045, 0.03, 0.07), SKIN))
    return merged(parts)


def _scaled(model: Model, by: float) -> Model:
    corners = (model.corners * by).astype(np.float32)
    return Model(corners, model.uv, model.triangles, model.normals, model.materials, model.tints)


@functools.lru_cache(maxsize=16)
def wheel(radius: float, width: float, sides: tuple[int, int] = DETAILS[0].wheel) -> Model:
    """Its axle east to west, about its middle; `sides` of tyre and rim."""
    parts = [lathe(((0.0, -width / 2), (radius * 0.9, -width / 2), (radius, -width / 4), (radius, width / 4),
                    (radius * 0.9, width / 2), (0.0, width / 2)), sides[0], CLOTH, RUBBER)]  # fmt: skip
    if sides[1]:
        parts.append(lathe(((radius * 0.58, -width / 2 - 0.01), (radius * 0.58, width / 2 + 0.01),
                            (0.0, width / 2 - 0.02)), sides[1], CLOTH, GREY))  # fmt: skip
        parts.append(lathe(((0.0, -width / 2 + 0.02), (radius * 0.58, -width / 2 - 0.01)), sides[1], CLOTH, GREY))
    onto_side = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)))
    return moved(merged(parts), (0.0, 0.0, 0.0), onto_side)


def _slab(
    outline: list[tuple[float, float]], half_low: float, half_high: float, rounding: float, tint: Colour
) -> Model:
    """A car's body: a side view (north, up), as wide as `half_low` below and `half_high` above, its ends rounded."""
    heights = [up for _, up in outline]
    low, high = min(heights), max(heights)
    ends = [north for north, _ in outline]
    front, back = max(ends), min(ends)
    points = []
    for north, up in outline:
        half = half_low + (half_high - half_low) * (up - low) / (high - low)
        near_end = rounding if north in (front, back) or front - north < 0.2 or north - back < 0.2 else 0.0
        points += [(north, side * (half - near_end), -up) for side in (-1.0, 1.0)]
        if near_end:
            inner = north - math.copysign(2.0 * rounding, north)
            points += [(inner, side * half, -up) for side in (-1.0, 1.0)]
    return hull(points, PAINT, tint)


def car(length_m: float, colour: Colour, detail: Detail = DETAILS[0]) -> Model:
    """A saloon: body, glass house, wheels, lights."""
    return _scaled(_dressed(_saloon(detail), {COAT: colour}), length_m / 4.4)


@functools.lru_cache(maxsize=len(DETAILS))
def _saloon(detail: Detail) -> Model:
    """Of 4.4 m."""
    body = _slab(
        [(2.16, 0.28), (2.20, 0.55), (2.05, 0.72), (0.95, 0.93), (-1.55, 0.98), (-2.15, 0.92), (-2.20, 0.50),
         (-2.12, 0.28)],
        0.84, 0.86, 0.12, COAT,
    )  # fmt: skip
    roof = hull(
        [(n, e * s, -h) for n, e, h in ((0.42, 0.56, 1.40), (-1.02, 0.57, 1.40), (0.30, 0.55, 1.44), (-0.9, 0.55, 1.44),
                                        (0.52, 0.60, 1.36), (-1.15, 0.60, 1.36)) for s in (-1, 1)],
        PAINT, COAT,
    )  # fmt: skip
    house = hull(
        [(n, e * s, -h) for s in (-1, 1)
         for n, e, h in ((1.12, 0.76, 0.90), (0.46, 0.58, 1.38), (-1.10, 0.58, 1.38), (-1.80, 0.76, 0.94))],
        GLASS,
    )  # fmt: skip
    parts = [body, roof, house]
    for side in (-1.0, 1.0):
        for north in (0.52, -0.30, -1.12):  # pillars
            lean = 0.0 if north == -0.30 else math.copysign(0.31, north)
            ends = ((0.745, 0.93, lean), (0.575, 1.39, 0.0))
            pillar = [(north + dn + dt, side * (e + de), -h)
                      for dn in (-0.035, 0.035) for de in (0.0, 0.02) for e, h, dt in ends]  # fmt: skip
            parts.append(hull(pillar, PAINT, COAT))
        for north in (1.35, -1.33):
            parts.append(moved(wheel(0.32, 0.21, detail.wheel), (north, side * 0.77, -0.32)))
        lamp = [(2.17, side * 0.60, -0.66), (2.17, side * 0.78, -0.66), (2.19, side * 0.60, -0.56),
                (2.12, side * 0.84, -0.57), (2.0, side * 0.7, -0.6)]  # fmt: skip
        parts.append(hull(lamp, CLOTH, (0.95, 0.95, 0.92)))
        parts.append(moved(box((0.05, 0.30, 0.10), CLOTH, (0.55, 0.03, 0.04)), (-2.18, side * 0.62, -0.80)))
    parts.append(moved(box((0.04, 1.2, 0.14), CLOTH, (0.08, 0.08, 0.09)), (2.17, 0.0, -0.42)))
    return merged(parts)


def truck(length_m: float, colour: Colour, detail: Detail = DETAILS[0]) -> Model:
    """A delivery truck: cab, load box, wheels."""
    return _scaled(_dressed(_box_truck(detail), {COAT: colour}), length_m / 7.0)


@functools.lru_cache(maxsize=len(DETAILS))
def _box_truck(detail: Detail) -> Model:
    """Of 7 m."""
    cab = _slab([(3.45, 0.45), (3.48, 1.25), (3.15, 2.35), (1.75, 2.45), (1.75, 0.45)], 1.08, 1.02, 0.1, COAT)
    load = moved(box((5.0, 2.3, 2.35), PAINT, (0.88, 0.88, 0.86)), (-0.95, 0.0, -2.10))
    frame = moved(box((6.2, 1.0, 0.3), CLOTH, RUBBER), (-0.2, 0.0, -0.72))
    screen = face([(3.49, -0.92, -1.32), (3.49, 0.92, -1.32), (3.20, 0.90, -2.22), (3.20, -0.90, -2.22)],
                  [(0, 1), (1, 1), (1, 0), (0, 0)], GLASS)  # fmt: skip
    parts = [cab, load, frame, moved(screen, (0.02, 0.0, 0.0))]
    for side in (-1.0, 1.0):
        pane = hull([(2.9, side * 1.05, -1.35), (2.15, side * 1.06, -1.35), (2.75, side * 1.045, -2.15),
                     (2.15, side * 1.045, -2.15), (2.5, side * 1.0, -1.7)], GLASS)  # fmt: skip
        parts += [pane, moved(wheel(0.46, 0.3, detail.wheel), (2.4, side * 0.97, -0.46))]
        parts += [moved(wheel(0.46, 0.3, detail.wheel), (north, side * 0.92, -0.46)) for north in (-1.8, -2.8)]
        parts.append(moved(box((0.05, 0.3, 0.16), CLOTH, (0.95, 0.95, 0.9)), (3.47, side * 0.8, -0.75)))
    return merged(parts)


def _cos_sin(angles: F64) -> tuple[F64, F64]:
    """By libm: numpy has others for some processors."""
    each = angles.tolist()
    return np.array([math.cos(angle) for angle in each]), np.array([math.sin(angle) for angle in each])


def _unit(rows: F64) -> F64:
    return np.asarray(rows / lengths(rows)[:, None])


def _on_cone(rng: np.random.Generator, angle: F64, crown: tuple[float, float, float]) -> tuple[F64, F64, F64, F64]:
    """A conifer's tufts: where, which way out, how large, how bright."""
    crown_m, low, top = crown
    count = len(angle)
    high = np.array([share**1.4 for share in rng.random(count).tolist()])
    taper = np.array([(1.0 - share) ** 0.9 for share in high.tolist()])
    reach = crown_m * taper * rng.uniform(0.55, 1.05, count) + 0.04 * crown_m
    c, s = _cos_sin(angle)
    at = np.stack((reach * c, reach * s, low + high * (top - low)), axis=1)
    outward = np.stack((c, s, np.full(count, 0.55)), axis=1) / 1.14
    return at, outward, crown_m * (0.62 - 0.40 * high) * min(1.0, (70.0 / count) ** 0.5), np.full(count, 0.9)


def _on_sphere(
    rng: np.random.Generator, angle: F64, crown: tuple[float, float, float], seed: int
) -> tuple[F64, F64, F64, F64]:
    """The same of a broadleaf: even over the sphere (golden angle), more tufts outside than inside."""
    crown_m, low, top = crown
    middle, half, count = 0.5 * (low + top), 0.5 * (top - low), len(angle)
    z = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    ring = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    c, s = _cos_sin(angle)
    outward = np.stack((ring * c, ring * s, z), axis=1)
    reach = rng.uniform(0.62, 1.0, count)
    bumpy = 1.0 + 0.16 * _cos_sin(3.0 * angle + seed)[1] * ring + 0.1 * _cos_sin(5.0 * z + 2.0 * angle)[1]
    at = outward * (crown_m, crown_m, half) * (reach * bumpy)[:, None] + (0.0, 0.0, middle)
    size = (0.75 + 0.4 * rng.random(count)) * (crown_m * crown_m * half) ** (1 / 3) * (2.4 / count) ** 0.5 * 2.0
    return at, outward, size, 0.55 + 0.45 * reach


def _tufts(
    rng: np.random.Generator, count: int, crown: tuple[float, float, float], green: F64, seed: int, is_conifer: bool
) -> Model:
    """Leaves of a crown (half its width, where it begins, its top): ragged pentagons, each of three triangles."""
    angle = 2.39996 * np.arange(count) + rng.uniform(-0.4, 0.4, count)
    at, outward, size, bright = (
        _on_cone(rng, angle, crown) if is_conifer else _on_sphere(rng, angle, crown, seed)
    )  # fmt: skip
    tilt = _unit(outward + rng.normal(scale=0.45, size=(count, 3)))
    side = _unit(cross(tilt, rng.normal(size=(count, 3))))
    other = cross(tilt, side)
    shade = rng.uniform(0.72, 1.18, count) * bright
    along, across = _cos_sin(1.2566 * np.arange(5.0))
    spokes = along[:, None] * side[:, None] + across[:, None] * other[:, None]
    rim = at[:, None] + (size[:, None] * rng.uniform(0.7, 1.25, (count, 5)))[:, :, None] * spokes
    upright = (1.0, 1.0, -1.0)
    fan = 5 * np.arange(count)[:, None, None] + ((0, 1, 2), (0, 2, 3), (0, 3, 4))
    lit = np.repeat(outward * upright, 3, axis=0).astype(np.float32)
    tints = np.repeat(np.clip(green * shade[:, None], 0.02, 1.0), 3, axis=0).astype(np.float32)
    return of_planes(rim * upright, fan, cross(other * upright, side * upright), LEAVES, lit, tints, 1.1)


def tree(
    height_m: float, crown_m: float, seed: int, tufts: int = 110, is_conifer: bool = False, low_m: float = -1.0
) -> Model:
    """A trunk, and a crown of tufts of leaves about a dark inside; its light is that of the crown's round shape.

    `low_m`: where the crown begins, if that is known.
    """
    rng = np.random.default_rng((seed, 2))
    trunk_m = max(0.03 * height_m, 0.06)
    low = low_m if low_m >= 0.0 else (0.12 if is_conifer else 0.32) * height_m
    # As many sides as so many tufts leave to be seen
    sides, rings = (7, 6) if tufts > 100 else (5, 5) if tufts > 40 else (4, 4) if tufts > 20 else (3, 3)
    trunk = lathe(((trunk_m * 1.4, -0.3), (trunk_m, 0.15 * height_m), (trunk_m * 0.5, 0.8 * height_m)), sides, BARK,
                  (0.36, 0.30, 0.25), 1.0)  # fmt: skip
    middle, half = 0.5 * (low + height_m), 0.5 * (height_m - low)
    green = np.array((0.20, 0.33, 0.17) if is_conifer else (0.33, 0.44, 0.19)) * rng.uniform(0.85, 1.15, 3)
    crown = _tufts(rng, tufts, (crown_m, low, height_m), green, seed, is_conifer)
    dark = (float(green[0]) * 0.5, float(green[1]) * 0.5, float(green[2]) * 0.5)
    if is_conifer:
        inside = lathe(
            ((0.0, low), (0.62 * crown_m, low + 0.05 * height_m), (0.0, 0.97 * height_m)), sides + 1, LEAVES, dark, 1.1
        )
    else:
        inside = moved(
            ellipsoid((0.74 * crown_m, 0.74 * crown_m, 0.74 * half), LEAVES, dark, sides + 2, rings), (0, 0, -middle)
        )
    return merged((trunk, inside, crown))


def stop_sign(height_m: float) -> Model:
    """An octagon 0.75 m wide on a post, its face to the north."""
    radius = 0.375 / math.cos(math.pi / 8)
    angles = np.radians(np.arange(22.5, 360, 45))
    rim = [(0.04, radius * math.cos(a), -height_m + 0.4 - radius * math.sin(a)) for a in angles]
    # Seen from the north, east lies to the left
    uv = [(0.5 - 0.5 * math.cos(a), 0.5 - 0.5 * math.sin(a)) for a in angles]
    front = face(rim, uv, NUMBER["stop_sign"])
    back = face([(n - 0.02, e, d) for n, e, d in reversed(rim)], uv, CLOTH, GREY)
    post = lathe(((0.035, -0.2), (0.035, height_m - 0.1), (0.0, height_m - 0.1)), 8, CLOTH, GREY)
    return merged((front, back, post))
