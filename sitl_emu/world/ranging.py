"""Depth cameras and scanning lidars: what they measure, a pure function of world, seed, time and pose.

Both follow rays through the world: ground, solids, standing things, loose bodies, water, foliage and other vehicles, as
the spheres that touch (`World.raycast`); a lidar loses those that water mirrors away (`World.echoes`). A picture or a
scan is of one moment. Their noise is normal and the same at all ranges, drawn anew for each moment.
"""

import math
import zlib
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from sitl_emu.core.attitude import heading
from sitl_emu.world import proximity
from sitl_emu.world.camera import FloatArray, Posed, Quaternion, body_to_ned, camera_to_body
from sitl_emu.world.lens import Intrinsics, Mount
from sitl_emu.world.rays import Hits

Depth = npt.NDArray[np.float32]
"""(height, width), m along the optical axis; inf where nothing is within reach (ROS REP 118)."""
Points = npt.NDArray[np.float32]
"""(n, 3), m, in the vehicle's body axes (forward, right, down) from its origin."""

Cast = Callable[[FloatArray, FloatArray, float, float], Hits]


class Rays(Protocol):
    """What rays are cast into: a `world.World`."""

    def raycast(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """Follow (n, 3) rays at a time."""
        ...

    def echoes(self, origins: FloatArray, directions: FloatArray, time_s: float, reach_m: float) -> Hits:
        """What a laser hears of them."""
        ...


class Noise:
    """Of one sensor: normal, drawn from the run's seed, the sensor's name and the time."""

    def __init__(self, sigma_m: float, seed: int, name: str) -> None:
        self._sigma_m, self._seed = sigma_m, [seed, zlib.crc32(name.encode())]

    def added(self, ranges_m: FloatArray, time_us: int) -> FloatArray:
        """Ranges as they are measured at a time."""
        rng = np.random.Generator(np.random.PCG64([*self._seed, time_us]))
        return ranges_m + rng.normal(scale=self._sigma_m, size=ranges_m.shape)


class DepthCamera:
    """A depth camera without distortion, as `camera.Camera` is mounted."""

    def __init__(self, world: Rays, intrinsics: Intrinsics, mount: Mount, reach_m: float, noise: Noise) -> None:
        self._world, self._reach_m, self._noise = world, reach_m, noise
        self._lever = np.array(mount[:3])
        width, height = intrinsics.width, intrinsics.height
        rows, columns = np.mgrid[0:height, 0:width].reshape(2, -1)
        x, y = (columns - (width - 1) / 2.0) / intrinsics.focal_px, (rows - (height - 1) / 2.0) / intrinsics.focal_px
        rays = np.stack((x, y, np.ones(len(x))))
        self._shape = (height, width)
        self._lengths = np.linalg.norm(rays, axis=0)
        self._rays = camera_to_body(mount) @ (rays / self._lengths)

    def measure(self, pose: Posed, time_us: int, head: Quaternion | None = None) -> Depth:
        """What it measures from a body's pose at a time; `head`: attitude (to NED) of the gimbal's head it sits on."""
        reach_m = self._reach_m * float(self._lengths.max())
        depth = _ranges(self._world.raycast, pose, head, self._lever, self._rays, time_us, reach_m) / self._lengths
        depth[depth > self._reach_m] = math.inf
        return np.asarray(self._noise.added(depth, time_us), np.float32).reshape(self._shape)

    def obstacles(self, depth: Depth, pose: Posed, head: Quaternion | None = None) -> proximity.Obstacles | None:
        """What a picture shows of the obstacles around; None where it shows nothing near the horizon."""
        yaw = heading(pose.q)
        looked = (proximity.levelled(body_to_ned(pose.q if head is None else head), yaw) @ self._rays).T
        met = np.isfinite(depth.ravel())
        lengths = (np.asarray(depth, np.float64).ravel() * self._lengths)[met]
        points = proximity.levelled(body_to_ned(pose.q), yaw) @ self._lever + lengths[:, None] * looked[met]
        return proximity.around(points, looked, 0.0, self._reach_m)


class Scan(NamedTuple):
    """Where a scanning lidar looks, and how far."""

    columns: int
    """All around, from straight ahead clockwise."""
    rows: int
    lowest_deg: float
    highest_deg: float
    """Elevation of the first and the last row above the plane that it spins in."""
    nearest_m: float
    farthest_m: float


class ScanningLidar:
    """A lidar that spins about its own vertical axis; its mount's depression tilts that forward."""

    def __init__(self, world: Rays, scan: Scan, mount: Mount, noise: Noise) -> None:
        self._world, self._scan, self._noise = world, scan, noise
        self._lever = np.array(mount[:3])
        azimuth = np.tile(np.arange(scan.columns) * math.tau / scan.columns, scan.rows)
        elevation = np.repeat(np.radians(np.linspace(scan.lowest_deg, scan.highest_deg, scan.rows)), scan.columns)
        level = np.cos(elevation)
        rays = np.stack((level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)))
        s, c = math.sin(math.radians(mount.depression_deg)), math.cos(math.radians(mount.depression_deg))
        self._rays = np.array(((c, 0.0, -s), (0.0, 1.0, 0.0), (s, 0.0, c))) @ rays

    def measure(self, pose: Posed, time_us: int, head: Quaternion | None = None) -> Points:
        """The points of one scan from a body's pose at a time; rays that meet nothing within reach give none.

        It sits on no gimbal: `head` is None.
        """
        ranges = _ranges(self._world.echoes, pose, head, self._lever, self._rays, time_us, self._scan.farthest_m)
        met = (ranges >= self._scan.nearest_m) & (ranges <= self._scan.farthest_m)
        measured = self._noise.added(ranges, time_us)[met]
        return np.asarray(self._lever + measured[:, None] * self._rays.T[met], np.float32)

    def obstacles(self, points: Points, pose: Posed, head: Quaternion | None = None) -> proximity.Obstacles | None:
        """What a scan shows of the obstacles around; None where it shows nothing near the horizon."""
        level = proximity.levelled(body_to_ned(pose.q), heading(pose.q))
        looked, seen = (level @ self._rays).T, points.astype(np.float64) @ level.T
        return proximity.around(seen, looked, self._scan.nearest_m, self._scan.farthest_m)


def _ranges(
    cast: Cast,
    pose: Posed,
    head: Quaternion | None,
    lever: FloatArray,
    rays: FloatArray,
    time_us: int,
    reach_m: float,
) -> FloatArray:
    """Lengths (n,) of rays (3, n) from a place on a body, in its axes or its gimbal's; inf where nothing is met."""
    origin = np.array((pose.north_m, pose.east_m, pose.down_m)) + body_to_ned(pose.q) @ lever
    directions = np.ascontiguousarray((body_to_ned(pose.q if head is None else head) @ rays).T)
    hits = cast(np.broadcast_to(origin, directions.shape), directions, time_us * 1e-6, reach_m)
    return np.asarray(hits.range_m, np.float64)
