"""The terrain map of a run against the truth: over home, of what is seen of the ground, without what stands on it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.companion.terrain import files
from sitl_emu.missions.companion.terrain.terrain_map import Bounds, TerrainMap
from sitl_emu.missions.disaster.terrain import mapped_terrain
from sitl_emu.missions.scoring import RunRecord, TrueArea

ORIGIN, AMSL_M = (47.0, 8.0), 480.0
HOME_M = (2.0, 3.0)
GROUND_M = 1.0
"""Level."""
POND = TrueArea(
    "water", "pond", "water", ((10.0, 0.0), (20.0, 0.0), (20.0, 20.0), (10.0, 20.0)),
    islands_m=(((14.0, 4.0), (16.0, 4.0), (16.0, 8.0), (14.0, 8.0)),), level_m=1.5,
)  # fmt: skip
HOUSE = TrueArea("solid", "house", "house", ((0.0, 10.0), (6.0, 10.0), (6.0, 16.0), (0.0, 16.0)))


def record(folder: Path, heights_m: np.ndarray[Any, np.dtype[np.float64]], *areas: TrueArea, off_m: float) -> RunRecord:
    """Of a run whose vehicle has mapped these heights over home (north, east; from the origin on), home's own wrong."""
    home = from_metres(*HOME_M, *ORIGIN)
    rows, columns = heights_m.shape
    terrain = TerrainMap(Bounds(-HOME_M[0], -HOME_M[1], rows - HOME_M[0], columns - HOME_M[1]))
    home_amsl_m = AMSL_M + GROUND_M + off_m
    files.write_geotiff(folder / "map.tif", terrain, *home, home_amsl_m, (heights_m, np.ones(heights_m.shape)))
    told = {
        "event": "terrain_map", "vehicle": "uas", "file": "map.tif",
        "home_lat_deg": home[0], "home_lon_deg": home[1], "home_amsl_m": home_amsl_m,
    }  # fmt: skip
    return RunRecord([told], (), {}, lambda lat, lon: to_metres(lat, lon, *ORIGIN), areas, lambda *_: GROUND_M, folder,
                     AMSL_M)  # fmt: skip


def figures(folder: Path, heights_m: np.ndarray[Any, np.dtype[np.float64]], *areas: TrueArea) -> dict[str, Any]:
    got = mapped_terrain(record(folder, heights_m, *areas, off_m=0.7))
    assert got is not None
    return got


def test_heights_count_over_home_and_home_itself_apart(tmp_path: Path) -> None:
    heights_m = np.zeros((20, 20))
    heights_m[0, 0] = np.nan
    heights_m[5, 5] = 0.4
    got = figures(tmp_path, heights_m)
    assert (got["home_off_m"], got["worst_m"]) == (pytest.approx(0.7, abs=0.01), pytest.approx(0.4, abs=0.01))
    assert got["rms_m"] == pytest.approx(0.02, abs=0.001)
    assert got["known_share"] == pytest.approx(1.0 - 1.0 / 400.0, abs=0.001)


def test_water_is_as_high_as_its_surface_and_an_island_in_it_as_the_ground(tmp_path: Path) -> None:
    heights_m = np.zeros((20, 20))
    heights_m[10:] = 0.5
    heights_m[14:16, 4:8] = 0.0
    assert figures(tmp_path, heights_m, POND)["worst_m"] == pytest.approx(0.0, abs=0.01)
    bottom = figures(tmp_path, np.zeros((20, 20)), POND)
    assert (bottom["worst_m"], bottom["bias_m"]) == (pytest.approx(0.5, abs=0.01), pytest.approx(-0.24, abs=0.01))
    dry = POND._replace(level_m=0.5)
    assert figures(tmp_path, np.zeros((20, 20)), dry)["worst_m"] == pytest.approx(0.0, abs=0.01), "under the ground"


def test_roofs_and_what_lies_beside_walls_is_not_judged(tmp_path: Path) -> None:
    heights_m = np.zeros((20, 20))
    heights_m[0:7, 9:17] = 5.0
    assert figures(tmp_path, heights_m, HOUSE)["worst_m"] == pytest.approx(0.0, abs=0.01)
    assert figures(tmp_path, heights_m)["worst_m"] == pytest.approx(5.0, abs=0.01)


def test_a_run_without_a_map_or_whose_file_is_gone_has_no_figures(tmp_path: Path) -> None:
    there = record(tmp_path, np.zeros((20, 20)), off_m=0.0)
    assert mapped_terrain(there._replace(events=())) is None
    (tmp_path / "map.tif").unlink()
    assert mapped_terrain(there) is None
