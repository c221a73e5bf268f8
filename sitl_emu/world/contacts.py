"""Vehicles that touch solids, one another, or the ground too hard: they bounce off, and above a speed they are wrecked.

A contact is an impulse along its normal that leaves `restitution` of the closing speed, and Coulomb friction across it;
what has sunk in is pushed out. Vehicle against vehicle is sphere against sphere; solids are `solids.Solids`. Looked for
where bodies are or might be within a tick: whoever is far from all others costs nothing until it could have come near.
Whose centre is under water is wrecked at any speed, and sinks.
"""

import math
from collections.abc import Container, Sequence
from typing import NamedTuple

from sitl_emu.core.attitude import rotated, rotation
from sitl_emu.vehicles.description import Body
from sitl_emu.vehicles.dynamics import STEP_S, Dynamics, Vector3
from sitl_emu.vehicles.multicopter import Multicopter
from sitl_emu.vehicles.rigid_body import dot
from sitl_emu.world.atmosphere import gravity_m_s2
from sitl_emu.world.obstacles import Areas, Contact, Obstacles, Pushable
from sitl_emu.world.simulator import VehicleSimulator

LOOK_AROUND_M = 1.0
"""How near solids are listed; from there on they are asked for at every tick."""
PICKS_UP_M_S = 10.0
"""Ours: by how much a vehicle's speed may grow before it is looked at again."""
TOUCH_M_S = 0.3
"""Ours: slower meetings (standing against a wall, being pushed along) are no events."""
AGAIN_US = 1_000_000
"""A vehicle that goes on touching the same thing says so again after this time at the earliest; a wreck, which lies
where it fell, only when it has not touched it for so long."""
SUNK_M = 0.05
"""Ours: who stands deeper in something where it starts stands in it; less is how bodies' spheres are rounded."""
GROUND = "ground"
WEIGHS_IN_WATER = 0.2
"""Ours: share of a multicopter's weight that its displacement leaves: it sinks."""
WATER_SLOWS_S = 0.3
"""Ours: within which time water takes its speed: it sinks at half a metre a second, and drifts with the current."""
STILL = (0.0, 0.0, 0.0)
UPWARDS = (0.0, 0.0, -1.0)
"""Where two that are in the same place are pushed apart."""


class Impact(NamedTuple):
    """A vehicle has met something."""

    time_us: int
    place: int
    """The vehicle's, among those of the simulation."""
    vehicle: str
    other: str
    """The solid's or the other vehicle's name, or GROUND."""
    other_place: int | None
    """The other vehicle's; None: it is none."""
    speed_m_s: float
    """Closing speed along the contact's normal."""
    crash: bool
    """Whether the vehicle is wrecked by it."""
    in_water: bool = False
    """Whether `other` is water, in which it came down; the speed is its whole."""

    @property
    def did(self) -> str:
        """What it did, for people."""
        if self.in_water:
            return f"came down in water ({self.other})"
        return f"{'crashed into' if self.crash else 'touched'} {self.other}"


def told(impact: Impact, names: Sequence[str]) -> str:
    """An impact for people; `names` of the simulation's vehicles, by place."""
    if impact.other_place is not None:
        impact = impact._replace(other=names[impact.other_place])
    return f"{names[impact.place]} {impact.did} at {impact.speed_m_s:.1f} m/s"


