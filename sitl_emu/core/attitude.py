"""Quaternions (w, x, y, z) and Euler angles (roll, pitch, yaw; rad), one at a time and in plain Python."""

import math
from collections.abc import Sequence
from typing import Final

Quaternion = tuple[float, float, float, float]
Euler = tuple[float, float, float]
Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix by rows."""
STRAIGHT: Final = 1.0 - 1e-7
"""Sine of a pitch that is as good as 90 degrees."""


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Of Euler angles, turned in the order yaw, pitch, roll; NaN if one of them is not finite."""
    if not math.isfinite(roll + pitch + yaw):
        return math.nan, math.nan, math.nan, math.nan
    cr, sr = math.cos(roll / 2.0), math.sin(roll / 2.0)
    cp, sp = math.cos(pitch / 2.0), math.sin(pitch / 2.0)
    cy, sy = math.cos(yaw / 2.0), math.sin(yaw / 2.0)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler(q: Quaternion) -> Euler:
    """Roll, pitch, yaw; straight up or down, all of the turning is yaw."""
    w, x, y, z = q
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    if abs(sine) > STRAIGHT:
        return 0.0, math.copysign(math.pi / 2.0, sine), -2.0 * math.copysign(1.0, sine) * math.atan2(x, w)
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, math.asin(sine), heading(q)


def heading(q: Quaternion) -> float:
    """Yaw alone, rad; NaN of a quaternion that is not known."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def rotation(q: Quaternion) -> Rotation:
    """The rotation of a unit quaternion as a matrix by rows: of a vehicle's attitude, from body (FRD) to NED."""
    w, x, y, z = q
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy),
        2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
        2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy),
    )  # fmt: skip


def rotated(matrix: Rotation, vector: Vector) -> Vector:
    """A vector turned by a rotation matrix: of a vehicle's attitude, from body (FRD) to NED."""
    a, b, c, d, e, f, g, h, i = matrix
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def variances_about_body(q: Quaternion, variances: Sequence[float]) -> Vector:
    """Variances of an attitude about north, east and down as those about the body's axes (PX4: getRotVarBody).

    What couples north, east and down does not count.
    """
    m = rotation(q)
    north, east, down = variances
    return (
        m[0] * m[0] * north + m[3] * m[3] * east + m[6] * m[6] * down,
        m[1] * m[1] * north + m[4] * m[4] * east + m[7] * m[7] * down,
        m[2] * m[2] * north + m[5] * m[5] * east + m[8] * m[8] * down,
    )


def after_small_turn(q: Quaternion, hx: float, hy: float, hz: float) -> Quaternion:
    """The attitude after a small turn about the body's axes, given by half its angles (rad).

    One Newton step of 1/sqrt normalises a quaternion that is already close to one.
    """
    qw, qx, qy, qz = q
    w = qw - qx * hx - qy * hy - qz * hz
    x = qx + qw * hx + qy * hz - qz * hy
    y = qy + qw * hy + qz * hx - qx * hz
    z = qz + qw * hz + qx * hy - qy * hx
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return w * scale, x * scale, y * scale, z * scale


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Turn by b, seen in a's axes."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
