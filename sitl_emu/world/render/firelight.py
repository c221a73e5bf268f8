"""What flames light in the dark: a few lamps in the place of many flames. By day nothing of it is to be seen.

How bright they are and how they are grouped is ours.
"""

import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.kernel import F32, ONE, ZERO, f4, streamed
from sitl_emu.world.render.pixels import Block
from sitl_emu.world.render.raster import Pinhole
from sitl_emu.world.render.sprites import Fires

F64 = npt.NDArray[np.float64]
DARK_DEG = 8.0
"""A sun lower than this lets flames' light be seen, the lower the more."""
GROUP_M = 12.0
MOST = 8
"""Lamps of a picture."""
REACH_M2 = 900.0
"""Beyond the root of it, lamps nearer to the camera are chosen first."""
POWER = 0.25
"""Of a flame, its height squared: at its root a lamp's light has fallen to half."""
NONE = np.zeros((0, 4), np.float32)


def lamps_of(burning: Fires, camera: Pinhole, time_s: float, elevation_deg: float) -> F32:
    """(n, 4): places (NED) and power (m²) of what burns at a time, for a sun so high."""
    if elevation_deg >= DARK_DEG:
        return NONE
    chosen = np.flatnonzero((burning.begins_s <= time_s) & (time_s < burning.ends_s))
    if len(chosen) == 0:
        return NONE
    power = POWER * (1.0 - elevation_deg / DARK_DEG) * burning.height_m[chosen] ** 2
    place = burning.place[chosen] - np.outer(0.6 * burning.height_m[chosen], (0.0, 0.0, 1.0))
    _, group = np.unique(np.floor(place[:, :2] / GROUP_M), axis=0, return_inverse=True)
    group = group.reshape(-1)
    sums = np.bincount(group, power)
    places = np.stack([np.bincount(group, power * place[:, k]) / sums for k in range(3)], axis=1)
    near = sums / (((places - camera.position) ** 2).sum(axis=1) + REACH_M2)
    best = np.sort(np.argsort(-near, kind="stable")[:MOST])
    return np.concatenate((places[best], sums[best, None]), axis=1).astype(np.float32)


@streamed
def find_firelight(b: Block, n: int, lamps: F32, bright: np.float32) -> None:
    """What surfaces whose own colour is known throw back of it; kept where the tint was, which is no longer needed."""
    for i in range(n):
        north, east, down = b.north[i], b.east[i], b.down[i]
        n_, e_, d_ = b.normal_n[i], b.normal_e[i], b.normal_d[i]
        light = ZERO
        for k in range(lamps.shape[0]):
            to_n, to_e, to_d = lamps[k, 0] - north, lamps[k, 1] - east, lamps[k, 2] - down
            away = to_n * to_n + to_e * to_e + to_d * to_d + f4(0.01)
            # A front is broad: it lights also what looks half away from its middle
            lambert = f4(0.35) + f4(0.65) * max((to_n * n_ + to_e * e_ + to_d * d_) / np.sqrt(away), ZERO)
            light += lambert * lamps[k, 3] / (away + lamps[k, 3])
        light = min(light, ONE) * bright
        red, green, blue = b.red[i], b.green[i], b.blue[i]
        b.tint_r[i] = red * red * light
        b.tint_g[i] = green * green * light * f4(0.42)
        b.tint_b[i] = blue * blue * light * f4(0.10)


@streamed
def add_firelight(b: Block, n: int) -> None:
    """To the other light."""
    for i in range(n):
        b.red[i] += b.tint_r[i]
        b.green[i] += b.tint_g[i]
        b.blue[i] += b.tint_b[i]
