"""Where a moving camera's rows look: rolling shutter and the way that a picture smears.

A frame's time and pose are those of the middle of its middle row's exposure. Until then and from then on the camera is
taken to turn and move as it does at that time: what shakes faster than a frame is neglected. What it sees is taken to
lie on level ground below it, and everything above the horizon at infinity: exact for turning, right in the mean for
moving over ground; what stands high shifts by too little, and what moves by itself not at all.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
NEAREST_GROUND_M = 0.3
"""A camera that is closer to the ground than this, or below it, is taken to be this far from it."""


class Motion(NamedTuple):
    """How a body moves: its origin's velocity (NED, m/s) and its angular rate (body axes FRD, rad/s)."""

    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rate_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Drift(NamedTuple):
    """How a camera moves, in its own axes (right, down in the picture, forward)."""

    rate_rad_s: F64
    velocity_m_s: F64
    down: F64
    """(3,): the unit vector down."""
    height_m: float
    """Above the ground."""


def drift(
    motion: Motion, body_to_ned: F64, head_to_ned: F64 | None, camera_to_ned: F64, lever_m: F64, height_m: float
) -> Drift:
    """That of a camera on a body, or on a gimbal's head, which turns with the body's heading alone.

    `lever_m`: from the body's origin to the camera, body axes; the matrices are (3, 3).
    """
    rate_ned = body_to_ned @ np.array(motion.rate_rad_s)
    velocity_ned = np.array(motion.velocity_m_s) + np.cross(rate_ned, body_to_ned @ lever_m)
    if head_to_ned is not None:
        ahead = body_to_ned[:, 0]
        turning = np.cross(rate_ned, ahead)
        level2 = max(float(ahead[0] ** 2 + ahead[1] ** 2), 1e-9)
        rate_ned = np.array((0.0, 0.0, (ahead[0] * turning[1] - ahead[1] * turning[0]) / level2))
    back = camera_to_ned.T
    return Drift(back @ rate_ned, back @ velocity_ned, back[:, 2].copy(), max(height_m, NEAREST_GROUND_M))


def ways(moving: Drift, times_s: F64) -> npt.NDArray[np.float32]:
    """For each of n times from the frame's, how a ray of then is found in the picture of the frame's time: (n, 15).

    Twelve are rows of a matrix and a vector: with d a ray at that time, the picture has it at E d + t max(down · d, 0),
    E being (3, 3), t and down (3,). E is Cayley's rotation, which needs no sine: for the angles of a frame the same.
    """
    half = 0.5 * moving.rate_rad_s * times_s[:, None]
    x, y, z = half.T
    n = 1.0 + x * x + y * y + z * z
    e = np.empty((len(times_s), 15))
    e[:, 0], e[:, 1], e[:, 2] = 1.0 + x * x - y * y - z * z, 2.0 * (x * y - z), 2.0 * (x * z + y)
    e[:, 3], e[:, 4], e[:, 5] = 2.0 * (x * y + z), 1.0 - x * x + y * y - z * z, 2.0 * (y * z - x)
    e[:, 6], e[:, 7], e[:, 8] = 2.0 * (x * z - y), 2.0 * (y * z + x), 1.0 - x * x - y * y + z * z
    e[:, :9] /= n[:, None]
    sinking = moving.velocity_m_s @ moving.down
    heights = np.maximum(moving.height_m - sinking * times_s, NEAREST_GROUND_M)
    e[:, 9:12] = moving.velocity_m_s * (times_s / heights)[:, None]
    e[:, 12:] = np.einsum("i,nij->nj", moving.down, e[:, :9].reshape(-1, 3, 3))
    return e.astype(np.float32)


def farthest_px(moving: Drift, seconds: float, focal_px: float, corner: float) -> float:
    """A bound of how far anything moves in the picture in a time; `corner`: the corners' distance in focal lengths."""
    turn = float(np.sqrt(moving.rate_rad_s @ moving.rate_rad_s))
    speed = float(np.sqrt(moving.velocity_m_s @ moving.velocity_m_s))
    return seconds * focal_px * (1.0 + corner * corner) * (turn + speed / moving.height_m)
