"""What the sun and the sky reach: maps drawn once from a stage, and one of what moves, drawn for each picture."""

import math

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.ground import Terrain
from sitl_emu.world.rays import heights
from sitl_emu.world.render.ground_map import Frame
from sitl_emu.world.render.kernel import F32, I32, U32
from sitl_emu.world.render.maps import STEPS, SUN_OFFSET, Relief, SunMap, draw_sun_map
from sitl_emu.world.render.raster import Buffers, Instances, Meshes

F64 = npt.NDArray[np.float64]
SUN_SIDE = 2560
SUN_FINEST_M = 0.04
MOVING_SIDE = 640
SHUT_FROM_SKY_M = (0.8, 3.5)
"""Radii of the two blurs whose mean height shuts the sky."""


def sun_map(to_sun: F64, middle: F64, reach_m: float, side: int) -> SunMap:
    """An empty map about a place that holds a sphere around it."""
    towards = to_sun / np.linalg.norm(to_sun)
    right = np.cross(towards, (1.0, 0.0, 0.0) if abs(towards[0]) < 0.9 else (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    down = np.cross(right, towards)
    frame = np.concatenate((middle, right, down, towards, [2.0 * reach_m / side])).astype(np.float32)
    return SunMap(np.zeros(side * side, np.float32), side, frame)


def draw(sun: SunMap, meshes: Meshes, things: Instances, which: I32, level: I32) -> None:
    """Clear a map and draw instances into it, each in a level of detail."""
    sun.nearness[:] = 0.0
    nobody = np.zeros(1, np.int32)
    ranges = meshes.levels[level[which]]
    most = int((ranges[:, 1] - ranges[:, 0]).max()) if len(which) else 0
    draw_sun_map(meshes, things, which, level, sun, Buffers(sun.nearness, nobody, nobody), np.empty((most, 3)))


def relief(terrain: Terrain, frame: Frame, meshes: Meshes, things: Instances, which: I32, level: I32) -> Relief:
    """Over the ground map's part of the world: heights, slopes, and what shuts the sky."""
    spacing = max(0.5, frame.gsd_m * 2.0)
    rows = max(math.ceil(frame.rows * frame.gsd_m / spacing) + 1, 2)
    columns = max(math.ceil(frame.columns * frame.gsd_m / spacing) + 1, 2)
    north, east = frame.north0_m + spacing * np.arange(rows), frame.east0_m + spacing * np.arange(columns)
    grid_n, grid_e = np.meshgrid(north, east, indexing="ij")
    height = heights(terrain, grid_n, grid_e).astype(np.float32)
    rise_n, rise_e = (np.asarray(rise) for rise in np.gradient(height, spacing))
    side = max(rows, columns)
    middle = (frame.north0_m + (side / 2 - 0.5) * spacing, frame.east0_m + (side / 2 - 0.5) * spacing, 0.0)
    plan = np.array((*middle, 0, 1, 0, 1, 0, 0, 0, 0, -1, spacing), np.float32)
    top = SunMap(np.zeros(side * side, np.float32), side, plan)
    draw(top, meshes, things, which, level)
    above = top.nearness.reshape(side, side)[:rows, :columns] - np.float32(SUN_OFFSET)
    above = np.maximum(np.where(above < -0.5 * SUN_OFFSET, height, above), height)
    blurs = [cv2.GaussianBlur(above, (0, 0), radius / spacing) for radius in SHUT_FROM_SKY_M]
    shut: F32 = np.asarray(0.45 * blurs[0] + 0.55 * blurs[1], np.float32)
    return Relief(height, shut, _steps(rise_n, rise_e), np.array((frame.north0_m, frame.east0_m, spacing), np.float32))


def _steps(rise_n: npt.NDArray[np.floating], rise_e: npt.NDArray[np.floating]) -> U32:
    """Slopes in two halves of a word each (maps.Relief); steeper ones than 86 degrees are as steep as that."""
    north, east = (np.clip(np.round(rise * STEPS), -32767, 32767).astype(np.int32) for rise in (rise_n, rise_e))
    return np.asarray((east.view(np.uint32) << np.uint32(16)) | (north.view(np.uint32) & np.uint32(0xFFFF)), np.uint32)
