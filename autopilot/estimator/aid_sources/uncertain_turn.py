"""Vectors of vision's axes in the filter's, with what the turn between the two does to their variances.

PX4's EKF2 (EKF/aid_sources/external_vision/ev_pos_control.cpp and ev_vel_control.cpp, v1.18).
"""

from sitl_emu.autopilot.topics import Vector3
from sitl_emu.core.attitude import Rotation, rotated


def turned(vector: Vector3, variances: Vector3, turn_variances: Vector3, matrix: Rotation) -> tuple[Vector3, Vector3]:
    """A vector and its variances turned by `matrix`, of which `turn_variances` (rad²) say how well it is known."""
    x, y, z = vector
    a, b, c = turn_variances
    vx, vy, vz = turned_variances(variances, matrix)
    spread = (vx + z * z * b + y * y * c, vy + x * x * c + z * z * a, vz + y * y * a + x * x * b)
    return rotated(matrix, vector), spread


def turned_variances(variances: Vector3, matrix: Rotation) -> Vector3:
    """Variances of three axes that know nothing of each other, along other axes."""
    a, b, c, d, e, f, g, h, i = matrix
    return rotated((a * a, b * b, c * c, d * d, e * e, f * f, g * g, h * h, i * i), variances)
