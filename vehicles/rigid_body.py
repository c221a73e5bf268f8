"""How a rigid body answers to an impulse at a point of it (Newton and Euler), for contacts. All vectors NED."""

from sitl_emu.core.attitude import Quaternion, Vector, rotation

Moments = tuple[float, float, float]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> float:
    """The scalar product a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def velocity_at(velocity: Vector, rates: Vector, q: Quaternion, arm: Vector) -> Vector:
    """Velocity (m/s) of the point `arm` (m) away from the centre of mass; `rates` (rad/s) in the body's axes."""
    r = rotation(q)
    spin = (dot(r[0:3], rates), dot(r[3:6], rates), dot(r[6:9], rates))
    n, e, d = cross(spin, arm)
    return velocity[0] + n, velocity[1] + e, velocity[2] + d


def turn(q: Quaternion, moments: Moments, arm: Vector, impulse: Vector) -> Vector:
    """Change of the body rates (rad/s, body's axes) that an impulse (N s) at `arm` (m) makes; `moments` in kg m²."""
    r = rotation(q)
    n, e, d = cross(arm, impulse)
    return (
        (r[0] * n + r[3] * e + r[6] * d) / moments[0],
        (r[1] * n + r[4] * e + r[7] * d) / moments[1],
        (r[2] * n + r[5] * e + r[8] * d) / moments[2],
    )


def mobility(q: Quaternion, mass_kg: float, moments: Moments, arm: Vector, direction: Vector) -> float:
    """Change of velocity along `direction` (a unit vector), at `arm`, for each N s along it (1/kg)."""
    p, y, w = turn(q, moments, arm, direction)
    return 1.0 / mass_kg + p * p * moments[0] + y * y * moments[1] + w * w * moments[2]
