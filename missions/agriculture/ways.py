"""How the UGV comes to a target, as waypoints: straight over open ground, or by headland and rows of a field map.

The *approach point*, where it stops, lies short of the target, in the direction from which it comes; a rover stops a
little before its waypoint by itself (0.25 m), so the target's middle comes to lie before the front wheels and in view
of the mast camera, which sees from its foot to 4.7 m ahead. Among rows that point lies in the lane beside the target.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

from sitl_emu.gcs.geodesy import distance_m, from_metres, to_metres
from sitl_emu.missions.agriculture import row_route
from sitl_emu.missions.agriculture.field_map import FieldMap, Spot

LatLon = tuple[float, float]
"""Degrees."""
Course = tuple[float, float]
"""North and east of a direction, of length 1."""


class Way(NamedTuple):
    """Waypoints, of which the last is where the vehicle stops, and the course on which it comes there."""

    points: tuple[LatLon, ...]
    course: Course

    def length_m(self, here: LatLon) -> float:
        """Of all legs, from here."""
        return sum(distance_m(*a, *b) for a, b in itertools.pairwise((here, *self.points)))

    @property
    def as_text(self) -> str:
        """For events: "latitude longitude" in degrees, a point after the other, with commas between."""
        return ", ".join(f"{lat:.7f} {lon:.7f}" for lat, lon in self.points)


def points_of(text: str) -> list[LatLon]:
    """The points of `Way.as_text`."""
    pairs = (point.split() for point in text.split(","))
    return [(float(lat), float(lon)) for lat, lon in pairs]


def straight(here: LatLon, heading: Course, target: LatLon, short_m: float) -> Way:
    """Over open ground. Where the vehicle is nearer than the approach point already, it stays where it is."""
    north_m, east_m = to_metres(*target, *here)
    away_m = math.hypot(north_m, east_m)
    course = (north_m / away_m, east_m / away_m) if away_m > 0.5 else heading
    return Way((beyond(target, course, -min(short_m, away_m)),), course)


def by_rows(
    field: FieldMap, here: LatLon, heading: Course, target: LatLon, short_m: float, course: Course | None = None
) -> Way:
    """Along the rows. `course`: on which side to come, as near as the rows allow; None for the shortest way.

    Raises NoWay.
    """
    direction = _facing(field, course) if course is not None else 0
    way = row_route.to_target(
        field, field.spot(*here), _facing(field, heading), field.spot(*target), short_m, direction
    )
    return Way(_places(field, way.spots), field.unturned(way.direction, 0.0))


def home(field: FieldMap, here: LatLon, heading: Course, place: LatLon) -> Way:
    """Along the rows and the headland to a place. Raises NoWay."""
    way = row_route.to_place(field, field.spot(*here), _facing(field, heading), field.spot(*place))
    return Way(_places(field, way.spots), heading)


def beyond(place: LatLon, course: Course, by_m: float) -> LatLon:
    """The place that lies so far on from another, on a course."""
    return from_metres(course[0] * by_m, course[1] * by_m, *place)


def _facing(field: FieldMap, course: Course) -> int:
    return row_route.FORWARD if field.turned(*course)[0] >= 0.0 else row_route.BACKWARD


def _places(field: FieldMap, spots: Sequence[Spot]) -> tuple[LatLon, ...]:
    return tuple(field.place(spot) for spot in spots)