class Contacts:
    """All contacts in one world."""

    def __init__(
        self, simulators: Sequence[VehicleSimulator], solids: Obstacles | None, areas: Areas | None = None
    ) -> None:
        """`simulators` is looked at anew each time: a vehicle that begins anew stands there in its old place."""
        self._simulators = simulators
        self._places = [place for place, each in enumerate(simulators) if each.vehicle.body is not None]
        self._solids, self._areas = solids, areas
        self._numbers: dict[int, int] = {}
        """Each body's number in `solids`."""
        if solids is not None:
            self._numbers = {place: solids.add_body(_body(simulators[place])) for place in self._places}
        self._look_us = dict.fromkeys(self._places, 0)
        """When each vehicle may be near a solid."""
        self._pair_us = {(one, other): 0 for other in self._places for one in self._places if one < other}
        """When each pair may be near each other."""
        self._told: dict[tuple[int, str, int | None], int] = {}
        self.impacts: list[Impact] = []
        """Since they were taken last; whoever reads them empties the list."""

    def update(self, now_us: int, out: Container[int] = ()) -> None:
        """After every vehicle has made its step; those at the places `out` are there no more."""
        simulators = self._simulators
        if self._solids is not None:
            for place in self._places:
                if now_us >= self._look_us[place] and place not in out:
                    self._meet_solids(now_us, place, self._solids)
        for pair, due_us in self._pair_us.items():
            if now_us >= due_us and pair[0] not in out and pair[1] not in out:
                one, other = simulators[pair[0]], simulators[pair[1]]
                self._pair_us[pair] = now_us + _free_us(self._meet(now_us, *pair), one, other)
        for place in self._places:
            self._meet_ground(now_us, place)
            if self._areas is not None:
                self._meet_water(now_us, place, self._areas)

    def begins_in(self, names: Sequence[str]) -> str:
        """Which vehicle stands in a solid, in water or in another, for people; `names` by place; empty: none does."""
        for place, other in self._held():
            body = self._simulators[place].dynamics
            at = f"{body.north_m:.1f} m north, {body.east_m:.1f} m east of the world's origin"
            return f"{names[place]} would start in {other}, {at}"
        for one, other_place in self._pair_us:
            mine, theirs = self._simulators[one], self._simulators[other_place]
            if any(contact.depth_m > SUNK_M for contact in _between(_spheres(mine), _spheres(theirs), "")):
                return f"{names[other_place]} would start in {names[one]}"
        return ""

    def _held(self) -> list[tuple[int, str]]:
        """Who stands in what solid or water, by place."""
        return [(place, other) for place in self._places for other in self.near(place, -SUNK_M)]

    def near(self, place: int, within_m: float) -> list[str]:
        """The solids to which a vehicle has a gap of less than so much (negative: sunk in by more), and its water."""
        body = self._simulators[place].dynamics
        at = (body.north_m, body.east_m, body.down_m)
        found = list[str]()
        if self._solids is not None and place in self._numbers:
            contacts = self._solids.touching(self._numbers[place], at, body.q, max(within_m, 0.0))
            found += [contact.other for contact in contacts if -contact.depth_m < within_m]
        if self._areas is not None and (water := self._areas.water_at(*at)) is not None:
            found.append(water.name)
        return found

    def look_again(self) -> None:
        """Something is there that was not."""
        self._look_us = dict.fromkeys(self._look_us, 0)

    # --- solids ---------------------------------------------------------------------------------------------------

    def _meet_solids(self, now_us: int, place: int, solids: Obstacles) -> None:
        simulator = self._simulators[place]
        solids.set_time(now_us * 1e-6)
        body = simulator.dynamics
        at = (body.north_m, body.east_m, body.down_m)
        found = solids.touching(self._numbers[place], at, body.q, LOOK_AROUND_M)
        if not found:
            self._look_us[place] = now_us + _free_us(LOOK_AROUND_M, simulator, others_m_s=solids.fastest_m_s)
            return
        shape = _body(simulator)
        sunk = [contact for contact in found if contact.depth_m > 0.0]
        for other in sorted({contact.other for contact in sunk}):
            contact = _together([contact for contact in sunk if contact.other == other])
            speed = _bounce(body, solids.loose_body(other), contact, shape.restitution, shape.friction)
            _push_out(body, contact.normal, contact.depth_m)
            self._note(now_us, place, other, None, speed)

    # --- vehicles -------------------------------------------------------------------------------------------------

    def _meet(self, now_us: int, place: int, other_place: int) -> float:
        """Let two vehicles bounce where they touch; the gap between them (m)."""
        one, other = self._simulators[place], self._simulators[other_place]
        a, b = one.dynamics, other.dynamics
        apart = math.dist((a.north_m, a.east_m, a.down_m), (b.north_m, b.east_m, b.down_m))
        gap = apart - one.reach_m - other.reach_m
        if gap > 0.0:
            return gap
        found = _between(_spheres(one), _spheres(other), other.name)
        if not found:
            return 0.0
        contact = _together(found)
        mine, theirs = _body(one), _body(other)
        restitution = math.sqrt(mine.restitution * theirs.restitution)
        speed = _bounce(a, b, contact, restitution, math.sqrt(mine.friction * theirs.friction))
        _push_out(a, contact.normal, 0.5 * contact.depth_m)
        n, e, d = contact.normal
        _push_out(b, (-n, -e, -d), 0.5 * contact.depth_m)
        self._note(now_us, place, other.name, other_place, speed)
        self._note(now_us, other_place, one.name, place, speed)
        return 0.0

    # --- the ground -------------------------------------------------------------------------------------------------

    def _meet_ground(self, now_us: int, place: int) -> None:
        body, gear = self._simulators[place].dynamics, self._simulators[place].vehicle.gear
        if isinstance(body, Multicopter) and gear is not None and body.struck_ground_m_s > gear.crash_speed_m_s:
            speed, body.struck_ground_m_s = body.struck_ground_m_s, 0.0
            self._tell(now_us, place, GROUND, None, speed, crash=True)

    # --- water ----------------------------------------------------------------------------------------------------

    def _meet_water(self, now_us: int, place: int, areas: Areas) -> None:
        body = self._simulators[place].dynamics
        water = areas.water_at(body.north_m, body.east_m, body.down_m)
        if water is None:
            return
        if not body.wrecked:
            self._tell(now_us, place, water.name, None, _speed(body), crash=True, in_water=True)
        if isinstance(body, Multicopter):
            simulator = self._simulators[place]
            mass, gravity = simulator.vehicle.mass_kg, gravity_m_s2(simulator.home.lat_deg)
            lift = (1.0 - WEIGHS_IN_WATER) * gravity + body.vd_m_s / WATER_SLOWS_S
            north = (water.current_north_m_s - body.vn_m_s) / WATER_SLOWS_S
            east = (water.current_east_m_s - body.ve_m_s) / WATER_SLOWS_S
            body.push(STILL, (mass * STEP_S * north, mass * STEP_S * east, -mass * STEP_S * lift))

    def _note(self, now_us: int, place: int, other: str, other_place: int | None, speed_m_s: float) -> None:
        if speed_m_s > TOUCH_M_S:
            crash = speed_m_s > _body(self._simulators[place]).crash_speed_m_s
            self._tell(now_us, place, other, other_place, speed_m_s, crash=crash)

    def _tell(
        self,
        now_us: int,
        place: int,
        other: str,
        other_place: int | None,
        speed_m_s: float,
        *,
        crash: bool,
        in_water: bool = False,
    ) -> None:
        simulator = self._simulators[place]
        crash = crash and not simulator.dynamics.wrecked
        if crash:
            simulator.dynamics.wreck()
        whom = (place, other, other_place)
        told_us = self._told.get(whom)
        again = crash or told_us is None or now_us - told_us >= AGAIN_US
        if again or simulator.dynamics.wrecked:  # a wreck has to be away from it for so long
            self._told[whom] = now_us
        if again:
            self.impacts.append(Impact(now_us, place, simulator.name, other, other_place, speed_m_s, crash, in_water))


