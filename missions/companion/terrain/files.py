"""A terrain map as a file: a GeoTIFF, which GIS programs and our own worlds (`terrain: {file: …}`) read; a picture."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.terrain.terrain_map import Grid, TerrainMap

PIXEL_SCALE, TIE_POINT, GEO_KEYS, NO_DATA = 33550, 33922, 34735, 42113
"""TIFF tags of OGC GeoTIFF 1.1; the last is GDAL's."""
WGS84 = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326)
"""GeoKeyDirectory: model geographic, a pixel is an area, EPSG:4326."""
UNKNOWN_COLOUR = "#cfcfcf"
"""A grey that no scale of colours below holds."""


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


def draw_heights(axes: Any, terrain: TerrainMap) -> None:
    """The heights, on matplotlib axes, as the maps of a run's report are drawn."""
    _draw(axes, terrain, terrain.means_m(), "height above the origin, m", cmap="viridis")
    axes.set_title(f"{np.isfinite(terrain.means_m()).mean():.0%} of the area mapped; grey: not known", fontsize=9)


def draw_sigmas(axes: Any, terrain: TerrainMap) -> None:
    """How well each height is known."""
    _draw(axes, terrain, terrain.sigmas_m(), "one sigma, m", cmap="Oranges", vmin=0.0)


def draw_errors(axes: Any, terrain: TerrainMap, truth_m: Callable[[float, float], float]) -> None:
    """Mapped less true heights, with what they come to."""
    north, east = terrain.centres_m()
    true = np.vectorize(truth_m, otypes=[np.float64])(north, east)
    off, errors = terrain.means_m() - true, terrain.errors(truth_m)
    most = max(errors.worst_m, 1e-3) if np.isfinite(errors.worst_m) else 1.0
    _draw(axes, terrain, off, "mapped less true height, m", cmap="RdBu_r", vmin=-most, vmax=most)
    shown = f"RMS {errors.rms_m:.2f} m, in the mean {errors.bias_m:+.2f} m, at most {errors.worst_m:.2f} m"
    axes.set_title(shown, fontsize=9)


def write_picture(path: Path, terrain: TerrainMap, truth_m: Callable[[float, float], float] | None = None) -> None:
    """A PNG of heights and sigmas side by side, and of the errors where the truth is known."""
    parts: list[Callable[[Any, TerrainMap], None]] = [draw_heights, draw_sigmas]
    if truth_m is not None:
        parts.append(lambda axes, one: draw_errors(axes, one, truth_m))
    figure = Figure(figsize=(6.0 * len(parts), 5.5), layout="constrained")
    for number, draw in enumerate(parts, 1):
        draw(figure.add_subplot(1, len(parts), number), terrain)
    figure.savefig(path, format="png", dpi=110)


def _draw(axes: Any, terrain: TerrainMap, values: Grid, label: str, **look: Any) -> None:
    rows, columns = terrain.shape
    east_m, north_m = terrain.west_m + columns * terrain.resolution_m, terrain.south_m + rows * terrain.resolution_m
    axes.set_facecolor(UNKNOWN_COLOUR)
    extent = (terrain.west_m, east_m, terrain.south_m, north_m)
    image = axes.imshow(np.ma.masked_invalid(values), origin="lower", extent=extent, interpolation="nearest", **look)
    axes.figure.colorbar(image, ax=axes, label=label, shrink=0.8)
    axes.set_aspect("equal")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
