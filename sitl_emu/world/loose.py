"""Loose rigid bodies: they fall, tumble, slide, float and come to rest; Bullet integrates them, 4 ms a step.

Bullet knows gravity, their contacts with solids, with standing and moving things, and with one another; the ground is
the plane below each, as it is for vehicles' gears. Of ours are the drag of the air, and in water buoyancy, as far as a
body's height is under the surface, and drag towards the current: it floats where its mean density is below water's
(forces act at the centre: nothing rights itself). Meetings with vehicles are `contacts.py`'s, by the same impulses as
between two vehicles. Nothing is stepped while all are at rest. Inertia is that of the shape with even density, of a
hull or mesh that of its bounding box (Bullet's). One simulation gives the same motion again, bit by bit.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sitl_emu.core.attitude import Quaternion, rotated, rotation
from sitl_emu.vehicles import rigid_body
from sitl_emu.vehicles.dynamics import STEP_S, Height, Vector3, slope
from sitl_emu.world import bullet as engine
from sitl_emu.world.description import Loose, WorldError
from sitl_emu.world.obstacles import Areas, Water
from sitl_emu.world.wind import Wind

SLICES = 64
"""A hull's volume is measured to a few per cent."""
WATER_KG_M3 = 1000.0
WATER_SLOWS_S = 0.4
"""Ours: within which time water takes the speed and the spin of a body that displaces its mass."""
SLOPE_REACH_M = 0.3
"""As a vehicle's gear feels the ground (`vehicles.multicopter`)."""
REST_M_S, REST_RAD_S = 0.03, 0.1
"""Ours: what is slower for REST_TICKS, sleeps."""
REST_TICKS = 125
LOOK_TICKS = 25
"""How often it is looked whether something that moves by itself comes near to what sleeps."""
NEAR_M = 0.3


class Medium(NamedTuple):
    """What loose bodies fall through, and onto."""

    ground: Height
    wind: Wind
    areas: Areas | None
    gravity_m_s2: float
    air_kg_m3: float


class Shape(NamedTuple):
    """A body's shape in Bullet."""

    number: int
    centre_m: Vector3
    """Its centre of mass, from the place that its description gives (NED)."""
    volume_m3: float


def shape_of(bullet: Any, client: int, described: Loose, folder: Path) -> Shape:
    """`folder`: where mesh files lie. Raises WorldError."""
    if described.box is not None:
        return Shape(engine.box(bullet, client, described.box), (0.0, 0.0, 0.0), math.prod(described.box.size_m))
    if described.cylinder is not None:
        volume = math.pi * described.cylinder.radius_m**2 * described.cylinder.height_m
        return Shape(engine.cylinder(bullet, client, described.cylinder), (0.0, 0.0, 0.0), volume)
    if described.hull is not None:
        points = [(north, east, -up) for north, east, up in described.hull.points_m]
    else:
        assert described.mesh is not None
        points, _ = engine.read_mesh(folder / described.mesh.file, described.mesh.scale)
    volume, centre = _measured(bullet, points)
    if volume <= 0.0:
        raise WorldError(f"loose {described.name!r}: its hull has no volume")
    about = [(n - centre[0], e - centre[1], d - centre[2]) for n, e, d in points]
    number: int = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=about, physicsClientId=client)
    return Shape(number, centre, volume)


def _measured(bullet: Any, points: Sequence[Vector3]) -> tuple[float, Vector3]:
    """Volume (m³) and middle of the convex hull of points: of SLICES² columns, as rays from above and below meet it."""
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    if not (high > low).all():
        return 0.0, (0.0, 0.0, 0.0)
    client = bullet.connect(bullet.DIRECT)
    try:
        shape = bullet.createCollisionShape(bullet.GEOM_MESH, vertices=points, physicsClientId=client)
        bullet.createMultiBody(0.0, shape, physicsClientId=client)
        side = (high - low) / SLICES
        row, column = np.divmod(np.arange(SLICES * SLICES), SLICES)
        north, east = low[0] + (row + 0.5) * side[0], low[1] + (column + 0.5) * side[1]
        ends = [np.stack((north, east, np.full(len(north), d)), axis=1).tolist() for d in (low[2] - 1.0, high[2] + 1.0)]
        met = [bullet.rayTestBatch(*pair, physicsClientId=client) for pair in (ends, ends[::-1])]
    finally:
        bullet.disconnect(physicsClientId=client)
    there = np.array([each[0] >= 0 for each in met[0]])
    top, bottom = (np.array([each[3][2] for each in one])[there] for one in met)
    length = bottom - top
    if not length.any():
        return 0.0, (0.0, 0.0, 0.0)
    middle = (np.average(each, weights=length) for each in (north[there], east[there], 0.5 * (top + bottom)))
    n, e, d = (float(each) for each in middle)
    return float(length.sum() * side[0] * side[1]), (n, e, d)