def _body(simulator: VehicleSimulator) -> Body:
    assert simulator.vehicle.body is not None
    return simulator.vehicle.body


def _spheres(simulator: VehicleSimulator) -> list[tuple[Vector3, float]]:
    """Centres (NED) and radii."""
    body = simulator.dynamics
    at = (body.north_m, body.east_m, body.down_m)
    matrix = rotation(body.q)
    return [(_plus(at, rotated(matrix, sphere.centre_m)), sphere.radius_m) for sphere in _body(simulator).spheres]


def _between(ours: list[tuple[Vector3, float]], theirs: list[tuple[Vector3, float]], other: str) -> list[Contact]:
    """Where spheres have sunk into spheres of another."""
    found = []
    for place, radius in ours:
        for their_place, their_radius in theirs:
            n, e, d = _minus(place, their_place)
            distance = math.sqrt(n * n + e * e + d * d)
            depth = radius + their_radius - distance
            if depth > 0.0:
                normal = (n / distance, e / distance, d / distance) if distance > 0.0 else UPWARDS
                pn, pe, pd = (p + their_radius * part for p, part in zip(their_place, normal, strict=True))
                found.append(Contact((pn, pe, pd), normal, depth, other))
    return found


def _together(contacts: list[Contact]) -> Contact:
    """One contact for several with the same thing, each counting as deep as it is: a push that turns nothing askew."""
    if len(contacts) == 1:
        return contacts[0]
    total = sum(contact.depth_m for contact in contacts)
    pn, pe, pd = (sum(c.depth_m * c.point[axis] for c in contacts) / total for axis in range(3))
    n, e, d = (sum(c.depth_m * c.normal[axis] for c in contacts) for axis in range(3))
    length = math.sqrt(n * n + e * e + d * d)
    normal = (n / length, e / length, d / length) if length > 0.0 else contacts[0].normal
    return Contact((pn, pe, pd), normal, max(c.depth_m for c in contacts), contacts[0].other, contacts[0].velocity)


