"""A world's truth as GeoJSON (RFC 7946): longitude and latitude (WGS 84), outer rings against the clock, holes with it.

What has an extent is a polygon, what has none a point; heights are properties, in m above mean sea level, as GeoJSON's
own third coordinate would be above the ellipsoid. Digits: 1e-8 degrees are a millimetre.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from sitl_emu.core.attitude import quaternion, rotated, rotation
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.world import polygons
from sitl_emu.world.bullet import read_mesh
from sitl_emu.world.description import Solid, Thing
from sitl_emu.world.moving import place_at
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.world import World

Corner = tuple[float, float]
Feature = dict[str, Any]
ROUND = 24
"""Corners of what is round."""
DIGITS = 8


def collection(world: World, time_s: float, loose: Sequence[LoosePose] | None = None) -> dict[str, Any]:
    """Everything that has a label, where it is at a time; `what` says which list of the world file it comes from.

    `loose`: the loose bodies there are then; None: those of the world, where they are now.
    """
    if loose is None:
        loose = [] if world.solids is None else world.solids.loose_poses()
    described = world.description
    maps = MapProjection(described.origin.lat_deg, described.origin.lon_deg)
    features = [
        *_places(world, maps),
        *_solids(world, maps),
        *_loose(world, maps, loose),
        *_things(world, maps, time_s),
        *_areas(world, maps, time_s),
    ]
    if described.area_m:
        features.insert(0, _polygon(maps, [described.area_m], {"what": "area", "name": described.name}))
    return {"type": "FeatureCollection", "features": features}


def ring(maps: MapProjection, corners: Sequence[Corner], is_hole: bool = False) -> list[list[float]]:
    """A closed ring of [longitude, latitude] of corners (north, east), in the sense that the RFC asks for."""
    clockwise = polygons.area_m2(corners) > 0.0
    ordered = list(corners) if clockwise == is_hole else list(corners)[::-1]
    return [_position(maps, *corner) for corner in (*ordered, ordered[0])]


def _position(maps: MapProjection, north_m: float, east_m: float) -> list[float]:
    lat, lon = maps.reproject(north_m, east_m)
    return [round(lon, DIGITS), round(lat, DIGITS)]


def _polygon(maps: MapProjection, rings: Sequence[Sequence[Corner]], properties: dict[str, Any]) -> Feature:
    made = [ring(maps, corners, is_hole=number > 0) for number, corners in enumerate(rings)]
    return {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": made}, "properties": properties}


def _point(maps: MapProjection, place: Corner, properties: dict[str, Any]) -> Feature:
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": _position(maps, *place)},
        "properties": properties,
    }


def _places(world: World, maps: MapProjection) -> Iterator[Feature]:
    for name, place in world.places.items():
        properties = {"what": "place", "name": name, "heading_deg": place.heading_deg}
        yield _point(maps, (place.north_m, place.east_m), properties)


def _solids(world: World, maps: MapProjection) -> Iterator[Feature]:
    for solid in world.description.solids:
        points = _points(solid, world)
        foot = _foot(points)
        lift = world.ground(solid.north_m, solid.east_m) + solid.above_ground_m + _half_height(solid)
        properties = {
            "what": "solid", "name": solid.name, "label": solid.label,
            "low_amsl_m": _amsl(world, lift - max(d for _, _, d in points)),
            "high_amsl_m": _amsl(world, lift - min(d for _, _, d in points)),
        }  # fmt: skip
        yield _polygon(maps, [foot], properties)


def _loose(world: World, maps: MapProjection, poses: Sequence[LoosePose]) -> Iterator[Feature]:
    for described, (north, east, down), _, _ in poses:
        properties = {"what": "loose", "name": described.name, "label": described.label, "amsl_m": _amsl(world, -down)}
        yield _point(maps, (north, east), properties)


def footprint(solid: Solid, world: World) -> tuple[Corner, ...]:
    """The ground under a solid, as a hull: (north, east) in metres."""
    return _foot(_points(solid, world))


def _foot(points: Sequence[tuple[float, float, float]]) -> tuple[Corner, ...]:
    return polygons.hull((round(float(n), 3), round(float(e), 3)) for n, e, _ in points)


def _half_height(solid: Solid) -> float:
    """What lies between its underside and the point that it is turned about."""
    if solid.box is not None:
        return 0.5 * solid.box.size_m[2]
    return 0.5 * solid.cylinder.height_m if solid.cylinder is not None else 0.0


def _points(solid: Solid, world: World) -> list[tuple[float, float, float]]:
    """Its corners: north and east in the world, down from the point that it is turned about."""
    half = _half_height(solid)
    if solid.box is not None:
        n, e = 0.5 * solid.box.size_m[0], 0.5 * solid.box.size_m[1]
        own = [(i * n, j * e, k * half) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    elif solid.cylinder is not None:
        r = solid.cylinder.radius_m
        turns = np.arange(ROUND) * math.tau / ROUND
        own = [(r * math.cos(a), r * math.sin(a), k * half) for a in turns for k in (-1, 1)]
    elif solid.hull is not None:
        own = [(n, e, -up) for n, e, up in solid.hull.points_m]
    else:
        assert solid.mesh is not None
        own, _ = read_mesh(world.folder / solid.mesh.file, solid.mesh.scale)
    q = quaternion(*(math.radians(angle) for angle in (solid.roll_deg, solid.pitch_deg, solid.heading_deg)))
    turn = rotation(q)
    turned = [rotated(turn, each) for each in own]
    return [(solid.north_m + n, solid.east_m + e, d) for n, e, d in turned]


def _amsl(world: World, up_m: float) -> float:
    return round(world.description.origin.alt_amsl_m + up_m, 3)


def _things(world: World, maps: MapProjection, time_s: float) -> Iterator[Feature]:
    for thing in world.description.things:
        north, east = place_at(thing, time_s)
        low = world.ground(north, east) + thing.above_ground_m
        properties = {
            "what": "thing", "name": thing.name, "label": thing.label, "target": thing.target,
            "radius_m": thing.radius_m, "low_amsl_m": _amsl(world, low),
            "high_amsl_m": _amsl(world, low + thing.height_m), "moves": bool(thing.path),
        }  # fmt: skip
        yield _polygon(maps, [_outline(thing, north, east)], properties)


def _outline(thing: Thing, north: float, east: float) -> list[Corner]:
    """As `description.Thing` has it."""
    made = []
    for k in range(ROUND):
        a = k * math.tau / ROUND
        waves = (amp * math.cos(k * a + phase) for k, (amp, phase) in enumerate(thing.harmonics, start=2))
        r = thing.radius_m * (1.0 + sum(waves))
        made.append((north + r * math.cos(a), east + r * math.sin(a)))
    return made


def _areas(world: World, maps: MapProjection, time_s: float) -> Iterator[Feature]:
    for area in world.truth(time_s).get("areas", []):
        rings = [area["outline_m"], *area.get("islands_m", [])]
        kept = {key: value for key, value in area.items() if not key.startswith(("outline", "islands"))}
        yield _polygon(maps, [[(n, e) for n, e in each] for each in rings], {"what": kept.pop("kind"), **kept})