class LooseBody:
    """One of them; with the state and the answers to impulses that contacts ask for (`contacts.Pushable`)."""

    def __init__(self, bullet: Any, client: int, number: int, described: Loose, shape: Shape) -> None:
        self.described, self.shape, self.number = described, shape, number
        self._bullet, self._client = bullet, client
        self.inertia: Vector3 = bullet.getDynamicsInfo(number, -1, physicsClientId=client)[2]
        self.pushed = False
        """Since it was stepped last."""
        self.slow_ticks = 0
        """For how long it has been too slow to be moving."""
        self.read()

    def read(self) -> None:
        """Take over what Bullet has."""
        bullet, client = self._bullet, self._client
        (self.north_m, self.east_m, self.down_m), (x, y, z, w) = bullet.getBasePositionAndOrientation(
            self.number, physicsClientId=client
        )
        self.q: Quaternion = (w, x, y, z)
        self.velocity: Vector3
        self.spin: Vector3
        self.velocity, self.spin = bullet.getBaseVelocity(self.number, physicsClientId=client)

    def set_velocity(self, velocity: Vector3, spin: Vector3) -> None:
        """NED, m/s and rad/s."""
        self.velocity, self.spin = velocity, spin
        self._bullet.resetBaseVelocity(self.number, velocity, spin, physicsClientId=self._client)

    @property
    def speed_m_s(self) -> float:
        """Of its centre."""
        return math.hypot(*self.velocity)

    @property
    def spin_rad_s(self) -> float:
        """About whatever axis."""
        return math.hypot(*self.spin)

    @property
    def lies_still(self) -> bool:
        """Whether it has been at rest for a while."""
        return self.slow_ticks >= REST_TICKS

    def velocity_at(self, arm: Vector3) -> Vector3:
        """See contacts.Pushable."""
        n, e, d = rigid_body.cross(self.spin, arm)
        return self.velocity[0] + n, self.velocity[1] + e, self.velocity[2] + d

    def mobility(self, arm: Vector3, direction: Vector3) -> float:
        """See contacts.Pushable."""
        return rigid_body.mobility(self.q, self.described.mass_kg, self.inertia, arm, direction)

    def push(self, arm: Vector3, impulse: Vector3) -> None:
        """See contacts.Pushable."""
        mass, matrix = self.described.mass_kg, rotation(self.q)
        turn = rotated(matrix, rigid_body.turn(self.q, self.inertia, arm, impulse))
        velocity = tuple(v + part / mass for v, part in zip(self.velocity, impulse, strict=True))
        spin = tuple(w + part for w, part in zip(self.spin, turn, strict=True))
        self.set_velocity((velocity[0], velocity[1], velocity[2]), (spin[0], spin[1], spin[2]))
        self.pushed = True


