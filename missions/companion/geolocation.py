"""From pixels to a place on the ground.

A detection is a ray: from the camera's position along the direction of its pixel, turned by the mount and the whole
attitude (heading, pitch and roll) at the time the frame was taken.

Where the ray ends takes a height of the ground. Where a survey flies, above 12 m, the lidar is blind, and the height
comes from the pictures themselves: a target is seen in many frames from places metres apart, and the point nearest to
all its rays, in the sense of least squares, has a height too. Until the rays cross at an angle, a weak prior holds the
height to that of home. So relief needs no map, and level ground is only assumed for the first look. A lidar's ranges,
which lower flights have (`gcs.telemetry.Telemetry.range_at`), are not used here.

Least squares: the point x minimises the sum of w |(I - d d') (x - p)|^2 over rays (p, d), plus the prior on its down
component; w = 1 / (range * sigma)^2 makes a ray's miss an angle, so near looks weigh more. Noise is taken as
independent between frames; what is not (GPS drift, a mount that is off) remains in the result.
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, FloatArray, Point

RAY_SIGMA_RAD = math.radians(1.0)
"""Attitude error, time match and a box's wobble together."""
HOME_HEIGHT_SIGMA_M = 2.0
"""How far the ground under a target may be from home's height: a field's relief."""
LEAST_DROP, LEAST_RANGE_M = 0.1, 0.5
"""Of a ray's unit vector downwards, and of its range, as a guess for its weight: none weighs without bounds; ours."""


class Ray(NamedTuple):
    """A line of sight: from a place (metres NED) along a unit direction."""

    origin_m: FloatArray
    direction: FloatArray


def pixel_ray(camera: CameraModel, pose: CameraPose, x_px: float, y_px: float) -> Ray:
    """The line of sight of a pixel."""
    direction = pose.to_ned @ camera.ray(x_px, y_px)
    return Ray(pose.position_m, direction / np.linalg.norm(direction))


def on_level_ground(ray: Ray, ground_down_m: float) -> Point | None:
    """Where a ray meets level ground; None if it never does, or only beyond 150 m."""
    drop = ground_down_m - float(ray.origin_m[2])
    down = float(ray.direction[2])
    if down <= 1e-3 or drop <= 0.0 or drop / down > 150.0:
        return None
    north, east, _ = (ray.origin_m + ray.direction * (drop / down)).tolist()
    return north, east, ground_down_m


class Covariance(NamedTuple):
    """Of a place in NED, in m²: the six numbers of a symmetric matrix, row by row."""

    nn: float
    ne: float
    nd: float
    ee: float
    ed: float
    dd: float

    @property
    def horizontal_sigma_m(self) -> float:
        """One sigma of the distance on the map, as a receiver's `eph` is one."""
        return math.sqrt(self.nn + self.ee)

    def with_receiver(self, eph_m: float, epv_m: float) -> "Covariance":
        """The same for a place on Earth: what all rays share, the receiver's own error, does not average out."""
        along = eph_m * eph_m / 2.0
        return self._replace(nn=self.nn + along, ee=self.ee + along, dd=self.dd + epv_m * epv_m)


class Intersection:
    """The running least-squares intersection of rays."""

    __slots__ = ("_a", "_b", "_c", "_prior_down_m", "_prior_weight", "_weights", "count", "first", "spread_rad")

    def __init__(self, ground_down_m: float, sigma_m: float = HOME_HEIGHT_SIGMA_M) -> None:
        weight = 1.0 / sigma_m**2
        self._a: FloatArray = np.diag((1e-9, 1e-9, weight))
        self._b: FloatArray = np.array((0.0, 0.0, weight * ground_down_m))
        self._c = 0.0
        self._prior_weight, self._prior_down_m = weight, ground_down_m
        self._weights = 0.0
        self.count = 0
        self.first: Ray | None = None
        self.spread_rad = 0.0
        """Largest angle between the first ray and another: how well the rays tell the height."""

    def add(self, ray: Ray, ground_down_m: float) -> None:
        """Takes in one more ray; `ground_down_m` is a guess for its range."""
        along = max(float(ray.direction[2]), LEAST_DROP)
        range_m = max((ground_down_m - float(ray.origin_m[2])) / along, LEAST_RANGE_M)
        weight = 1.0 / (range_m * RAY_SIGMA_RAD) ** 2
        across = weight * (np.eye(3) - np.outer(ray.direction, ray.direction))
        self._a += across
        pulled = across @ ray.origin_m
        self._b += pulled
        self._c += float(ray.origin_m @ pulled)
        self._weights += weight
        self.count += 1
        if self.first is None:
            self.first = ray
        else:
            cosine = min(1.0, float(ray.direction @ self.first.direction))
            self.spread_rad = max(self.spread_rad, math.acos(max(-1.0, cosine)))

    def merge(self, other: "Intersection") -> None:
        """Takes in the rays of another intersection, of the same target and with the same prior."""
        self._a += other._a
        self._b += other._b
        self._c += other._c
        self._weights += other._weights
        self._prior_weight += other._prior_weight
        self.count += other.count
        self.spread_rad = max(self.spread_rad, other.spread_rad)

    def point(self) -> Point:
        """The point nearest to all rays so far (metres NED); at least one ray must have been added."""
        north, east, down = np.linalg.solve(self._a, self._b).tolist()
        return north, east, down

    def covariance(self) -> Covariance:
        """How well the rays tell the point, by their own noise alone (`RAY_SIGMA_RAD`): independent between frames."""
        (nn, ne, nd), (_, ee, ed), (_, _, dd) = np.linalg.inv(self._a).tolist()
        return Covariance(nn, ne, nd, ee, ed, dd)

    def residual_m(self) -> float:
        """How far the rays pass by the point, root mean square: much more than their noise says is no one place."""
        if self._weights == 0.0:
            return 0.0
        point = np.linalg.solve(self._a, self._b)
        rays = self._a - np.diag((0.0, 0.0, self._prior_weight))
        pulled = self._b - np.array((0.0, 0.0, self._prior_weight * self._prior_down_m))
        squares = float(point @ rays @ point - 2.0 * pulled @ point) + self._c
        return math.sqrt(max(0.0, squares) / self._weights)
