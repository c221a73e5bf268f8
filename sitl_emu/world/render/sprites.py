"""Flames and smoke, as soft pictures in space: where they are at a time, and what they look like.

Smoke is puffs that face the camera. A flame is tongues that stand upright, seen from the side, and glowing heaps, seen
from above: each counts as far as one looks from there, so that flames are right from everywhere.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world import fires
from sitl_emu.world.description import Fire, WorldDescription
from sitl_emu.world.ground import Terrain
from sitl_emu.world.rays import heights
from sitl_emu.world.render.burning import arrival_s
from sitl_emu.world.render.kernel import F32, I32, U32
from sitl_emu.world.render.model import cross
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.textures import cloudy

F64 = npt.NDArray[np.float64]
SIDE = 64
FLAMES, HEAPS, PUFFS = 16, 8, 8
"""Pictures of each: tongues first, then heaps, then puffs."""
ACROSS = 0.95
"""Half of what tongues are wide, of their height: places for them lie 0.75 of it apart, so that they meet."""
MOST_FLAMES = 240
MOST_PUFFS = 140
PUFF_ALPHA = 0.19
"""Mean opacity of a puff's picture: as much of what lies behind shows, whatever its shape."""
SPREADS_S = 1800.0
"""For how long from the start flames are ready for a front that moves."""
REACH_M = 400.0
SPRITE = 12
"""Figures of one: middle (0-2) and half sides across (3-5) and up (6-8), NED; opacity (9), picture (10), object."""


class Fires(NamedTuple):
    """All places where there may be flames."""

    described: WorldDescription
    place: F64
    """(n, 3), NED, on the ground."""
    begins_s: F64
    ends_s: F64
    height_m: F64
    seed: F64
    """(n,), 0 to 1."""
    objects: I32


def pictures(seed: int) -> U32:
    """(n * SIDE * SIDE,), a byte for each, from the lowest on: blue, green, red, opacity."""
    rng = np.random.default_rng((seed, 21))
    y, x = np.mgrid[1 : -1 : SIDE * 1j, -1 : 1 : SIDE * 1j].astype(np.float32)
    made = []
    for _ in range(FLAMES):
        made.append(_tongues(rng, x, 0.5 * (y + 1.0)))
    for _ in range(HEAPS):
        wild = cloudy(rng, 5, 4, SIDE)
        body = np.clip(1.05 - np.hypot(x, y) * 1.25 + 0.30 * wild, 0, 1)
        made.append(_glowing(np.clip(body * 1.05 + 0.15 * wild, 0, 1), np.clip(body * 1.4, 0, 0.92)))
    for _ in range(PUFFS):
        made.append(_puff(rng, x, y))
    return np.clip(np.round(np.stack(made) * 255.0), 0, 255).astype(np.uint8).reshape(-1).view(np.uint32)


