"""Quaternions (w, x, y, z) and Euler angles (roll, pitch, yaw; rad), one at a time and in plain Python."""

import math

Quaternion = tuple[float, float, float, float]
Euler = tuple[float, float, float]
STRAIGHT = 1.0 - 1e-7
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
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sine), yaw


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


def wrapped(angle: float) -> float:
    """Into -pi..pi."""
    return math.remainder(angle, 2.0 * math.pi)
