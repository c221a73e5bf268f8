"""Single-beam lidar along the body's down axis, against the terrain and what stands on it.

The beam is followed by fixed-point iteration on the height map (which converges on slopes less steep than the beam
is from the horizon). Nothing in range is reported as MAVLink's convention and PX4 expect it: current_distance one
centimetre above max_distance, signal quality 1 ("invalid"). Below the ground, where SIH's vehicles stand, PX4's own
(`is_px4s`) says how far below and 1 (Sih::send_dist_snsr): a negative number, of which 16 bits are left. It errs by
white noise and by an error that lasts. Canopy and crop of a world's `cover` are met where they have leaves; water is
heard from steeply above alone, and never what lies below it (`areas.py`). Flames, smoke and the corn field's plants
are not seen.
"""

import math
from typing import Final

from sitl_emu.core.c_types import integer
from sitl_emu.core.simulator_api import DistanceSensor
from sitl_emu.vehicles.description import Lidar as LidarData
from sitl_emu.vehicles.dynamics import Quaternion, Vector3
from sitl_emu.world.ground import Terrain
from sitl_emu.world.noise import normals
from sitl_emu.world.obstacles import Areas, Obstacles

LASER: Final = 0
DOWNWARD_FACING: Final = 25
ITERATIONS: Final = 8
OVERRIDE_OFF_M: Final = 10_000.0
TOLERANCE_M: Final = 0.005
UNKNOWN: Final = 0
NO_SIGNAL: Final = 1
GOOD_SIGNAL: Final = 100
"""DISTANCE_SENSOR.signal_quality: 0 is "unknown", 1 invalid, 100 perfect."""


class Lidar:
    """Makes DISTANCE_SENSOR."""

    def __init__(
        self,
        data: LidarData,
        terrain: Terrain,
        seed: int,
        name: str,
        obstacles: Obstacles | None = None,
        areas: Areas | None = None,
    ) -> None:
        self.data = data
        """May be replaced: PX4's SIH_DISTSNSR_MIN, SIH_DISTSNSR_MAX."""
        self._terrain, self._obstacles, self._areas = terrain, obstacles, areas
        self._draw = normals(seed, name, "lidar")
        self._wrong = max(-1.0, min(1.0, 0.5 * normals(seed, name, "lidar accuracy")()))
        """Its lasting error, over the greatest."""
        self.override_m = -1.0
        """PX4's SIH_DISTSNSR_OVR: what it says instead of what it sees; negative: nothing."""
        self._quality, self._no_quality = (GOOD_SIGNAL, NO_SIGNAL) if data.tells_quality else (UNKNOWN, UNKNOWN)

    @property
    def is_off(self) -> bool:
        """Such an override silences it (Sih::sensor_step)."""
        return not abs(self.override_m) < OVERRIDE_OFF_M

    def read(self, time_us: int, north_m: float, east_m: float, down_m: float, attitude: Quaternion) -> DistanceSensor:
        """One shot from the vehicle's centre."""
        data = self.data
        along = beam(self._terrain, north_m, east_m, down_m, attitude, data.max_distance_m)
        distance = max(along, 0.0)
        if self._obstacles is not None:
            axis = body_down(attitude)
            met = self._obstacles.ray((north_m, east_m, down_m), axis, data.max_distance_m)
            distance = min(distance, met[0]) if met is not None else distance
        if self._areas is not None:
            axis = body_down(attitude)
            distance = self._areas.heard((north_m, east_m, down_m), axis, distance, data.max_distance_m)
        near = min(distance, data.max_distance_m)
        noise_m = max(data.noise_m, data.noise_share * near)
        accuracy_m = max(data.accuracy_m, data.accuracy_share * near)
        seen = distance + accuracy_m * self._wrong + noise_m * self._draw()
        if self.override_m >= 0.0:
            seen = self.override_m
        in_range = data.min_distance_m <= seen <= data.max_distance_m
        max_cm = round(data.max_distance_m * 100)
        is_grounded = data.is_px4s and along <= 0.0 and self.override_m < 0.0
        return DistanceSensor(
            time_us // 1000,
            round(data.min_distance_m * 100),
            max_cm,
            integer("H", 100.0 * along) if is_grounded else round(seen * 100) if in_range else max_cm + 1,
            LASER,
            0,
            DOWNWARD_FACING,
            min(255, round(1e4 * (noise_m**2 + 0.25 * accuracy_m**2))),
            0.0,
            0.0,
            (0.0, 0.0, 0.0, 0.0),
            NO_SIGNAL if is_grounded else self._quality if in_range else self._no_quality,
        )


def body_down(attitude: Quaternion) -> Vector3:
    """The body's down axis in NED."""
    w, x, y, z = attitude
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


def beam(
    terrain: Terrain, north_m: float, east_m: float, down_m: float, attitude: Quaternion, max_distance_m: float
) -> float:
    """Length (m) of a ray along body down to the ground; inf when it meets none within `max_distance_m`.

    Negative below the ground.
    """
    dn, de, dd = body_down(attitude)
    if dd <= 0.05:
        return math.inf
    distance = 0.0
    for _ in range(ITERATIONS):
        ground = terrain.height_m(north_m + distance * dn, east_m + distance * de)
        further = (-down_m - ground) / dd
        if abs(further - distance) < TOLERANCE_M:
            distance = further
            break
        distance = min(further, 2.0 * max_distance_m)
    return distance if distance <= max_distance_m else math.inf
