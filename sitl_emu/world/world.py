"""A world at work: what physics, lidar, camera, scoring and maps ask of it.

Made from a description (`description.py`), whoever wrote that; nothing here knows a kind of world by its name.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.dynamics import Vector3
from sitl_emu.world import fires, ground, kinds, rays
from sitl_emu.world.areas import SEEN_BY_LASER, WaterAndFoliage
from sitl_emu.world.atmosphere import density_kg_m3, gravity_m_s2
from sitl_emu.world.camera import OtherVehicle, Scene, body_to_ned
from sitl_emu.world.description import Place, WorldDescription
from sitl_emu.world.home import Home
from sitl_emu.world.loose import Medium
from sitl_emu.world.moving import place_at
from sitl_emu.world.obstacles import Contact, LoosePose
from sitl_emu.world.rays import GROUND, Hits
from sitl_emu.world.solids import NOTHING, Solids
from sitl_emu.world.wind import Wind

FloatArray = npt.NDArray[np.float64]
ANTENNA_M = 0.5
"""How high a radio's antenna is above the body's origin; ours."""
UPWARDS = (0.0, 0.0, -1.0)
"""Of water and, as light falls on it, of foliage."""


class World:
    """One world. `folder` is where the files lie that its description names."""

    def __init__(
        self,
        description: WorldDescription,
        folder: Path,
        terrain: ground.Terrain | None = None,
        is_met: bool = True,
        seed: int | None = None,
    ) -> None:
        """`terrain`: what `terrain.file` is to hold, where there is no such file yet. `is_met` False: it is looked at
        alone, by a camera, which asks neither for rays nor for contacts. `seed`: of its gusts, a run's; None: that
        which it is painted by. Raises WorldError."""
        self.description, self.folder = description, folder
        origin = description.origin
        self.home = Home(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m, 0.0)
        """The world's origin; its heading is of no meaning."""
        self.is_generated = terrain is not None
        """Whether `terrain.file` is to hold the heights of `terrain`, rather than they were read from it."""
        self.terrain: ground.Terrain = terrain if terrain is not None else _terrain(description, folder)
        self.areas: WaterAndFoliage | None = None
        """Its water and foliage."""
        if description.water or any(cover.kind in SEEN_BY_LASER for cover in description.cover):
            self.areas = WaterAndFoliage(description.water, description.cover, self.terrain)
        blows = description.wind
        self.wind = Wind(
            blows.north_m_s, blows.east_m_s, blows.gust_m_s, description.seed if seed is None else seed,
            profile=(blows.profile_exponent, blows.reference_height_m),
            changes=tuple((round(c.at_s * 1e6), c.north_m_s, c.east_m_s) for c in blows.changes),
        )  # fmt: skip

        self._vehicles: list[tuple[str, FloatArray, FloatArray]] = []
        """Names, and their spheres' centres (k, 3) and radii (k,)."""
        self.solids: Solids | None = None
        stands = bool(description.solids) or any(thing.height_m > 0.0 for thing in description.things)
        if description.loose or (stands and is_met):
            self.expect_releases()

    def expect_releases(self) -> None:
        """Make it ready for loose bodies that come later (`Simulation.release`). Raises WorldError without PyBullet."""
        if self.solids is not None:
            return
        described, home = self.description, self.home
        medium = Medium(
            self.terrain.height_m, self.wind, self.areas, gravity_m_s2(home.lat_deg), density_kg_m3(home.alt_amsl_m)
        )
        standing = [thing for thing in described.things if thing.height_m > 0.0]
        self.solids = Solids(described.solids, standing, described.loose, medium, self.folder)

    def put_loose(self, poses: Sequence[LoosePose]) -> None:
        """Put loose bodies where another process's are, also those that were released there. Raises WorldError."""
        if poses:
            self.expect_releases()
            assert self.solids is not None
            self.solids.put_loose(poses)

    def put_vehicles(self, others: Sequence[OtherVehicle]) -> None:
        """Put vehicles where another process's are, as rays meet them: by the spheres of their `Body`."""
        self._vehicles = []
        for name, vehicle, pose, _ in others:
            spheres = vehicle.body.spheres if vehicle.body is not None else ()
            if spheres:
                centres = np.array([sphere.centre_m for sphere in spheres]) @ body_to_ned(pose.q).T
                radii = np.array([sphere.radius_m for sphere in spheres])
                place = np.array((pose.north_m, pose.east_m, pose.down_m))
                self._vehicles.append((name, centres + place, radii))

    @property
    def kind(self) -> str:
        """The kind that made it, or its own name."""
        return self.description.kind or self.description.name

    @property
    def places(self) -> dict[str, Place]:
        """Where vehicles may start, by name; there is at least one."""
        return dict(self.description.places)

    def ground(self, north_m: float, east_m: float) -> float:
        """Height of the terrain, m above the origin; solids are not of it."""
        return self.terrain.height_m(north_m, east_m)

    def raycast(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """Follow (n, 3) rays (NED, m; unit vectors) at a time, up to `reach_m`: ground, solids, standing
        things, water, foliage, and vehicles that were put there."""
        ranges = rays.meet_terrain(self.terrain, origins, directions, reach_m)
        names = np.where(np.isfinite(ranges), GROUND, "").astype(object)
        normals = rays.terrain_normals(self.terrain, origins, directions, ranges)
        if self.solids is not None:
            self.solids.set_time(time_s)
            their_ranges, numbers, their_normals = self.solids.rays(origins, directions, reach_m)
            nearer = (their_ranges < ranges) & (numbers != NOTHING)
            ranges[nearer], normals[nearer] = their_ranges[nearer], their_normals[nearer]
            names[nearer] = [self.solids.names[number] for number in numbers[nearer].tolist()]
        if self.areas is not None:
            for their_ranges, area in self.areas.rays(origins, directions, np.minimum(ranges, reach_m)):
                nearer = their_ranges < ranges
                ranges[nearer], normals[nearer], names[nearer] = their_ranges[nearer], UPWARDS, area.name
        for vehicle, centres, radii in self._vehicles:
            their_ranges, their_normals = rays.meet_spheres(centres, radii, origins, directions, reach_m)
            nearer = their_ranges < ranges
            ranges[nearer], normals[nearer], names[nearer] = their_ranges[nearer], their_normals[nearer], vehicle
        return Hits(ranges, names.tolist(), normals)

    def sees(self, one: Vector3, other: Vector3, time_s: float) -> bool:
        """Whether neither ground nor a solid is between two places (NED, m) at a time.

        Both are taken to be `ANTENNA_M` higher: what stands on the ground is not behind it.
        """
        begin, end = (np.array(place, np.float64) - (0.0, 0.0, ANTENNA_M) for place in (one, other))
        if not rays.over_terrain(self.terrain, begin, end):
            return False
        reach_m = math.dist(one, other)
        if self.solids is None or reach_m < 1e-3:
            return True
        self.solids.set_time(time_s)
        (north, east, down), (n, e, d) = begin.tolist(), ((end - begin) / reach_m).tolist()
        return self.solids.ray((north, east, down), (n, e, d), reach_m) is None

    def echoes(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """What a laser hears of rays: as `raycast`, but that water mirrors slanted ones away."""
        hits = self.raycast(origins, directions, time_s, reach_m)
        if self.areas is not None:
            lost = self.areas.mirrored(hits.name, directions)
            hits.range_m[lost] = math.inf
            return hits._replace(name=["" if away else name for away, name in zip(lost, hits.name, strict=True)])
        return hits

    def contacts(self, body: int, place: Vector3, q: tuple[float, float, float, float], time_s: float) -> list[Contact]:
        """What a body (`Solids.add_body`) touches at a time, of solids and standing things."""
        if self.solids is None:
            return []
        self.solids.set_time(time_s)
        return self.solids.touching(body, place, q, 0.0)

    def truth(self, time_s: float) -> dict[str, Any]:
        """For scoring and maps: the area's outline, and what has a label, where it is then; JSON values.

        Loose bodies are where the simulation has brought them, whatever the time.
        """
        objects = []
        for thing in self.description.things:
            north_m, east_m = place_at(thing, time_s)
            objects.append(
                {
                    "kind": thing.label,
                    "north_m": round(north_m, 3),
                    "east_m": round(east_m, 3),
                    "radius_m": round(thing.radius_m, 3),
                    "target": thing.target,
                }
            )
        made: dict[str, Any] = {"outline": [list(corner) for corner in self.description.area_m], "objects": objects}
        if self.solids is not None and (poses := self.solids.loose_poses()):
            made["loose"] = loose_truth(poses)
        if areas := self._true_areas(time_s):
            made["areas"] = areas
        return made

    def _true_areas(self, time_s: float) -> list[dict[str, Any]]:
        """Water, fires and cover, as missions' `TrueArea` has them."""
        wind = self.description.wind
        waters = [] if self.areas is None else [(each, self.areas.shores(each)) for each in self.areas.water]
        areas: list[dict[str, Any]] = [
            {
                "kind": "water",
                "name": water.name,
                "label": water.label,
                "outline_m": _corners(shore.outline_m),
                "islands_m": [_corners(island) for island in shore.islands_m],
                "level_m": water.level_m,
            }
            for water, shores in waters
            for shore in shores
        ]
        areas += [
            {
                "kind": "fire",
                "name": fire.name,
                "label": fire.label,
                "outline_m": _corners(fires.reached(fire, wind, time_s)),
                "front_m_s": list(fires.front_m_s(fire, wind)),
                "burns_s": fire.burns_s,
            }
            for fire in self.description.fires
        ]
        areas += [
            {
                "kind": cover.kind,
                "name": cover.name,
                "label": cover.label or cover.kind,
                "outline_m": _corners(cover.polygon_m),
            }
            for cover in self.description.cover
        ]
        return areas

    def scene(self, shared_memory: int | None = None) -> Scene:
        """What cameras look at: painted by its kind, where that has a painter of its own. Raises WorldError.

        `shared_memory`: the descriptor of a memfd, at first empty, for what all cameras of this world can share.
        """
        made: Scene | None = self._by_kind("scene", shared_memory)
        return made if made is not None else self._mesh_scene(shared_memory)

    def photo(self) -> npt.NDArray[np.uint8] | None:
        """Its area from straight above, north up, uint8 RGB; None where it has no area."""
        if len(self.description.area_m) == 0:
            return None
        made: npt.NDArray[np.uint8] | None = self._by_kind("photo")
        return made if made is not None else self._mesh_scene().photo_from_above()

    def _mesh_scene(self, shared_memory: int | None = None) -> Any:
        """Drawn from the description alone."""
        from sitl_emu.world.render.scene import MeshScene  # numba, for whoever looks

        return MeshScene(self, self.folder, shared_memory)

    def write_terrain(self, path: Path) -> None:
        """Keep the heights, of a world that was made with some, as .npy. Raises OSError."""
        np.save(path, self.terrain.grid_m)  # type: ignore[attr-defined]

    def _by_kind(self, what: str, *arguments: object) -> Any:
        if not self.description.kind:
            return None
        make = getattr(kinds.kind(self.description.kind), what, None)
        return None if make is None else make(self, *arguments)


def loose_truth(poses: Sequence[LoosePose]) -> list[dict[str, Any]]:
    """Loose bodies as `World.truth` has them: `place_m` north, east and up of the origin."""
    return [
        {"name": described.name, "label": described.label, "place_m": [north, east, -down], "q": list(q)}
        for described, (north, east, down), q, _ in poses
    ]


def _terrain(description: WorldDescription, folder: Path) -> ground.Terrain:
    if not description.terrain.file:
        return ground.FlatGround(description.terrain.height_m)
    from sitl_emu.world import height_files

    return height_files.read(description.terrain, description.origin, folder)


def _corners(polygon: tuple[tuple[float, float], ...]) -> list[list[float]]:
    return [[round(north, 3), round(east, 3)] for north, east in polygon]
