"""Heights from files: NumPy's .npy, grey pictures (.png), GeoTIFF in longitude and latitude."""

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.world.description import Origin, Terrain, WorldError
from sitl_emu.world.terrain import HeightMap

FloatArray = npt.NDArray[np.float64]

GEOGRAPHIC = 2
"""GTModelTypeGeoKey of a raster in longitude and latitude (OGC GeoTIFF 1.1, 7.1.1)."""
NO_DATA_TAG = 42113
"""GDAL_NODATA: the value, as text, of points without a height."""
LARGEST_POINTS = 16_000_000
"""Ours: 4 km square a metre apart; more would take gigabytes in each process that sees the world."""


def read(terrain: Terrain, origin: Origin, folder: Path) -> HeightMap:
    """The height map that a terrain's file holds, `folder` being where it lies. Raises WorldError."""
    path = folder / terrain.file
    readers = {".npy": _from_npy, ".png": _from_png, ".tif": _from_geotiff, ".tiff": _from_geotiff}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise WorldError(f"terrain.file: {terrain.file!r}: must be one of {', '.join(readers)}")
    if not path.is_file():
        raise WorldError(f"terrain.file: {path}: there is no such file")
    try:
        return reader(path, terrain, origin)
    except WorldError:
        raise
    except Exception:  # whatever a broken file does to its parser, in words about its insides
        raise WorldError(f"terrain.file: {path}: can't be read: broken, or no {path.suffix} file of heights") from None


def _from_npy(path: Path, terrain: Terrain, origin: Origin) -> HeightMap:
    grid = np.load(path, allow_pickle=False)
    if grid.ndim != 2 or not np.issubdtype(grid.dtype, np.floating):
        raise WorldError(f"terrain.file: {path}: must be a grid of floats, not {grid.dtype} of shape {grid.shape}")
    return _on_grid(np.asarray(grid, np.float64), path, terrain)


def _from_png(path: Path, terrain: Terrain, origin: Origin) -> HeightMap:
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if picture is None or picture.ndim != 2 or picture.dtype not in (np.uint8, np.uint16):
        raise WorldError(f"terrain.file: {path}: must be a grey picture of 8 or 16 bits")
    if not terrain.high_m > terrain.low_m:
        raise WorldError(f"terrain.high_m = {terrain.high_m:g} must be above low_m = {terrain.low_m:g}")
    share = picture[::-1].astype(np.float64) / np.iinfo(picture.dtype).max
    return _on_grid(terrain.low_m + share * (terrain.high_m - terrain.low_m), path, terrain)


def _on_grid(grid: FloatArray, path: Path, terrain: Terrain) -> HeightMap:
    if grid.size > LARGEST_POINTS:
        raise WorldError(f"terrain.file: {path}: {grid.size} heights; {LARGEST_POINTS} are allowed: thin it out")
    filled = np.where(np.isfinite(grid), grid, terrain.no_data_m)
    try:
        return HeightMap(filled, terrain.north0_m, terrain.east0_m, terrain.spacing_m)
    except ValueError as error:
        raise WorldError(f"terrain.file: {path}: {error}") from None


def _from_geotiff(path: Path, terrain: Terrain, origin: Origin) -> HeightMap:
    """Resampled from degrees to the world's metres, `spacing_m` apart, over the file's whole extent."""
    import tifffile

    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        tags: dict[str, Any] = page.geotiff_tags
        raw = np.asarray(page.asarray(), np.float64)
        told = page.tags.get(NO_DATA_TAG)
        no_data = float(str(told.value).strip("\0 ")) if told is not None else math.nan
    scale, tie = tags.get("ModelPixelScale"), tags.get("ModelTiepoint")
    if int(tags.get("GTModelTypeGeoKey", 0)) != GEOGRAPHIC or scale is None or tie is None:
        raise WorldError(
            f"terrain.file: {path}: must be in longitude and latitude (EPSG:4326), north up: "
            "gdalwarp -t_srs EPSG:4326 makes it so"
        )
    # The tie point belongs to the pixel's corner, unless the raster says that its pixels are points.
    centre = 0.0 if int(tags.get("GTRasterTypeGeoKey", 1)) == 2 else 0.5
    west, north = tie[3] - tie[0] * scale[0], tie[4] + tie[1] * scale[1]
    raw = np.where(raw == no_data, np.nan, raw)
    rows, columns = raw.shape
    projection = MapProjection(origin.lat_deg, origin.lon_deg)
    corners = [
        projection.project(north - row * scale[1], west + column * scale[0])
        for row in (centre, rows - 1 + centre)
        for column in (centre, columns - 1 + centre)
    ]
    # The largest rectangle that lies within the raster on all sides
    south_m, north_m = max(corners[2][0], corners[3][0]), min(corners[0][0], corners[1][0])
    west_m, east_m = max(corners[0][1], corners[2][1]), min(corners[1][1], corners[3][1])
    step = terrain.spacing_m
    counts = int((north_m - south_m) / step) + 1, int((east_m - west_m) / step) + 1
    if min(counts) < 2 or counts[0] * counts[1] > LARGEST_POINTS:
        raise WorldError(
            f"terrain.file: {path}: {counts[0]} x {counts[1]} heights at a spacing_m of {step:g}; "
            f"2 x 2 to {LARGEST_POINTS} in all are allowed: choose another spacing_m"
        )
    grid = np.empty(counts)
    for row in range(counts[0]):
        places = [projection.reproject(south_m + row * step, west_m + column * step) for column in range(counts[1])]
        lat, lon = np.array(places).T
        grid[row] = _bilinear(raw, (north - lat) / scale[1] - centre, (lon - west) / scale[0] - centre)
    above_sea = grid - (terrain.geoid_m if terrain.datum == "ellipsoid" else 0.0)
    heights = np.where(np.isfinite(grid), above_sea - origin.alt_amsl_m, terrain.no_data_m)
    return HeightMap(heights, south_m, west_m, step)


def _bilinear(raw: FloatArray, y: FloatArray, x: FloatArray) -> FloatArray:
    """Heights at rows and columns of a raster, as the nearest beyond it; NaN where one of the four around is.

    Not by cv2.remap: before OpenCV 5 that takes a place to the nearest 32nd of a pixel: slopes become staircases.
    """
    y, x = np.clip(y, 0, raw.shape[0] - 1), np.clip(x, 0, raw.shape[1] - 1)
    row, column = y.astype(np.intp), x.astype(np.intp)
    next_row, next_column = np.minimum(row + 1, raw.shape[0] - 1), np.minimum(column + 1, raw.shape[1] - 1)
    y, x = y - row, x - column
    upper = raw[row, column] * (1.0 - x) + raw[row, next_column] * x
    lower = raw[next_row, column] * (1.0 - x) + raw[next_row, next_column] * x
    return np.asarray(upper * (1.0 - y) + lower * y, np.float64)
