"""Moments of inertia of a vehicle made of cuboids, as the precision-agriculture paper does it.

A cuboid of mass m has I = m/12 · diag(h² + d², w² + h², w² + d²) about its own centre, with w along x (forward),
d along y (right) and h along z (down). Propellers are extremely thin cuboids. The parallel-axis theorem moves each
part to the common centre of mass: I += m (|r|² E - r rᵀ). Products of inertia are left out: the vehicles here are
symmetric about both vertical planes, and `total` raises where one is not.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from sitl_emu.vehicles.description import Vehicle

Vector3 = tuple[float, float, float]

SYMMETRY_TOLERANCE = 0.02
"""Largest product of inertia that is neglected, as a share of the smallest moment."""


class Cuboid(NamedTuple):
    """A part: mass (kg), size along x, y, z (m) and centre in the body frame (FRD, m)."""

    mass_kg: float
    size_m: Vector3
    centre_m: Vector3


class MassProperties(NamedTuple):
    """Mass (kg), centre of mass (FRD, m) and principal moments about it (kg m²)."""

    mass_kg: float
    centre_m: Vector3
    inertia_kg_m2: Vector3


def cuboid(mass_kg: float, size_m: Vector3) -> Vector3:
    """Principal moments (kg m²) of a cuboid about its own centre."""
    w, d, h = size_m
    k = mass_kg / 12.0
    return k * (h * h + d * d), k * (w * w + h * h), k * (w * w + d * d)


def parallel_axis(inertia_kg_m2: Vector3, mass_kg: float, offset_m: Vector3) -> Vector3:
    """Moments about parallel axes that pass `offset_m` away from the centre of mass."""
    (ixx, iyy, izz), (x, y, z) = inertia_kg_m2, offset_m
    return ixx + mass_kg * (y * y + z * z), iyy + mass_kg * (x * x + z * z), izz + mass_kg * (x * x + y * y)


def total(parts: Iterable[Cuboid]) -> MassProperties:
    """Mass properties of rigidly joined cuboids. Raises ValueError as `joined` does."""
    return joined([MassProperties(each.mass_kg, each.centre_m, cuboid(each.mass_kg, each.size_m)) for each in parts])


def laden(vehicle: Vehicle) -> MassProperties:
    """A vehicle with its parcel, if it has one, about the centre of mass that it has without. Raises ValueError."""
    own, parcel = MassProperties(vehicle.mass_kg, (0.0, 0.0, 0.0), vehicle.inertia_kg_m2), vehicle.parcel
    if parcel is None:
        return own
    return joined([own, total([Cuboid(parcel.mass_kg, parcel.size_m, parcel.centre_m)])])


def joined(parts: Sequence[MassProperties]) -> MassProperties:
    """Mass properties of rigidly joined bodies.

    Raises ValueError when there are no parts, or when they are so unsymmetric that the body axes are not principal.
    """
    mass = sum(part.mass_kg for part in parts)
    if mass <= 0.0:
        raise ValueError("a vehicle needs at least one part with mass")
    cx, cy, cz = (sum(part.mass_kg * part.centre_m[axis] for part in parts) / mass for axis in range(3))
    ixx = iyy = izz = ixy = ixz = iyz = 0.0
    for part in parts:
        x, y, z = part.centre_m[0] - cx, part.centre_m[1] - cy, part.centre_m[2] - cz
        moments = parallel_axis(part.inertia_kg_m2, part.mass_kg, (x, y, z))
        ixx, iyy, izz = ixx + moments[0], iyy + moments[1], izz + moments[2]
        ixy, ixz, iyz = ixy + part.mass_kg * x * y, ixz + part.mass_kg * x * z, iyz + part.mass_kg * y * z
    if max(abs(ixy), abs(ixz), abs(iyz)) > SYMMETRY_TOLERANCE * min(ixx, iyy, izz):
        raise ValueError(f"parts are not symmetric: products of inertia {ixy:.4f}, {ixz:.4f}, {iyz:.4f} kg m²")
    return MassProperties(mass, (cx, cy, cz), (ixx, iyy, izz))
