"""How fast one may go and still stop, or turn, where one has to.

Behaves as PX4's `TrajectoryConstraints.hpp` (src/lib/motion_planning, v1.18): pure functions on distances and angles.
"""

import math
from typing import Final, NamedTuple

Point = tuple[float, float, float]
"""North, east, down in metres."""

MOST_RAD: Final = math.pi - 1.2e-7
"""Largest angle between two legs; at π the circle through them would be a line."""


class Limits(NamedTuple):
    """Limits of a horizontal path: m, m/s, m/s², m/s³."""

    xy_acceptance_m: float
    max_speed_xy: float
    max_acceleration_xy: float
    max_jerk: float
    turn_gain: float
    """Share of the acceleration that a turn may take (MPC_XY_TRAJ_P)."""


def max_speed_from_distance(jerk: float, acceleration: float, distance_m: float, final_speed: float) -> float:
    """Speed from which one comes down to `final_speed` within a distance.

    Constant deceleration after 2·acceleration/jerk of reaction: v² = final² + 2·a·(d - v·2·a/j). A vehicle that is
    not let brake goes no faster than that speed.
    """
    if jerk <= 0.0 or acceleration <= 0.0:
        return final_speed
    b = 4.0 * acceleration * acceleration / jerk
    c = -2.0 * acceleration * distance_m - final_speed * final_speed
    return max(0.5 * (math.sqrt(b * b - 4.0 * c) - b), final_speed)


def max_distance_to_circle(
    place: tuple[float, float], centre: tuple[float, float], radius_m: float, direction: tuple[float, float]
) -> float:
    """How far it is in a direction to where one leaves a circle, 0 where it lies behind; NaN where one never meets it.

    PX4's getMaxDistanceToCircle (lib/mathlib/math/TrajMath.hpp).
    """
    size = math.hypot(*direction)
    from_n, from_e = place[0] - centre[0], place[1] - centre[1]
    if not size > 0.0:
        return math.nan
    along = (from_n * direction[0] + from_e * direction[1]) / size
    within = along * along - from_n * from_n - from_e * from_e + radius_m * radius_m
    return max(math.sqrt(within) - along, 0.0) if within >= 0.0 else math.nan


def max_speed_in_waypoint(angle_rad: float, acceleration: float, distance_m: float) -> float:
    """Speed on the circle that touches both legs of a corner of `angle_rad`, `distance_m` before and after it.

    π is straight on, 0 is a reversal.
    """
    return math.sqrt(max(0.0, acceleration * distance_m * math.tan(0.5 * angle_rad)))


def speed_towards(start: Point, target: Point, then: Point, exit_speed: float, limits: Limits) -> float:
    """Speed at `start` of a leg to `target` after which `then` follows, to be left there with `exit_speed`.

    Heights do not count: PX4 turns at full speed into a climb, and past a height that it has not reached.
    """
    out_n, out_e = target[0] - then[0], target[1] - then[1]
    way_n, way_e = target[0] - start[0], target[1] - start[1]
    out = math.sqrt(out_n * out_n + out_e * out_e)
    way = math.sqrt(way_n * way_n + way_e * way_e)
    at_target = 0.0
    if out > 0.001 and out >= limits.xy_acceptance_m:
        cosine = (way_n * out_n + way_e * out_e) / (way * out) if way > 0.0 else 0.0
        angle = min(math.acos(max(-1.0, min(1.0, cosine))), MOST_RAD)
        turning = max_speed_in_waypoint(angle, limits.turn_gain * limits.max_acceleration_xy, limits.xy_acceptance_m)
        at_target = min(turning, exit_speed, limits.max_speed_xy)
    braking = max_speed_from_distance(limits.max_jerk, limits.max_acceleration_xy, way, at_target)
    return min(braking, limits.max_speed_xy)


def speed_through(start: Point, target: Point, then: Point, limits: Limits) -> float:
    """Speed at `start` of the way over `target` to `then`, where it stops."""
    leaving = speed_towards(target, then, then, 0.0, limits)
    return speed_towards(start, target, then, leaving, limits)
