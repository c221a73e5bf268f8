"""Where the loose bodies of a run were: those of its world, and the parcels that were released in it.

The run's folder holds it all: loose.csv the poses (`recorder.py`), the world file and scenario.yaml what each body is.
"""

import bisect
import contextlib
import csv
import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from sitl_emu import vehicles
from sitl_emu.run import models
from sitl_emu.run.recorder import LOOSE, LOOSE_COLUMNS
from sitl_emu.run.scenario import ScenarioError, load
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.description import Loose
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.parcels import loose_parcel, parcel_name
from sitl_emu.world.world import World


class At(NamedTuple):
    """A body's pose from a time on."""

    time_s: float
    pose: LoosePose


class LooseInRun:
    """The loose bodies of one run, at any of its times."""

    def __init__(self, folder: Path, world: World) -> None:
        """`world`: the run's, its loose bodies where they began. Raises Trouble for a loose.csv that is none, or that
        can't be read."""
        started = [] if world.solids is None else world.solids.loose_poses()
        self._tracks = {pose.described.name: [At(-math.inf, pose)] for pose in started}
        parcels = _parcels(folder)
        self.released: dict[str, Loose] = {}
        """Parcels that were let go, by name."""
        self.unknown = list[str]()
        """What moved, of which nothing says what it is."""
        for time_s, name, place, q in _rows(folder / LOOSE):
            if name not in self._tracks and name in parcels:
                self.released[name], self._tracks[name] = parcels[name], []
            if name in self._tracks:
                described = self.released[name] if name in self.released else self._tracks[name][0].pose.described
                self._tracks[name].append(At(time_s, LoosePose(described, place, q)))
            elif name not in self.unknown:
                self.unknown.append(name)

    def at(self, time_s: float) -> list[LoosePose]:
        """Those that were there at a time. `World.put_loose` takes no parcel away again: put them by rising times."""
        made = list[LoosePose]()
        for track in self._tracks.values():
            if number := bisect.bisect_right(track, time_s, key=lambda each: each.time_s):
                made.append(track[number - 1].pose)
        return made


def _rows(path: Path) -> Iterator[tuple[float, str, tuple[float, float, float], tuple[float, float, float, float]]]:
    """Time, name, place (NED) and attitude of each line; none where there is no such file. Raises Trouble.

    A last line that does not end is being written.
    """
    if not path.is_file():
        return
    try:
        whole, end, _ = path.read_text(encoding="utf-8").rpartition("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise Trouble(f"{path}: can't be read: {error}") from None
    table = csv.DictReader(io.StringIO(whole + end))
    for row in table:
        try:
            time_s, north, east, down, w, x, y, z = (float(row[key]) for key in LOOSE_COLUMNS if key != "name")
            yield time_s, row["name"], (north, east, down), (w, x, y, z)
        except (KeyError, TypeError, ValueError):
            raise Trouble(f"{path}: line {table.line_num}: must be {','.join(LOOSE_COLUMNS)}") from None


def _parcels(folder: Path) -> dict[str, Loose]:
    """What hung on the vehicles of a run, by the names that it has once it falls; nothing of models that are gone."""
    made = dict[str, Loose]()
    with contextlib.suppress(ScenarioError):
        for vehicle in load(folder / "scenario.yaml").vehicles:
            if vehicle.parcel is None:
                continue
            name = parcel_name(vehicle.name)
            with contextlib.suppress(vehicles.UnknownModel, vehicles.VehicleError):
                parcel = models.as_set(vehicle.model_data).parcel
                assert parcel is not None, "it was given one"
                made[name] = loose_parcel(name, parcel)
    return made
