"""The terrain map of a run against the true ground, as figures of its score, and as it is drawn in the report.

The map is of the ground, as far as it is told from what stands on it (`relief.py`). It is held against the ground where
nothing stands, nor within `BESIDE_M` of what does, of water its surface (`truth.py`), as heights over home: that is
what is flown by, and a receiver knows home's own height above the sea to a metre, which moves the whole map
(`home_off_m`).
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from sitl_emu.missions.disaster.truth import solids, surface_m
from sitl_emu.missions.scoring import RunRecord

Grid = npt.NDArray[np.float64]
BESIDE_M = 1.5
SHOWN_CELLS = 60
"""To either side, of the map in the report; of a larger one the means of blocks are shown."""


def mapped_terrain(record: RunRecord) -> dict[str, Any] | None:
    """Figures of the last map of the first vehicle that has written one; None where there is none, or no truth."""
    all_told = [event for event in record.events if event["event"] == "terrain_map"]
    if not all_told or record.folder is None or record.ground_m is None:
        return None
    told = [event for event in all_told if event["vehicle"] == all_told[0]["vehicle"]][-1]
    path = record.folder / told["file"]
    if not path.is_file():
        return None
    amsl_m, north_m, east_m = _read(path, record)
    home_m = record.ground_m(*record.to_metres(told["home_lat_deg"], told["home_lon_deg"]))
    home_off_m = told["home_amsl_m"] - record.origin_amsl_m - home_m
    heights_m = amsl_m - record.origin_amsl_m - home_off_m
    known = np.isfinite(heights_m)
    standing = solids(record.areas).buffer(BESIDE_M)
    shapely.prepare(standing)
    judged = known & ~shapely.contains_xy(standing, north_m, east_m)
    true = np.full(heights_m.shape, np.nan)
    true[judged] = surface_m(record.ground_m, record.areas, north_m[judged], east_m[judged])
    off = heights_m - true
    errors = off[judged]
    thin = max(1, math.ceil(max(heights_m.shape) / SHOWN_CELLS))
    return {
        "rms_m": _rounded(math.sqrt(float(np.mean(errors**2)))) if len(errors) else None,
        "bias_m": _rounded(float(np.mean(errors))) if len(errors) else None,
        "worst_m": _rounded(float(np.max(np.abs(errors)))) if len(errors) else None,
        "home_off_m": _rounded(home_off_m),
        "known_share": _rounded(float(known.mean())),
        "extent_m": [_rounded(float(edge)) for edge in (east_m.min(), east_m.max(), north_m.min(), north_m.max())],
        "heights_m": _listed(_thinned(heights_m, thin)),
        "errors_m": _listed(_thinned(off, thin)),
    }


def _read(path: Path, record: RunRecord) -> tuple[Grid, Grid, Grid]:
    """Heights above mean sea level, and north and east of each cell; row 0 is the southernmost."""
    import tifffile  # as in companion/terrain/files.py

    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        heights_m = np.asarray(page.asarray(), np.float64)[::-1]
        scale, tie = page.tags[33550].value, page.tags[33922].value
    rows, columns = heights_m.shape
    west, north = tie[3], tie[4]
    south_m, west_m = record.to_metres(north - rows * scale[1], west)
    north_m, east_m = record.to_metres(north, west + columns * scale[0])
    row, column = np.mgrid[0:rows, 0:columns]
    north_of = south_m + (row + 0.5) * (north_m - south_m) / rows
    east_of = west_m + (column + 0.5) * (east_m - west_m) / columns
    return heights_m, north_of, east_of


def _thinned(grid: Grid, by: int) -> Grid:
    """The means of what is known in blocks of so many cells to either side; NaN where nothing is."""
    rows, columns = (-(-size // by) for size in grid.shape)
    padded = np.full((rows * by, columns * by), np.nan)
    padded[: grid.shape[0], : grid.shape[1]] = grid
    blocks = padded.reshape(rows, by, columns, by)
    known = np.isfinite(blocks).sum(axis=(1, 3))
    return np.where(known > 0, np.nansum(blocks, axis=(1, 3)) / np.maximum(known, 1), np.nan)


def _listed(grid: Grid) -> list[list[float | None]]:
    return [[round(value, 2) if math.isfinite(value) else None for value in row] for row in grid.tolist()]


def _rounded(value: float) -> float:
    return round(value, 3)
