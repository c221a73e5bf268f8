"""Follows a run's folder: what has come into its files since they were read last.

A run that is over is read in one go; one that goes on, again and again. Times are simulated seconds since its start.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.gcs.tlog import TlogReader
from sitl_emu.run import kept_frames, scenario, worlds
from sitl_emu.run.configs import CameraDescription
from sitl_emu.run.recorder import TRUTH_HEADER
from sitl_emu.run.scenario_parts.vehicle import VehiclePart
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.view.growing import GrowingFile, GrowingLines
from sitl_emu.run.view.telemetry import TelemetryReader, Told
from sitl_emu.vehicles import VehicleError
from sitl_emu.world import description

SUMMARY, SCENARIO = "summary.json", "scenario.yaml"
TRUTH_FIELDS = len(TRUTH_HEADER.split(","))


class TrueState(NamedTuple):
    """A row of truth-VEHICLE.csv: NED from the world's origin, velocity, attitude (w, x, y, z; body FRD to NED)."""

    time_s: float
    position_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]
    q: tuple[float, float, float, float]


class KeptFrame(NamedTuple):
    """A frame that lies in the folder."""

    time_s: float
    feed: str
    """"camera", "depth" or "lidar"."""
    path: Path


class Looked(NamedTuple):
    """What a companion's detector found in a frame (`missions/companion/detection_log.py`)."""

    time_s: float
    found: list[list[Any]]
    candidates: list[list[Any]] | None


class OfVehicle(NamedTuple):
    """What is new of one vehicle."""

    truth: list[TrueState]
    told: list[Told]
    frames: list[KeptFrame]
    looked: list[Looked]


class Reading(NamedTuple):
    """What is new."""

    vehicles: dict[str, OfVehicle]
    events: list[dict[str, Any]]
    """As events.jsonl has them."""
    summary: dict[str, Any] | None
    """What summary.json says, when the run is over; nothing comes after."""


def camera_of(vehicle: VehiclePart) -> CameraDescription | None:
    """A vehicle's camera; None where it has none, or its model's folder has gone since."""
    try:
        return vehicle.camera_description
    except VehicleError:
        return None


class RunReader:
    """Reads one run's folder."""

    def __init__(self, folder: Path) -> None:
        """Raises Trouble where it is no run's folder."""
        if not folder.is_dir():
            raise Trouble(
                f"{folder}: there is no such folder; name one that `sitl-emu run` has made, runs/… by default"
            )
        for name in (SCENARIO, worlds.KEPT_AS):
            if not (folder / name).is_file():
                raise Trouble(f"{folder}: no folder of a run: it has no {name}")
        self.folder = folder
        self.scenario = scenario.load(folder / SCENARIO)
        try:
            self.world = description.load(folder / worlds.KEPT_AS)
        except description.WorldError as error:
            raise Trouble(str(error)) from None
        self._events = GrowingLines(folder / "events.jsonl")
        start_us = self.scenario.start_us
        self._vehicles = {each.name: _VehicleReader(folder, each.name, start_us) for each in self.scenario.vehicles}

    def read(self) -> Reading:
        """What is new since the last time."""
        summary = self._summary()
        vehicles = {name: reader.read() for name, reader in self._vehicles.items()}
        return Reading(vehicles, self._events.objects(), summary)

    def _summary(self) -> dict[str, Any] | None:
        """Read first: when it is there, all the rest is."""
        try:
            made = json.loads((self.folder / SUMMARY).read_text())
        except (OSError, ValueError):
            return None
        return made if isinstance(made, dict) else None


class _VehicleReader:
    def __init__(self, folder: Path, name: str, start_us: int) -> None:
        self._truth = GrowingLines(folder / f"truth-{name}.csv")
        self._detections = GrowingLines(folder / f"{name}-detections.jsonl")
        self._feeds = [_FeedReader(folder, name, feed) for feed in ("camera", "depth", "lidar")]
        self._logs = [
            _LogReader(folder / f"{name}-gcs.tlog", start_us, TelemetryReader()),
            _LogReader(folder / f"{name}-onboard.tlog", start_us, TelemetryReader(route_alone=True)),
        ]

    def read(self) -> OfVehicle:
        told = sorted((one for log in self._logs for one in log.read()), key=lambda one: one.time_s)
        frames = [frame for feed in self._feeds for frame in feed.read()]
        looked = [
            Looked(one["time_s"], one["found"], one.get("candidates"))
            for one in self._detections.objects()
            if "time_s" in one and "found" in one
        ]
        return OfVehicle([row for line in self._truth.read() for row in _true_state(line)], told, frames, looked)


def _true_state(line: str) -> Iterator[TrueState]:
    cells = line.split(",")
    if len(cells) != TRUTH_FIELDS or line == TRUTH_HEADER.strip():
        return
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        return
    if not all(map(math.isfinite, numbers)):
        return
    time_s, n, e, d, vn, ve, vd, qw, qx, qy, qz = numbers
    yield TrueState(time_s, (n, e, d), (vn, ve, vd), (qw, qx, qy, qz))


class _LogReader:
    def __init__(self, path: Path, start_us: int, telemetry: TelemetryReader) -> None:
        self._file, self._start_us, self._telemetry = GrowingFile(path), start_us, telemetry
        self._records = TlogReader()

    def read(self) -> Iterator[Told]:
        for unix_us, frame in self._records.feed(self._file.read()):
            told = self._telemetry.read((unix_us - self._start_us) / 1e6, frame)
            if told is not None:
                yield told


class _FeedReader:
    def __init__(self, folder: Path, vehicle: str, feed: str) -> None:
        self._folder, self._feed = kept_frames.folder_of(folder, vehicle, feed), feed
        self._seen = set[str]()

    def read(self) -> list[KeptFrame]:
        """Those that are new, in the order of their times."""
        if not self._folder.is_dir():
            return []
        new = [path for path in self._folder.iterdir() if path.stem.isdigit() and path.name not in self._seen]
        self._seen.update(path.name for path in new)
        return [KeptFrame(int(path.stem) / 1e6, self._feed, path) for path in sorted(new, key=lambda p: int(p.stem))]