def _tongues(rng: np.random.Generator, x: F32, high: F32) -> F32:
    """Some licks that rise from one bed, swaying; `high`: 0 at the bottom to 1."""
    sway, licks = _noise(rng, 2), _noise(rng, 9, 4)
    column, row = np.meshgrid(np.arange(SIDE, dtype=np.float32), np.arange(SIDE, dtype=np.float32))
    licks = np.asarray(cv2.remap(licks, column + 5.0 * high * sway, row, cv2.INTER_LINEAR, None, cv2.BORDER_REFLECT))
    # Along the bed they are of several heights, and none at its ends, where the next sprite's begins
    crown = 0.62 + 0.17 * _noise(rng, 3)[SIDE // 2]
    up = high / np.maximum(np.clip(crown, 0.25, 0.95) * np.sqrt(1.0 - x * x), 0.05)
    body = np.clip(2.6 * (0.62 - 0.72 * up + 0.33 * licks * np.clip(up, 0.1, 1.0)), 0, 1)
    body *= np.clip(9.0 * high, 0, 1) * np.clip(5.0 * (0.99 - high), 0, 1)
    hot = np.clip(body * (1.12 - 0.62 * up) + 0.10 * licks, 0, 1)
    return _glowing(hot, body * (0.92 - 0.30 * high))


def _puff(rng: np.random.Generator, x: F32, y: F32) -> F32:
    """A billow: its outline bent by broad noise, its inside mottled by finer one, lit from above."""
    wild, bent_x, bent_y = (_noise(rng, waves) for waves in (3, 2, 2))
    away = np.hypot(x + 0.11 * bent_x, 1.12 * (y + 0.11 * bent_y))
    # Ragged, but for the picture's border, where nothing may be cut
    body = np.clip(0.92 - 0.95 * away + 0.20 * wild, 0, 1) * np.clip(4.0 * (0.99 - np.hypot(x, y)), 0, 1)
    alpha = body * (1.6 - 0.6 * body)
    alpha *= PUFF_ALPHA / float(alpha.mean())
    shade = np.clip(0.92 + 0.08 * wild + 0.30 * (np.roll(wild, 3, axis=0) - wild) + 0.14 * y, 0, 1.2) / 1.3
    return np.stack((shade, shade, shade, np.clip(alpha, 0, 1)), axis=2).astype(np.float32)


def _noise(rng: np.random.Generator, waves: int, tall: int = 1) -> F32:
    """(SIDE, SIDE), mean 0, deviation 1; of a larger one, so that its borders differ; its waves so much taller."""
    part = cloudy(rng, waves, 4, 2 * SIDE, 0.6)[: SIDE // tall, :SIDE]
    part = np.asarray(cv2.resize(part, (SIDE, SIDE), interpolation=cv2.INTER_CUBIC), np.float32)
    return np.asarray((part - part.mean()) / part.std(), np.float32)


def _glowing(hot: F32, alpha: F32) -> F32:
    """From dark red over orange to a pale yellow."""
    red, green, blue = (
        np.clip(0.55 + 0.9 * hot, 0, 1),
        np.clip(1.25 * hot - 0.10, 0, 0.97),
        np.clip(1.9 * hot - 1.2, 0, 0.75),
    )
    return np.stack((blue, green, red, np.clip(alpha, 0, 1)), axis=2).astype(np.float32)


def fires_of(described: WorldDescription, terrain: Terrain, first_object: int) -> Fires:
    """Places for flames, evenly over what burns at some time; fires' objects are numbered from `first_object`."""
    rows: list[npt.NDArray[np.float64]] = []
    for number, fire in enumerate(described.fires):
        outline = np.array(fires.reached(fire, described.wind, SPREADS_S if fire.spread_m_s else 0.0))
        (south, west), (north, east) = outline.min(axis=0), outline.max(axis=0)
        gap = max(0.75 * fire.flame_height_m, 0.35, math.sqrt((north - south) * (east - west) / 60_000.0))
        rng = np.random.default_rng((described.seed, number, 22))
        n, e = (each.ravel() for each in np.meshgrid(np.arange(south, north, gap), np.arange(west, east, gap)))
        n, e = n + rng.uniform(0, gap, len(n)), e + rng.uniform(0, gap, len(n))
        begins = arrival_s(fire, described, n, e)
        kept = begins <= SPREADS_S
        n, e, begins = n[kept], e[kept], begins[kept]
        high = fire.flame_height_m * rng.uniform(0.55, 1.25, len(n))
        ends = begins + (fire.burns_s or np.inf)
        rows.append(np.stack((n, e, -heights(terrain, n, e), begins, ends, high, rng.random(len(n)),
                              np.full(len(n), first_object + number)), axis=1))  # fmt: skip
    all_ = np.concatenate(rows) if rows else np.zeros((0, 8))
    return Fires(described, all_[:, :3], all_[:, 3], all_[:, 4], all_[:, 5], all_[:, 6], all_[:, 7].astype(np.int32))


def at_time(burning: Fires, terrain: Terrain, camera: Pinhole, time_s: float, haze_1_m: float) -> F32:
    """(n, SPRITE), the nearest first: what there is of flames and smoke for a camera at a time.

    Haze before them makes them fainter: what is behind them has been painted with it.
    """
    parts = [_flames(burning, camera, time_s)]
    parts += [_smoke(fire, burning.described, terrain, camera, time_s) for fire in burning.described.fires]
    every = np.concatenate(parts)
    away = np.linalg.norm(every[:, :3] - camera.position, axis=1)
    every[:, 9] *= np.exp(-haze_1_m * away)
    return np.ascontiguousarray(every[np.argsort(away, kind="stable")], np.float32)


def _across(to: F64) -> F64:
    """(n, 3) level unit vectors square to directions (n, 3)."""
    across = np.stack((-to[:, 1], to[:, 0], np.zeros(len(to))), axis=1)
    lengths = np.linalg.norm(across, axis=1)
    across[lengths < 1e-6] = (0.0, 1.0, 0.0)
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1), 1e-9)[:, None])