class LooseBodies:
    """All of one world."""

    def __init__(self, bullet: Any, client: int, medium: Medium) -> None:
        self._bullet, self._client, self._medium = bullet, client, medium
        self.bodies: list[LooseBody] = []
        self._planes: list[int] = []
        """The ground below each body, as Bullet knows it."""
        self._grounds: list[tuple[float, float, float]] = []
        self._plane_shape = bullet.createCollisionShape(
            bullet.GEOM_PLANE, planeNormal=(0.0, 0.0, -1.0), physicsClientId=client
        )
        self._ticks = 0
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S, deterministicOverlappingPairs=1, physicsClientId=client
        )  # fmt: skip
        bullet.setGravity(0.0, 0.0, medium.gravity_m_s2, physicsClientId=client)

    @property
    def awake(self) -> bool:
        """Whether something moves."""
        return not all(body.lies_still for body in self.bodies)

    @property
    def fastest_m_s(self) -> float:
        """Of them; with what a fall may add until it is asked for again."""
        return max((body.speed_m_s for body in self.bodies), default=0.0) + 1.0 if self.awake else 0.0

    def wake(self) -> None:
        """Something has changed."""
        for body in self.bodies:
            body.slow_ticks = 0

    def add(self, described: Loose, shape: Shape, place: Vector3, q: Quaternion) -> LooseBody:
        """A body, at rest with its centre of mass at a place (NED)."""
        bullet, client = self._bullet, self._client
        number: int = bullet.createMultiBody(
            described.mass_kg, shape.number, basePosition=place, baseOrientation=engine.xyzw(q),
            useMaximalCoordinates=True, physicsClientId=client,
        )  # fmt: skip
        bullet.changeDynamics(
            number, -1, linearDamping=0.0, angularDamping=0.0, lateralFriction=described.friction,
            restitution=described.restitution, rollingFriction=described.rolling_m,
            spinningFriction=described.rolling_m, activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=client,
        )  # fmt: skip
        body = LooseBody(bullet, client, number, described, shape)
        plane: int = bullet.createMultiBody(0.0, self._plane_shape, physicsClientId=client)
        bullet.changeDynamics(plane, -1, lateralFriction=1.0, restitution=1.0, physicsClientId=client)
        bullet.setCollisionFilterGroupMask(plane, -1, 0, 0, physicsClientId=client)
        bullet.setCollisionFilterPair(plane, number, -1, -1, 1, physicsClientId=client)
        self.bodies.append(body)
        self._planes.append(plane)
        self._grounds.append((math.nan, 0.0, 0.0))
        self.wake()
        return body

    def step(self, now_us: int, moving: Sequence[int]) -> None:
        """4 ms. `moving`: Bullet's numbers of what moves by itself, which wakes what it comes near to."""
        self._ticks += 1
        if any(body.pushed for body in self.bodies):
            self.wake()
        if not self.awake:
            if self._ticks % LOOK_TICKS or not moving or not self._are_near(set(moving)):
                return
            self.wake()
        for at, body in enumerate(self.bodies):
            body.pushed = False
            self._lay_ground(at, body)
            self._apply_forces(now_us, body)
        self._bullet.stepSimulation(physicsClientId=self._client)
        for body in self.bodies:
            body.read()
            slow = body.speed_m_s < REST_M_S and body.spin_rad_s < REST_RAD_S
            body.slow_ticks = body.slow_ticks + 1 if slow else 0
        if not self.awake:
            for body in self.bodies:
                body.set_velocity((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def _are_near(self, moving: set[int]) -> bool:
        """Whether what moves by itself is near one of them."""
        for body in self.bodies:
            low, high = self._bullet.getAABB(body.number, physicsClientId=self._client)
            low, high = [side - NEAR_M for side in low], [side + NEAR_M for side in high]
            near = self._bullet.getOverlappingObjects(low, high, physicsClientId=self._client) or ()
            if any(number in moving for number, _ in near):
                return True
        return False

    def _lay_ground(self, at: int, body: LooseBody) -> None:
        """Put the plane below a body where the ground is."""
        ground_m, rise_n, rise_e = slope(self._medium.ground, body.north_m, body.east_m, SLOPE_REACH_M)
        # the same plane, told by where it is above the origin: it need not be moved along itself
        plane = (ground_m - rise_n * body.north_m - rise_e * body.east_m, rise_n, rise_e)
        if plane == self._grounds[at]:
            return
        self._grounds[at] = plane
        length = math.sqrt(1.0 + rise_n * rise_n + rise_e * rise_e)
        # turns straight up onto the plane's normal (-rise_n, -rise_e, -1) / length: about (-rise_e, rise_n, 0)
        half = math.sqrt(0.5 * (1.0 + 1.0 / length))
        scale = 0.5 / (half * length)
        self._bullet.resetBasePositionAndOrientation(
            self._planes[at], (body.north_m, body.east_m, -ground_m),
            (-rise_e * scale, rise_n * scale, 0.0, half), physicsClientId=self._client,
        )  # fmt: skip

    def _apply_forces(self, now_us: int, body: LooseBody) -> None:
        """Of the air, and of water."""
        medium, described = self._medium, body.described
        wet, water = self._wet(body)
        if described.drag_m2 > 0.0 and wet < 1.0:
            over_ground_m = -body.down_m - medium.ground(body.north_m, body.east_m)
            air = (0.0, 0.0, 0.0) if medium.wind.calm else medium.wind.at(now_us, over_ground_m)
            n, e, d = (v - w for v, w in zip(body.velocity, air, strict=True))
            k = -0.5 * medium.air_kg_m3 * described.drag_m2 * math.sqrt(n * n + e * e + d * d) * (1.0 - wet)
            self._push(body, (k * n, k * e, k * d))
        if water is not None:
            current = (water.current_north_m_s, water.current_east_m_s, 0.0)
            displaced_kg = WATER_KG_M3 * body.shape.volume_m3 * wet
            slows = min(displaced_kg / described.mass_kg, 1.0) / WATER_SLOWS_S
            k = slows * described.mass_kg
            n, e, d = (k * (flows - v) for v, flows in zip(body.velocity, current, strict=True))
            self._push(body, (n, e, d - displaced_kg * medium.gravity_m_s2))
            keeps = 1.0 - slows * STEP_S
            spin = (body.spin[0] * keeps, body.spin[1] * keeps, body.spin[2] * keeps)
            self._bullet.resetBaseVelocity(body.number, body.velocity, spin, physicsClientId=self._client)

    def _wet(self, body: LooseBody) -> tuple[float, Water | None]:
        """What share of a body's height is under water, and under which."""
        areas = self._medium.areas
        if areas is None:
            return 0.0, None
        low, high = self._bullet.getAABB(body.number, physicsClientId=self._client)
        water = areas.water_at(body.north_m, body.east_m, high[2])
        if water is None:
            return 0.0, None
        return min(1.0, (high[2] + water.level_m) / (high[2] - low[2])), water

    def _push(self, body: LooseBody, force: Vector3) -> None:
        """For one step, at its centre."""
        place = (body.north_m, body.east_m, body.down_m)
        self._bullet.applyExternalForce(
            body.number, -1, force, place, self._bullet.WORLD_FRAME, physicsClientId=self._client
        )
