"""When a fire's front comes where, for the ground's colour and for its flames."""

import math

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world import fires, polygons
from sitl_emu.world.description import Fire, WorldDescription
from sitl_emu.world.render.ground_map import Frame
from sitl_emu.world.render.maps import FireMap

F64 = npt.NDArray[np.float64]
CELL_M = 0.5
RAGGED_M = 3.0
NEVER = 1e9
"""In seconds."""
EMBERS_S = 10.0
"""Where nothing burns any more, what glows falls to a third in so long. Ours."""


def arrival_s(fire: Fire, described: WorldDescription, north: F64, east: F64) -> F64:
    """When places (arrays of one shape) begin to burn; NEVER for those that the front never reaches."""
    inside = polygons.inside(fire.polygon_m, north, east)
    times = np.where(inside, 0.0, NEVER)
    velocity = fires.front_m_s(fire, described.wind)
    speed = float(np.hypot(*velocity))
    if speed == 0.0:
        return times
    back_n, back_e = -velocity[0] / speed, -velocity[1] / speed
    for (n0, e0), (n1, e1) in polygons.edges(fire.polygon_m):
        run_n, run_e = n1 - n0, e1 - e0
        cross = back_n * run_e - back_e * run_n
        if cross == 0.0:
            continue
        way = ((n0 - north) * run_e - (e0 - east) * run_n) / cross
        share = ((n0 - north) * back_e - (e0 - east) * back_n) / cross
        met = (way > 0.0) & (share >= 0.0) & (share <= 1.0) & ~inside
        times = np.where(met, np.minimum(times, way / speed), times)
    return times


def map_of(described: WorldDescription, frame: Frame) -> FireMap:
    """Of all fires, over the ground map's part of the world."""
    if not described.fires:
        return FireMap(np.zeros((1, 1, 2), np.float32), np.zeros((1, 1), np.float32), np.zeros(3, np.float32))
    cell = max(CELL_M, frame.gsd_m)
    rows, columns = round(frame.rows * frame.gsd_m / cell), round(frame.columns * frame.gsd_m / cell)
    north = frame.north0_m + cell * (np.arange(rows) + 0.5)
    east = frame.east0_m + cell * (np.arange(columns) + 0.5)
    grid_n, grid_e = np.meshgrid(north, east, indexing="ij")
    begins, ends = np.full((rows, columns), NEVER), np.full((rows, columns), NEVER)
    for fire in described.fires:
        times = arrival_s(fire, described, grid_n, grid_e)
        sooner = times < begins
        begins[sooner] = times[sooner]
        ends[sooner] = times[sooner] + (fire.burns_s or NEVER)
    # A front that comes within so many metres may already be seen here: borders are ragged (embers in shade.py)
    reach = 2 * math.ceil(RAGGED_M / cell) + 1
    soonest = cv2.erode(begins.astype(np.float32), np.ones((reach, reach), np.uint8))
    corner = np.array((frame.north0_m, frame.east0_m, cell), np.float32)
    return FireMap(np.stack((begins, ends), axis=2).astype(np.float32), np.asarray(soonest, np.float32), corner)
