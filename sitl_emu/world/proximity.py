"""The obstacles around a vehicle, as OBSTACLE_DISTANCE tells them: how far it is free in 72 directions of the body.

https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE. PX4's collision prevention takes them for distances in the
horizontal plane (src/lib/collision_prevention), so a scan is levelled first, as who processes it on a vehicle does with
the autopilot's attitude: here with the true one.

Ours: in the way is what lies within HALF_HEIGHT_M above or below the vehicle (so, below that height, the ground), and
what is seen within LEVEL_DEG of the horizon, for rays lie that far apart; and of a direction in which no ray went
within LEVEL_DEG nothing is known, which is so of a sensor that the vehicle tilts too far.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
PLACES = 72
INCREMENT_DEG = 360.0 / PLACES
UNKNOWN = 65535
"""Of OBSTACLE_DISTANCE.distances: nothing was measured there."""
HALF_HEIGHT_M = 0.5
LEVEL_DEG = 2.5
REACH_M = 40.0
"""Nothing is told of what is further away (gcs/obstacle_distance.py has the same): from MPC_VEL_MANUAL, 10 m/s, PX4
stops within 17 m at MPC_ACC_HOR."""


class Obstacles(NamedTuple):
    """What OBSTACLE_DISTANCE carries; cm."""

    distances: tuple[int, ...]
    """PLACES of them, clockwise from straight ahead, which is the middle of the first; UNKNOWN, and `farthest` + 1:
    nothing there."""
    nearest: int
    farthest: int


def levelled(to_ned: FloatArray, heading: float) -> FloatArray:
    """Rotation (3, 3) from axes whose rotation to NED is given to those of a level vehicle with a heading (rad)."""
    s, c = math.sin(heading), math.cos(heading)
    return np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ to_ned


def around(points: FloatArray, looked: FloatArray, nearest_m: float, farthest_m: float) -> Obstacles | None:
    """The obstacles that points (n, 3) are, seen by rays in directions (m, 3); both in axes of the level vehicle.

    None where no ray was near the horizon: nothing is known at all.
    """
    farthest_m = min(farthest_m, REACH_M)
    farthest = round(farthest_m * 100.0)
    level = np.abs(looked[:, 2]) <= math.sin(math.radians(LEVEL_DEG))
    if not level.any():
        return None
    distances = np.full(PLACES, UNKNOWN)
    distances[_places(looked[level])] = farthest + 1
    away_m = np.hypot(points[:, 0], points[:, 1])
    low_or_high = np.maximum(HALF_HEIGHT_M, away_m * math.tan(math.radians(LEVEL_DEG)))
    near = (np.abs(points[:, 2]) <= low_or_high) & (away_m < farthest_m)
    np.minimum.at(distances, _places(points[near]), np.rint(away_m[near] * 100.0).astype(np.int64))
    return Obstacles(tuple(distances.tolist()), round(nearest_m * 100.0), farthest)


def _places(directions: FloatArray) -> npt.NDArray[np.int64]:
    """In which of the 72 each of (n, 3) lies."""
    degrees = np.degrees(np.arctan2(directions[:, 1], directions[:, 0]))
    return np.rint(degrees / INCREMENT_DEG).astype(np.int64) % PLACES
