"""Vehicles as others see them, from their data: a multicopter's arms, rotors and legs; a rover's chassis and wheels.

What the data do not tell (thickness of arms, the shape of a hood) is ours. Axes are the body's: forward, right, down.
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.vehicles.description import Gear, Vehicle
from sitl_emu.world.render.furniture import CLOTH, GREY, PAINT, RUBBER, wheel
from sitl_emu.world.render.model import Colour, Model, box, hull, lathe, merged, moved, turned

BODY: Colour = (0.16, 0.17, 0.18)
FRONT: Colour = (0.85, 0.30, 0.06)
GREEN: Colour = (0.20, 0.42, 0.22)
BLADE_SHARE = 0.92
"""Of half the way to the next rotor: how far a propeller reaches."""


class Propeller(NamedTuple):
    """A part that turns about the body's vertical axis."""

    model: Model
    at: tuple[float, float, float]
    turns: float
    """1: clockwise, seen from above; -1: counter-clockwise."""


class Look(NamedTuple):
    """All parts of a vehicle."""

    body: Model
    propellers: tuple[Propeller, ...] = ()


def look_of(vehicle: Vehicle) -> Look:
    """From its data."""
    if vehicle.propulsion is not None:
        return _multicopter(vehicle)
    return Look(_rover(vehicle))


def _multicopter(vehicle: Vehicle) -> Look:
    assert vehicle.propulsion is not None
    rotors = [np.array(rotor.position_m) for rotor in vehicle.propulsion.rotors]
    arm = max(float(np.hypot(place[0], place[1])) for place in rotors)
    gaps = [float(np.linalg.norm(a - b)) for k, a in enumerate(rotors) for b in rotors[:k]]
    radius = BLADE_SHARE * 0.5 * min(gaps, default=arm)
    thick = 0.06 * arm
    shell = (
        (0.55, 0.18, 0.4),
        (-0.5, 0.22, 0.4),
        (0.3, 0.2, 1.6),
        (-0.3, 0.2, 1.6),
        (0.2, 0.3, -0.6),
        (-0.2, 0.3, -0.6),
    )
    parts = [
        hull([(arm * n, side * arm * e, -thick * d) for n, e, d in shell for side in (-1.0, 1.0)], PAINT, BODY),
        moved(box((0.12 * arm, 0.30 * arm, 0.05 * arm), PAINT, FRONT), (0.42 * arm, 0.0, -1.2 * thick)),
    ]
    propellers = []
    for place, rotor in zip(rotors, vehicle.propulsion.rotors, strict=True):
        angle = math.atan2(place[1], place[0])
        length = float(np.hypot(place[0], place[1]))
        rod = box((length, thick, thick), CLOTH, BODY)
        parts.append(moved(rod, (0.5 * place[0], 0.5 * place[1], place[2]), turned(angle)))
        motor = lathe(((0.0, 0.0), (0.09 * arm, 0.0), (0.08 * arm, 0.12 * arm), (0.0, 0.12 * arm)), 10, CLOTH, GREY)
        parts.append(moved(motor, place))
        at = (float(place[0]), float(place[1]), float(place[2]) - 0.14 * arm)
        propellers.append(Propeller(_blades(radius), at, -1.0 if rotor.turns == "ccw" else 1.0))
    if vehicle.gear is not None:
        parts += _legs(vehicle.gear, thick)
    return Look(merged(parts), tuple(propellers))


def _blades(radius: float) -> Model:
    """Two blades and a hub."""
    wide = 0.16 * radius
    plan = ((0.05, 0.3), (0.05, -0.3), (0.4, 0.5), (0.4, -0.4), (1.0, 0.1), (1.0, -0.15))
    blade = hull([(radius * x, wide * y, z) for x, y in plan for z in (0.0, 0.006)], CLOTH, (0.10, 0.10, 0.11))
    return merged((blade, moved(blade, (0.0, 0.0, 0.0), turned(math.pi))))


def _legs(gear: Gear, thick: float) -> list[Model]:
    """Two skids, each on two struts."""
    parts = []
    for side in (-1.0, 1.0):
        skid = box((2.4 * gear.half_length_m, 0.5 * thick, 0.5 * thick), CLOTH, BODY)
        parts.append(moved(skid, (0.0, side * gear.half_width_m, gear.height_m - 0.25 * thick)))
        for end in (-0.6, 0.6):
            strut = box((0.5 * thick, 0.5 * thick, gear.height_m), CLOTH, BODY)
            parts.append(moved(strut, (end * gear.half_length_m, side * gear.half_width_m, 0.5 * gear.height_m)))
    return parts


def _rover(vehicle: Vehicle) -> Model:
    """A chassis on four wheels; a mast where its camera is (a rover's data tell no more)."""
    if vehicle.chassis is not None:
        base, track, centre = vehicle.chassis.wheelbase_m, vehicle.chassis.track_m, vehicle.chassis.centre_height_m
        rear = -vehicle.chassis.centre_to_rear_axle_m
    else:
        base = vehicle.sih_rover.wheelbase_m if vehicle.sih_rover is not None else 0.5
        track, centre, rear = 0.75 * base, 0.35 * base, -0.5 * base
    radius = min(0.25 * base, 0.9 * centre)
    middle = rear + 0.5 * base
    long, wide = base + 1.1 * radius, track - 0.25 * radius
    shell = [
        (middle + n * long / 2, e * wide / 2, d)
        for n, e, d in (
            (1.0, 0.8, -0.02),
            (1.0, 0.8, 0.06),
            (-1.0, 0.9, -0.06),
            (-1.0, 0.9, 0.06),
            (0.7, 1.0, -0.10),
            (-0.8, 1.0, -0.12),
        )
    ]
    shell += [(n, -e, d) for n, e, d in shell]
    parts = [hull(shell, PAINT, GREEN)]
    for n in (rear, rear + base):
        parts += [moved(wheel(radius, 0.45 * radius), (n, side * track / 2, centre - radius)) for side in (-1.0, 1.0)]
    mast = max(1.0, 2.6 * base)
    parts.append(moved(box((0.05, 0.05, mast), CLOTH, GREY), (middle + 0.2 * base, 0.0, -0.5 * mast)))
    parts.append(moved(box((0.10, 0.14, 0.08), CLOTH, RUBBER), (middle + 0.2 * base + 0.06, 0.0, -mast)))
    return merged(parts)