def _flames(burning: Fires, camera: Pinhole, time_s: float) -> F64:
    chosen = np.flatnonzero((burning.begins_s <= time_s) & (time_s < burning.ends_s))
    away = np.linalg.norm(burning.place[chosen] - camera.position, axis=1)
    chosen, away = chosen[away < REACH_M], away[away < REACH_M]
    if len(chosen) > MOST_FLAMES:
        # Those nearest, each with a chance that does not change from picture to picture
        rank = away * (0.4 + burning.seed[chosen])
        chosen = chosen[np.argsort(rank, kind="stable")[:MOST_FLAMES]]
    if len(chosen) == 0:
        return np.zeros((0, SPRITE))
    place, seed, number = burning.place[chosen], burning.seed[chosen], burning.objects[chosen]
    lasts = np.minimum(burning.ends_s[chosen] - burning.begins_s[chosen], 1e6)
    age = np.clip((time_s - burning.begins_s[chosen]) / lasts, 0, 1)
    flicker = 0.82 + 0.18 * np.sin(2 * math.pi * (time_s * (1.3 + seed) + 7.0 * seed))
    high = burning.height_m[chosen] * flicker * (1.0 - 0.7 * age)
    to = place - camera.position
    to /= np.linalg.norm(to, axis=1)[:, None]
    from_above = np.clip(to[:, 2], 0.0, 1.0)
    across, up = _across(to), np.array((0.0, 0.0, -1.0))
    tongue = np.zeros((len(chosen), SPRITE))
    tongue[:, :3] = place + 0.5 * high[:, None] * up
    tongue[:, 3:6], tongue[:, 6:9] = ACROSS * high[:, None] * across, 0.55 * high[:, None] * up
    tongue[:, 9] = np.clip(1.4 * (1.0 - from_above**2) ** 2, 0.0, 1.0)
    tongue[:, 10] = np.floor(seed * 997.0 + time_s * 11.0) % FLAMES
    tongue[:, 11] = number
    heap = tongue.copy()
    turn = 2.0 * math.pi * seed
    side, other = across, cross(to, across)
    heap[:, :3] = place + 0.35 * high[:, None] * up
    size = (0.48 * high)[:, None]
    heap[:, 3:6] = size * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
    heap[:, 6:9] = size * (-np.sin(turn)[:, None] * side + np.cos(turn)[:, None] * other)
    heap[:, 9] = 0.95 * from_above**1.5
    heap[:, 10] = FLAMES + np.floor(seed * 887.0 + time_s * 7.0) % HEAPS
    return np.concatenate((tongue[tongue[:, 9] > 0.03], heap[heap[:, 9] > 0.03]))


def _smoke(fire: Fire, described: WorldDescription, terrain: Terrain, camera: Pinhole, time_s: float) -> F64:
    """Puffs that rise over what burns and drift: each lives from the ground to the smoke's height, then begins anew."""
    if fire.smoke is None:
        return np.zeros((0, SPRITE))
    smoke = fire.smoke
    outline = np.array(fires.reached(fire, described.wind, time_s))
    (south, west), (north, east) = outline.min(axis=0), outline.max(axis=0)
    k = np.arange(MOST_PUFFS)
    lives_s = smoke.height_m / smoke.rise_m_s
    turns = (k * 0.61803) % 1.0 + time_s / lives_s
    share, life = turns % 1.0, np.floor(turns).astype(np.int64)
    mixed = (k * 2654435761 + life * 40503) % 1_000_003
    u, v = (mixed % 1009) / 1009.0, (mixed // 1009) / 991.0
    born = time_s - share * lives_s
    n, e = south + u * (north - south), west + v * (east - west)
    begins = arrival_s(fire, described, n, e)
    fresh = (born >= begins) & (born < begins + (fire.burns_s or np.inf) + 8.0) & (born > -lives_s)
    k, share, n, e, u = k[fresh], share[fresh], n[fresh], e[fresh], u[fresh]
    if len(k) == 0:
        return np.zeros((0, SPRITE))
    rises = share * smoke.height_m
    steps = np.linspace(0.0, smoke.height_m, 25)
    plumes = np.array([fires.plume(fire, described.wind, time_s, float(height)) for height in steps])
    drift = np.stack([np.interp(rises, steps, plumes[:, column]) for column in range(4)], axis=1)
    radius = 1.5 * fire.flame_height_m + 1.5 + 2.8 * drift[:, 2]
    ground = heights(terrain, n, e)
    made = np.zeros((len(k), SPRITE))
    made[:, :3] = np.stack((n + drift[:, 0], e + drift[:, 1], -ground - rises - 0.6 * fire.flame_height_m), axis=1)
    to = made[:, :3] - camera.position
    to /= np.maximum(np.linalg.norm(to, axis=1), 1e-9)[:, None]
    side = _across(to)
    other = cross(to, side)
    turn = 2.0 * math.pi * u + 0.15 * share
    made[:, 3:6] = radius[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
    made[:, 6:9] = radius[:, None] * (-np.sin(turn)[:, None] * side + np.cos(turn)[:, None] * other)
    thick = 1.0 - np.exp(-drift[:, 3] * 2.0 * radius)
    made[:, 9] = np.clip(0.8 * thick, 0.0, 0.65) * np.minimum(1.0, 6.0 * share) * np.minimum(1.0, 4.0 * (1.0 - share))
    made[:, 10] = FLAMES + HEAPS + k % PUFFS
    made[:, 11] = -1
    near = np.linalg.norm(made[:, :3] - camera.position, axis=1) < REACH_M
    return np.asarray(made[(made[:, 9] > 0.01) & near])


def smoke_light(fire: Fire | None, light: npt.NDArray[np.floating], exposure: float) -> F32:
    """What a puff's white is multiplied with, blue, green, red: its colour in the day's light."""
    colour = np.array(fire.smoke.colour if fire is not None and fire.smoke is not None else (0.4, 0.4, 0.4))
    day = light[1] * 0.45 + light[2] + 0.25 * light[4]
    return np.asarray((np.sqrt(np.clip(colour * colour * day * exposure * 1.7, 0, 1.4)) * 1.3)[::-1], np.float32)
