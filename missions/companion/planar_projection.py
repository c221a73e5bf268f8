"""Location by the heading alone: the "heading-aware pixel-to-GPS" equations 1 to 3 of Sirsavkar et al., as printed.

*An End-to-End Autonomous UAV System for Disaster Response* (2026), section 2.3: from a pixel's offset (Δu, Δv) from the
picture's centre, the camera's height h above the ground, its fields of view and the UAV's yaw ψ:

    x_g = h tan(FOV_x / 2) 2 Δu / W        y_g = h tan(FOV_y / 2) 2 Δv / H                      (1), (2)
    north = cos ψ x_g - sin ψ y_g          east = sin ψ x_g + cos ψ y_g
    Δlat = north / R_Earth                 Δlon = east / (R_Earth cos lat)                      (3)

**Mounting.** The paper does not say how the camera is mounted, nor which way Δu and Δv count. Taken as pictures are (Δu
to the right, Δv down), the equations place at ψ = 0 what is right in the picture in the north, and what is below in the
east: they are right for a camera that looks straight down with the *picture's right side forward*, its top to the
vehicle's left. With the picture's top forward, as is usual and as ours are mounted (`camera_model.NADIR`), they miss
by a quarter of a turn: by √2 of the offset, at every heading, the more the nearer a target is to the picture's edge.
No choice of the two signs mends that: x_g is along the nose by the rotation, and across the picture by (1). What mends
it is ψ: the azimuth to which the picture's right side looks, a quarter of a turn more than the vehicle's yaw. `yaw_rad`
is that angle; `placed` takes it from the camera's pose, so it is right for either mount.

**What they leave out.** With that ψ, a level camera, flat ground at the height assumed and a lens without distortion
they agree with `geolocation` to rounding (tests/unit/test_planar_projection.py, four headings). Else they are off by

- tilt: h (tan(a + tilt) - tan a) for a pixel at the angle a from the axis: at 20 m above ground 1.7 m for 5 degrees
  in the picture's middle, 3.8 m at the edge (45 degrees). A gimbal that holds the camera level takes it away;
- relief: a ground r higher than assumed, by r tan a: nothing in the middle, r at the edge. A map of the terrain takes
  it away;
- the lens' distortion, as far as it was not taken out of the picture;
- where the camera sits off the vehicle's origin: `placed` counts from the camera.

They state no uncertainty.
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.gcs.geodesy import EARTH_RADIUS_M
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, FloatArray, Point


class Offset(NamedTuple):
    """On the ground, from the point below the camera, in metres."""

    north_m: float
    east_m: float


def ground_offset(camera: CameraModel, height_m: float, yaw_rad: float, du_px: float, dv_px: float) -> Offset:
    """Equations 1 and 2, and the rotation. `yaw_rad`: the heading, for a camera with the picture's right side forward.

    (`du_px`, `dv_px`): right and down from the picture's centre.
    """
    x_g = height_m * _tan_half_fov(camera.width, camera.fx) * 2.0 * du_px / camera.width
    y_g = height_m * _tan_half_fov(camera.height, camera.fy) * 2.0 * dv_px / camera.height
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return Offset(c * x_g - s * y_g, s * x_g + c * y_g)


def moved(lat_deg: float, lon_deg: float, offset: Offset) -> tuple[float, float]:
    """Equation 3: latitude and longitude in degrees of what lies so far from a place. R_Earth is PX4's 6 371 000 m."""
    lat = lat_deg + math.degrees(offset.north_m / EARTH_RADIUS_M)
    lon = lon_deg + math.degrees(offset.east_m / (EARTH_RADIUS_M * math.cos(math.radians(lat_deg))))
    return lat, lon


def placed(camera: CameraModel, pose: CameraPose, x_px: float, y_px: float, ground_down_m: float) -> Point | None:
    """Where a pixel's target is on ground at a height, as `geolocation.on_level_ground(pixel_ray(…), …)` tells it.

    Of the camera's attitude only the heading counts: the azimuth at which the picture's top lies, and a quarter turn.
    None for a camera that is not above the ground.
    """
    height_m = ground_down_m - float(pose.position_m[2])
    if height_m <= 0.0:
        return None
    right_rad = _right_rad(pose)
    centre = (camera.width - 1) / 2.0, (camera.height - 1) / 2.0
    north_m, east_m = ground_offset(camera, height_m, right_rad, x_px - centre[0], y_px - centre[1])
    return float(pose.position_m[0]) + north_m, float(pose.position_m[1]) + east_m, ground_down_m


def pixels(
    camera: CameraModel, pose: CameraPose, north_m: FloatArray, east_m: FloatArray, ground_m: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """The pixels (x, y) at which places appear by equations 1 and 2, the other way round; arrays of one shape.

    `ground_m`: heights of the places. NaN for a camera that is not above them.
    """
    right_rad = _right_rad(pose)
    c, s = math.cos(right_rad), math.sin(right_rad)
    north, east = north_m - pose.position_m[0], east_m - pose.position_m[1]
    height = -float(pose.position_m[2]) - ground_m
    height = np.where(height > 0.0, height, np.nan)
    du = (c * north + s * east) * camera.width / (2.0 * height * _tan_half_fov(camera.width, camera.fx))
    dv = (c * east - s * north) * camera.height / (2.0 * height * _tan_half_fov(camera.height, camera.fy))
    return (camera.width - 1) / 2.0 + du, (camera.height - 1) / 2.0 + dv


def _right_rad(pose: CameraPose) -> float:
    """The azimuth to which the picture's right side looks."""
    up_north, up_east = -float(pose.to_ned[0, 1]), -float(pose.to_ned[1, 1])
    return math.atan2(up_east, up_north) + math.pi / 2.0


def _tan_half_fov(pixels: int, focal_px: float) -> float:
    return math.tan(math.atan(pixels / 2.0 / focal_px))
