"""A terrain map as a file: a GeoTIFF, which GIS programs and our own worlds (`terrain: {file: …}`) read."""

from pathlib import Path

import numpy as np

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.terrain.terrain_map import Grid, TerrainMap

PIXEL_SCALE, TIE_POINT, GEO_KEYS, NO_DATA = 33550, 33922, 34735, 42113
"""TIFF tags of OGC GeoTIFF 1.1; the last is GDAL's."""
WGS84 = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326)
"""GeoKeyDirectory: model geographic, a pixel is an area, EPSG:4326."""


def write_geotiff(
    path: Path, terrain: TerrainMap, lat_deg: float, lon_deg: float, alt_amsl_m: float,
    grids: tuple[Grid, Grid] | None = None,
) -> None:  # fmt: skip
    """Heights above mean sea level, and on a second page one sigma of each, as 32-bit floats; NaN where not known.

    (`lat_deg`, `lon_deg`, `alt_amsl_m`): the map's origin. `grids`: other heights over it, and their sigmas, of the
    map's cells (rows, columns). The plane is that of `gcs.geodesy`, in which degrees are evenly spaced, so nothing is
    resampled.
    """
    import tifffile  # takes a tenth of a second, which nobody waits for who writes no map

    rows, columns = terrain.shape
    north_m, east_m = (
        terrain.south_m + rows * terrain.resolution_m,
        terrain.west_m + columns * terrain.resolution_m,
    )
    north, west = from_metres(north_m, terrain.west_m, lat_deg, lon_deg)
    south, east = from_metres(terrain.south_m, east_m, lat_deg, lon_deg)
    tags = [
        (PIXEL_SCALE, "d", 3, ((east - west) / columns, (north - south) / rows, 0.0)),
        (TIE_POINT, "d", 6, (0.0, 0.0, 0.0, west, north, 0.0)),
        (GEO_KEYS, "H", len(WGS84), WGS84),
        (NO_DATA, "s", 0, "nan"),
    ]
    with tifffile.TiffWriter(path) as file:
        heights_m, sigmas_m = grids or (terrain.means_m(), terrain.sigmas_m())
        for grid, what in ((heights_m + alt_amsl_m, "height above mean sea level, m"), (sigmas_m, "one sigma, m")):
            file.write(grid[::-1].astype(np.float32), extratags=tags, description=what, metadata=None)
