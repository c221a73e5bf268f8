"""What stands in a world and can be met: boxes, cylinders, hulls, meshes, and things with a height, some of which move.

Geometry is PyBullet's (FEASIBILITY: a query against 300 hulls 16 µs, a ray 2 µs), used as a collision library alone:
nothing in it has a mass or falls. Its axes are the world's, NED in metres. Loaded only where a world has solids.
"""

import contextlib
import ctypes
import math
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import Quaternion, quaternion
from sitl_emu.vehicles.description import Body
from sitl_emu.vehicles.dynamics import Height, Vector3
from sitl_emu.world.description import Solid, Thing, WorldError
from sitl_emu.world.moving import place_at, velocity_at
from sitl_emu.world.obstacles import Contact

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

RAYS_AT_ONCE = 8192
"""Bullet takes fewer than 16384 (MAX_RAY_INTERSECTION_BATCH_SIZE_STREAMING), and drops the rest without a word."""
NOTHING = -1
STILL = (0.0, 0.0, 0.0)
MESH_SUFFIXES = (".obj", ".stl", ".ply", ".glb", ".gltf")
STEEP_COS = 0.7
"""A surface whose normal leans further from the vertical carries nothing: it is a wall."""


class Solids:
    """All solids of one world at one time."""

    def __init__(self, solids: Sequence[Solid], things: Sequence[Thing], ground: Height, folder: Path) -> None:
        """`folder`: where mesh files lie. Raises WorldError."""
        self._bullet = _bullet()
        self._client: int = self._bullet.connect(self._bullet.DIRECT)
        self._ground = ground
        self.names: dict[int, str] = {}
        """By Bullet's number."""
        self.colours: dict[int, tuple[float, float, float]] = {}
        self._moving: list[tuple[int, Thing]] = []
        self._velocities: dict[int, Vector3] = {}
        self.fastest_m_s = 0.0
        """Of all that moves."""
        self._time_s = math.nan
        for solid in solids:
            self._add(self._shape(solid, folder), _pose(solid, ground), solid.name, solid.colour)
        for thing in things:
            if thing.height_m > 0.0:
                self._add_thing(thing)

    # --- what there is -------------------------------------------------------------------------------------------

    def _add(self, shape: int, pose: tuple[Vector3, Quaternion], name: str, colour: tuple[float, float, float]) -> int:
        place, q = pose
        number: int = self._bullet.createMultiBody(
            0.0, shape, basePosition=place, baseOrientation=_xyzw(q), physicsClientId=self._client
        )
        self.names[number], self.colours[number] = name, colour
        return number

    def _add_thing(self, thing: Thing) -> None:
        bullet = self._bullet
        shape = bullet.createCollisionShape(
            bullet.GEOM_CYLINDER, radius=thing.radius_m, height=thing.height_m, physicsClientId=self._client
        )
        number = self._add(shape, self._standing(thing, 0.0), thing.name or thing.label, thing.colour)
        if thing.path:
            self._moving.append((number, thing))
            legs = zip(thing.path, thing.path[1:], strict=False)
            speeds = [math.hypot(b.north_m - a.north_m, b.east_m - a.east_m) / (b.at_s - a.at_s) for a, b in legs]
            self.fastest_m_s = max(self.fastest_m_s, *speeds, 0.0)

    def _standing(self, thing: Thing, time_s: float) -> tuple[Vector3, Quaternion]:
        north, east = place_at(thing, time_s)
        return (north, east, -self._ground(north, east) - 0.5 * thing.height_m), (1.0, 0.0, 0.0, 0.0)

    def _shape(self, solid: Solid, folder: Path) -> int:
        bullet, client = self._bullet, self._client
        made: int
        if solid.box is not None:
            half = [0.5 * side for side in solid.box.size_m]
            made = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
        elif solid.cylinder is not None:
            radius, height = solid.cylinder.radius_m, solid.cylinder.height_m
            made = bullet.createCollisionShape(
                bullet.GEOM_CYLINDER, radius=radius, height=height, physicsClientId=client
            )
        elif solid.hull is not None:
            points = [(north, east, -up) for north, east, up in solid.hull.points_m]
            made = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=points, physicsClientId=client)
        else:
            assert solid.mesh is not None
            points, triangles = read_mesh(folder / solid.mesh.file, solid.mesh.scale)
            made = bullet.createCollisionShape(
                bullet.GEOM_MESH, vertices=points, indices=triangles, physicsClientId=client
            )
        if made < 0:
            raise WorldError(f"solids {solid.name!r}: its shape can't be built")
        return made

    def add_body(self, body: Body) -> int:
        """A vehicle's spheres; its number for `touching`. It is no obstacle to others."""
        bullet, count = self._bullet, len(body.spheres)
        shape = bullet.createCollisionShapeArray(
            shapeTypes=[bullet.GEOM_SPHERE] * count,
            radii=[sphere.radius_m for sphere in body.spheres],
            halfExtents=[(0.0, 0.0, 0.0)] * count,
            lengths=[0.0] * count,
            fileNames=[""] * count,
            meshScales=[(1.0, 1.0, 1.0)] * count,
            planeNormals=[(0.0, 0.0, 1.0)] * count,
            flags=[0] * count,
            collisionFramePositions=[sphere.centre_m for sphere in body.spheres],
            collisionFrameOrientations=[(0.0, 0.0, 0.0, 1.0)] * count,
            physicsClientId=self._client,
        )
        number: int = bullet.createMultiBody(0.0, shape, physicsClientId=self._client)
        # Not in the way of rays and of others' queries: those are for what the world has.
        bullet.setCollisionFilterGroupMask(number, -1, 0, 0, physicsClientId=self._client)
        return number

    # --- questions ------------------------------------------------------------------------------------------------

    def set_time(self, time_s: float) -> None:
        """Put what moves where it is then."""
        if time_s == self._time_s:
            return
        self._time_s = time_s
        for number, thing in self._moving:
            place, q = self._standing(thing, time_s)
            self._velocities[number] = (*velocity_at(thing, time_s), 0.0)
            self._bullet.resetBasePositionAndOrientation(number, place, _xyzw(q), physicsClientId=self._client)

    def touching(self, body: int, place: Vector3, q: Quaternion, within_m: float) -> list[Contact]:
        """Contacts of a vehicle's spheres, and gaps up to `within_m`, at a pose."""
        bullet, client = self._bullet, self._client
        bullet.resetBasePositionAndOrientation(body, place, _xyzw(q), physicsClientId=client)
        low, high = bullet.getAABB(body, physicsClientId=client)
        low, high = [side - within_m for side in low], [side + within_m for side in high]
        near = bullet.getOverlappingObjects(low, high, physicsClientId=client) or ()
        return [
            Contact(point[6], point[7], -point[8], self.names[number], self._velocities.get(number, STILL))
            for number in sorted({number for number, _ in near} & self.names.keys())
            for point in bullet.getClosestPoints(body, number, within_m, physicsClientId=client)
        ]

    def ray(self, origin: Vector3, direction: Vector3, reach_m: float) -> tuple[float, Vector3] | None:
        """How far a ray goes (m) until it meets a solid, and the solid's normal there; None: it meets none."""
        end = [start + reach_m * part for start, part in zip(origin, direction, strict=True)]
        number, _, share, _, normal = self._bullet.rayTest(origin, end, physicsClientId=self._client)[0]
        return None if number not in self.names else (share * reach_m, normal)

    def rays(
        self, origins: FloatArray, directions: FloatArray, reach_m: float
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Of (n, 3) rays: ranges (n,), inf where nothing is met, Bullet's numbers (n,) or NOTHING, normals (n, 3)."""
        ends = origins + reach_m * directions
        met: list[Any] = []
        for first in range(0, len(origins), RAYS_AT_ONCE):
            part = slice(first, first + RAYS_AT_ONCE)
            met += self._bullet.rayTestBatch(origins[part].tolist(), ends[part].tolist(), physicsClientId=self._client)
        numbers = np.array([each[0] for each in met], np.int64)
        shares = np.array([each[2] for each in met])
        ranges = np.where(numbers == NOTHING, np.inf, shares * reach_m)
        return ranges, numbers, np.array([each[4] for each in met])

    def surface(self, north_m: float, east_m: float, down_m: float) -> tuple[float, float, float] | None:
        """What of a solid lies below a place: its height and rise per metre to north and east; None: the ground."""
        reach = -down_m - self._ground(north_m, east_m)
        if reach <= 0.0:
            return None
        met = self.ray((north_m, east_m, down_m), (0.0, 0.0, 1.0), reach)
        if met is None or -met[1][2] < STEEP_COS:
            return None
        distance, (n, e, d) = met
        return -down_m - distance, n / d, e / d


def read_mesh(path: Path, scale: float) -> tuple[list[Vector3], list[int]]:
    """Corners (NED, m, about the mesh's origin) and triangles of a mesh file. Raises WorldError."""
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise WorldError(f"mesh file {path}: must be one of {', '.join(MESH_SUFFIXES)}")
    import trimesh  # half a second, for worlds with meshes alone

    try:
        loaded = trimesh.load(path, force="mesh")
        corners, triangles = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, int)
    except Exception as error:  # a parser's any
        raise WorldError(f"mesh file {path}: can't be read: {error}") from None
    if not len(triangles):
        raise WorldError(f"mesh file {path}: there are no triangles in it")
    if path.suffix.lower() in {".glb", ".gltf"}:
        # glTF 2.0: y up, z forward, x to the left
        corners = corners[:, [2, 0, 1]]
    ned = corners * (scale, -scale, -scale)
    return [(float(n), float(e), float(d)) for n, e, d in ned], triangles.ravel().tolist()


def _pose(solid: Solid, ground: Height) -> tuple[Vector3, Quaternion]:
    """Bullet counts a box or cylinder from its centre, a hull or mesh from its own origin."""
    q = quaternion(*(math.radians(angle) for angle in (solid.roll_deg, solid.pitch_deg, solid.heading_deg)))
    lift = ground(solid.north_m, solid.east_m) + solid.above_ground_m
    if solid.box is not None:
        lift += 0.5 * solid.box.size_m[2]
    elif solid.cylinder is not None:
        lift += 0.5 * solid.cylinder.height_m
    return (solid.north_m, solid.east_m, -lift), q


def _xyzw(q: Quaternion) -> tuple[float, float, float, float]:
    return q[1], q[2], q[3], q[0]


def _bullet() -> Any:
    try:
        with _quiet():
            import pybullet
    except ImportError:
        raise WorldError(
            "this world has solids, which need PyBullet: `pip install pybullet` (it has wheels up to Python 3.11)"
        ) from None
    return pybullet


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """PyBullet prints the time that it was built at when it is imported, by C's printf, which keeps it in a buffer."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
