"""What can be met in a world: boxes, cylinders, hulls, meshes; things with a height, some of which move; loose bodies.

Geometry is PyBullet's (`bullet.py`). What stands or moves by itself has no mass in it; what falls is `loose.py`'s.
"""

import math
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import Quaternion, quaternion, rotated, rotation
from sitl_emu.vehicles.description import Body
from sitl_emu.vehicles.dynamics import Height, Vector3
from sitl_emu.world import bullet as engine
from sitl_emu.world.description import Cylinder, Loose, Solid, Thing, WorldError
from sitl_emu.world.description.checks import check_shape
from sitl_emu.world.loose import LooseBodies, LooseBody, Medium, shape_of
from sitl_emu.world.moving import place_at, velocity_at
from sitl_emu.world.obstacles import Contact, LoosePose

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

RAYS_AT_ONCE = 8192
"""Bullet takes fewer than 16384 (MAX_RAY_INTERSECTION_BATCH_SIZE_STREAMING), and drops the rest without a word."""
NOTHING = -1
STILL = (0.0, 0.0, 0.0)
STEEP_COS = 0.7
"""A surface whose normal leans further from the vertical carries nothing: it is a wall."""


class Solids:
    """All of one world at one time."""

    def __init__(
        self, solids: Sequence[Solid], things: Sequence[Thing], loose: Sequence[Loose], medium: Medium, folder: Path
    ) -> None:
        """`folder`: where mesh files lie. Raises WorldError."""
        self._bullet = engine.load("solids, loose bodies, or things with a height")
        self._client: int = self._bullet.connect(self._bullet.DIRECT)
        weakref.finalize(self, self._bullet.disconnect, physicsClientId=self._client)  # 30 MB, and Bullet has 1024
        self._ground, self._folder = medium.ground, folder
        self.names: dict[int, str] = {}
        """By Bullet's number."""
        self.colours: dict[int, tuple[float, float, float]] = {}
        self._moving: list[tuple[int, Thing]] = []
        self._velocities: dict[int, Vector3] = {}
        self._fastest_m_s = 0.0
        self._time_s = math.nan
        for solid in solids:
            shape = engine.shape(self._bullet, self._client, solid, folder)
            self._add(shape, _pose(solid, self._ground), solid.name, solid.colour)
        for thing in things:
            if thing.height_m > 0.0:
                self._add_thing(thing)
        self._loose = LooseBodies(self._bullet, self._client, medium)
        self._by_name: dict[str, LooseBody] = {}
        for each in loose:
            self._add_loose(each, *_pose(each, self._ground))

    @property
    def fastest_m_s(self) -> float:
        """Of all that moves."""
        return max(self._fastest_m_s, self._loose.fastest_m_s)

    @property
    def awake(self) -> bool:
        """Whether a loose body moves."""
        return self._loose.awake

    # --- what there is -------------------------------------------------------------------------------------------

    def _add(self, shape: int, pose: tuple[Vector3, Quaternion], name: str, colour: tuple[float, float, float]) -> int:
        place, q = pose
        number: int = self._bullet.createMultiBody(
            0.0, shape, basePosition=place, baseOrientation=engine.xyzw(q), physicsClientId=self._client
        )
        # Bullet multiplies both sides': what falls on it is what says how it bounces and slides
        self._bullet.changeDynamics(number, -1, restitution=1.0, lateralFriction=1.0, physicsClientId=self._client)
        self.names[number], self.colours[number] = name, colour
        return number

    def _add_loose(self, described: Loose, origin: Vector3, q: Quaternion) -> LooseBody:
        shape = shape_of(self._bullet, self._client, described, self._folder)
        n, e, d = rotated(rotation(q), shape.centre_m)
        body = self._loose.add(described, shape, (origin[0] + n, origin[1] + e, origin[2] + d), q)
        self.names[body.number], self.colours[body.number] = described.name, described.colour
        self._by_name[described.name] = body
        return body

    def _add_thing(self, thing: Thing) -> None:
        shape = engine.cylinder(self._bullet, self._client, Cylinder(thing.radius_m, thing.height_m))
        number = self._add(shape, self._standing(thing, 0.0), thing.name or thing.label, thing.colour)
        if thing.path:
            self._moving.append((number, thing))
            legs = zip(thing.path, thing.path[1:], strict=False)
            speeds = [math.hypot(b.north_m - a.north_m, b.east_m - a.east_m) / (b.at_s - a.at_s) for a, b in legs]
            self._fastest_m_s = max(self._fastest_m_s, *speeds, 0.0)

    def _standing(self, thing: Thing, time_s: float) -> tuple[Vector3, Quaternion]:
        north, east = place_at(thing, time_s)
        lift = self._ground(north, east) + thing.above_ground_m + 0.5 * thing.height_m
        return (north, east, -lift), (1.0, 0.0, 0.0, 0.0)

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

    # --- loose bodies --------------------------------------------------------------------------------------------

    def step(self, now_us: int) -> None:
        """Advance loose bodies by a tick of 4 ms, to a time."""
        if self._loose.bodies:
            self.set_time(now_us * 1e-6)
            self._loose.step(now_us, [number for number, _ in self._moving])

    def release(self, described: Loose, place: Vector3, q: Quaternion, velocity: Vector3, spin: Vector3) -> None:
        """Let a new loose body go from a pose (its centre of mass; NED), with a velocity and a spin (rad/s).

        Raises WorldError for a name that is taken, and a shape that can't be.
        """
        if described.name in self.names.values():
            raise WorldError(f"release: name = {described.name!r}: another has this name")
        check_shape(described, "release:")
        body = self._add_loose(described, place, q)
        self._put(body, place, q)
        body.set_velocity(velocity, spin)

    def loose_body(self, name: str) -> LooseBody | None:
        """The loose body of a name; None: what has this name is none."""
        return self._by_name.get(name)

    def lies_still(self, name: str) -> bool:
        """Whether a loose body has been at rest for a while, half a second. Raises KeyError."""
        return self._by_name[name].lies_still

    def loose_poses(self) -> list[LoosePose]:
        """Where all loose bodies are."""
        return [
            LoosePose(body.described, (body.north_m, body.east_m, body.down_m), body.q, body.shape.centre_m)
            for body in self._loose.bodies
        ]

    def put_loose(self, poses: Sequence[LoosePose]) -> None:
        """Put loose bodies where another process's are: those of the description, and what was released there."""
        for described, place, q, _ in poses:
            body = self._by_name.get(described.name) or self._add_loose(described, place, q)
            self._put(body, place, q)

    def _put(self, body: LooseBody, place: Vector3, q: Quaternion) -> None:
        self._bullet.resetBasePositionAndOrientation(body.number, place, engine.xyzw(q), physicsClientId=self._client)
        body.read()

    # --- questions ------------------------------------------------------------------------------------------------

    def set_time(self, time_s: float) -> None:
        """Put what moves where it is then."""
        if time_s == self._time_s:
            return
        self._time_s = time_s
        for number, thing in self._moving:
            place, q = self._standing(thing, time_s)
            self._velocities[number] = (*velocity_at(thing, time_s), 0.0)
            self._bullet.resetBasePositionAndOrientation(number, place, engine.xyzw(q), physicsClientId=self._client)

    def touching(self, body: int, place: Vector3, q: Quaternion, within_m: float) -> list[Contact]:
        """Contacts of a vehicle's spheres, and gaps up to `within_m`, at a pose."""
        bullet, client = self._bullet, self._client
        bullet.resetBasePositionAndOrientation(body, place, engine.xyzw(q), physicsClientId=client)
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


def _pose(solid: Solid, ground: Height) -> tuple[Vector3, Quaternion]:
    """Bullet counts a box or cylinder from its centre, a hull or mesh from its own origin."""
    q = quaternion(*(math.radians(angle) for angle in (solid.roll_deg, solid.pitch_deg, solid.heading_deg)))
    lift = ground(solid.north_m, solid.east_m) + solid.above_ground_m
    if solid.box is not None:
        lift += 0.5 * solid.box.size_m[2]
    elif solid.cylinder is not None:
        lift += 0.5 * solid.cylinder.height_m
    return (solid.north_m, solid.east_m, -lift), q