def _free_us(
    gap_m: float, one: VehicleSimulator, other: VehicleSimulator | None = None, others_m_s: float = 0.0
) -> int:
    """How long nothing can happen over this gap."""
    if gap_m <= 0.0:
        return 0
    fastest = PICKS_UP_M_S + _speed(one.dynamics) + others_m_s
    if other is not None:
        fastest += PICKS_UP_M_S + _speed(other.dynamics)
    return int(gap_m / fastest / STEP_S) * round(STEP_S * 1e6)


def _speed(body: Dynamics) -> float:
    return math.sqrt(body.vn_m_s**2 + body.ve_m_s**2 + body.vd_m_s**2)


def _bounce(a: Pushable, b: Pushable | None, contact: Contact, restitution: float, friction: float) -> float:
    """Impulses that part `a` from `b` (None: something that stands); the closing speed, m/s, 0 if they were parting."""
    normal, arm = contact.normal, _minus(contact.point, (a.north_m, a.east_m, a.down_m))
    velocity = _minus(a.velocity_at(arm), contact.velocity)
    their_arm = (0.0, 0.0, 0.0)
    if b is not None:
        their_arm = _minus(contact.point, (b.north_m, b.east_m, b.down_m))
        velocity = _minus(velocity, b.velocity_at(their_arm))
    closing = -dot(velocity, normal)
    if closing <= 0.0:
        return 0.0
    yields = a.mobility(arm, normal) + (b.mobility(their_arm, normal) if b is not None else 0.0)
    push = (1.0 + restitution) * closing / yields
    _apply(a, b, arm, their_arm, normal, push)
    # friction takes away the sliding, as far as the push allows it
    n, e, d = (v + closing * part for v, part in zip(velocity, normal, strict=True))
    sliding = math.sqrt(n * n + e * e + d * d)
    if sliding > 0.0:
        along = (-n / sliding, -e / sliding, -d / sliding)
        yields = a.mobility(arm, along) + (b.mobility(their_arm, along) if b is not None else 0.0)
        _apply(a, b, arm, their_arm, along, min(friction * push, sliding / yields))
    return closing


def _apply(
    a: Pushable, b: Pushable | None, arm: Vector3, their_arm: Vector3, direction: Vector3, impulse_n_s: float
) -> None:
    n, e, d = (impulse_n_s * part for part in direction)
    a.push(arm, (n, e, d))
    if b is not None:
        b.push(their_arm, (-n, -e, -d))


def _push_out(body: Dynamics, normal: Vector3, depth_m: float) -> None:
    n, e, d = (depth_m * part for part in normal)
    body.shift(n, e, d)


def _plus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
