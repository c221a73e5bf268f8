"""What the page is told, as JSON: the facts of a run, and rows of what happens in it.

`facts`, once: name, seed, vehicles, the world's name, outline and origin. `rows`, whenever something is new; each part
is left out where it has nothing:

========== ==========================================================================================
track      by vehicle: [time_s, north_m, east_m, up_m, heading_deg, speed_m_s], five a second
state      by vehicle: [time_s, {field: value}], the fields of `telemetry.TelemetryReader` that changed
route      by vehicle: [time_s, [[north_m, east_m, alt_m, is_relative, command, item], ...]]
home       by vehicle: [time_s, north_m, east_m]
frames     by vehicle: [time_s, path], of the camera
looked     by vehicle: [time_s, [[label, score, x, y, w, h], ...]], of frames that show something
candidates by vehicle: [time_s, [[label, score, north_m, east_m, sigma_m, sightings], ...]]
events     as events.jsonl has them, with `north_m` and `east_m` where they name a place; STATUSTEXT and PX4's too
over       outcome, lines, and what missions say of colours and marks, when the run is over
========== ==========================================================================================
"""

import math
from collections.abc import Iterable
from typing import Any

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.run.scenario_parts.vehicle import VehiclePart
from sitl_emu.run.view.reading import OfVehicle, Reading, RunReader, camera_of
from sitl_emu.run.view.telemetry import HomeAt, Route, State, Text

Json = dict[str, Any]
TRACK_EVERY = 2
"""Of the rows of the true track, which come ten times a second."""


def facts(reader: RunReader) -> Json:
    """What does not change."""
    given, world = reader.scenario, reader.world
    return {
        "scenario": given.name,
        "description": given.description,
        "seed": given.seed,
        "folder": str(reader.folder),
        "time_limit_s": given.time_limit_s,
        "world": {
            "name": world.name,
            "origin": [world.origin.lat_deg, world.origin.lon_deg, world.origin.alt_amsl_m],
            "outline_m": [list(corner) for corner in world.area_m],
        },
        "vehicles": [
            {"name": each.name, "model": each.model.rsplit("/", 1)[-1], "camera": _picture_size(each)}
            for each in given.vehicles
        ],
    }


def _picture_size(vehicle: VehiclePart) -> list[int] | None:
    """Width and height in pixels, in which detections are told."""
    camera = camera_of(vehicle)
    return None if camera is None else [camera.width_px, camera.height_px]


class Rows:
    """Makes rows of readings, in one run's metres."""

    def __init__(self, reader: RunReader) -> None:
        origin = reader.world.origin
        self._project = MapProjection(origin.lat_deg, origin.lon_deg).project
        self._folder = reader.folder
        self._skipped = dict.fromkeys((each.name for each in reader.scenario.vehicles), 0)

    def of(self, reading: Reading) -> Json:
        """Everything that is new; empty where nothing is."""
        made: Json = {}
        events = [self._placed(event) for event in reading.events]
        for name, vehicle in reading.vehicles.items():
            events += [_text_event(name, one) for one in vehicle.told if isinstance(one, Text)]
            for part, rows in self._of_vehicle(name, vehicle).items():
                if rows:
                    made.setdefault(part, {})[name] = rows
        if events:
            made["events"] = sorted(events, key=lambda event: event["time_s"])
        return made

    def _of_vehicle(self, name: str, vehicle: OfVehicle) -> dict[str, list[Any]]:
        told = vehicle.told
        frames = [one for one in vehicle.frames if one.feed == "camera"]
        return {
            "track": list(self._track(name, vehicle)),
            "state": [[round(one.time_s, 2), one.fields] for one in told if isinstance(one, State)],
            "route": [[round(one.time_s, 2), self._route(one)] for one in told if isinstance(one, Route)],
            "home": [
                [round(one.time_s, 2), *self._metres(one.lat_deg, one.lon_deg)]
                for one in told
                if isinstance(one, HomeAt)
            ],
            "frames": [[one.time_s, one.path.relative_to(self._folder).as_posix()] for one in frames],
            "looked": [[one.time_s, one.found] for one in vehicle.looked if one.found],
            "candidates": [
                [one.time_s, [self._candidate(*each) for each in one.candidates]]
                for one in vehicle.looked
                if one.candidates is not None
            ],
        }

    def _track(self, name: str, vehicle: OfVehicle) -> Iterable[list[float]]:
        for row in vehicle.truth:
            self._skipped[name] += 1
            if self._skipped[name] % TRACK_EVERY == 0:
                north, east, down = row.position_m
                w, x, y, z = row.q
                heading = math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))) % 360.0
                speed = math.hypot(*row.velocity_m_s[:2])
                yield [row.time_s, round(north, 2), round(east, 2), round(-down, 2), round(heading, 1), round(speed, 2)]

    def _route(self, route: Route) -> list[list[Any]]:
        return [
            [*self._metres(one.lat_deg, one.lon_deg), one.alt_m, one.is_relative, one.command, one.item]
            for one in route.waypoints
        ]

    def _candidate(self, label: str, score: float, lat_deg: float, lon_deg: float, *rest: float) -> list[Any]:
        return [label, score, *self._metres(lat_deg, lon_deg), *rest]

    def _metres(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        north_m, east_m = self._project(lat_deg, lon_deg)
        return round(north_m, 2), round(east_m, 2)

    def _placed(self, event: Json) -> Json:
        lat, lon = event.get("lat_deg"), event.get("lon_deg")
        if not isinstance(lat, float | int) or not isinstance(lon, float | int):
            return event
        north_m, east_m = self._metres(lat, lon)
        return {**event, "north_m": north_m, "east_m": east_m}


def _text_event(vehicle: str, text: Text) -> Json:
    return {
        "time_s": round(text.time_s, 2),
        "vehicle": vehicle,
        "event": text.kind,
        "severity": text.severity,
        "text": text.text,
    }
