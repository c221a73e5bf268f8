"""What a run's sensors have measured, as sensor_msgs: pure functions from a feed's frame to a message's fields.

Pictures and clouds are as the feeds have them; what differs is the frame, and that a scan of one plane is a LaserScan,
too. Where nothing is near enough it is inf (REP 117, 118).
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sitl_emu.run.configs import LidarDescription
from sitl_emu.run.messages import RangeSeen
from sitl_emu.run.picture_files import jpeg
from sitl_emu.run.ros.frames import header
from sitl_emu.world.lens import Intrinsics

Array = npt.NDArray[Any]
JPEG_QUALITY = 95
"""image_transport's compressed plugin, its default."""
FLOAT32 = 7
"""sensor_msgs/PointField."""
INFRARED = 1
"""sensor_msgs/Range.radiation_type: a lidar's light is infrared."""


def image(time_us: int, frame: str, picture: Array, encoding: str) -> dict[str, Any]:
    """sensor_msgs/Image of (height, width) or (height, width, channels)."""
    height, width = picture.shape[:2]
    return {
        "header": header(time_us, frame),
        "height": height,
        "width": width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": picture.strides[0],
        "data": picture.tobytes(),
    }


def compressed_image(time_us: int, frame: str, picture: Array) -> dict[str, Any]:
    """sensor_msgs/CompressedImage of (height, width, 3), BGR, as image_transport's plugin makes it."""
    data = jpeg(picture, JPEG_QUALITY)
    return {"header": header(time_us, frame), "format": "bgr8; jpeg compressed bgr8", "data": data}


def camera_info(time_us: int, frame: str, seen: Intrinsics) -> dict[str, Any]:
    """sensor_msgs/CameraInfo: the principal point in the middle, square pixels, OpenCV's distortion."""
    f, cx, cy = seen.focal_px, (seen.width - 1) / 2.0, (seen.height - 1) / 2.0
    return {
        "header": header(time_us, frame),
        "height": seen.height,
        "width": seen.width,
        "distortion_model": "plumb_bob",
        "d": tuple(seen.distortion),
        "k": (f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0),
        "r": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        "p": (f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0),
        "binning_x": 0,
        "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


def cloud(time_us: int, frame: str, points: Array) -> dict[str, Any]:
    """sensor_msgs/PointCloud2 of (n, 3), or (height, width, 3), NaN where there is none, m, in the frame's axes."""
    height, width = (1, len(points)) if points.ndim == 2 else points.shape[:2]
    axes = [{"name": axis, "offset": 4 * place, "datatype": FLOAT32, "count": 1} for place, axis in enumerate("xyz")]
    return {
        "header": header(time_us, frame),
        "height": height,
        "width": width,
        "fields": axes,
        "is_bigendian": False,
        "point_step": 12,
        "row_step": 12 * width,
        "data": np.asarray(points, "<f4").tobytes(),
        "is_dense": points.ndim == 2,
    }


def depth_points(depth: Array, seen: Intrinsics) -> Array:
    """The points (height, width, 3) of a depth picture in its camera's optical frame; NaN where nothing is near."""
    height, width = depth.shape
    along = np.where(np.isfinite(depth), depth, np.nan)
    x = (np.arange(width) - (width - 1) / 2.0) / seen.focal_px
    y = (np.arange(height) - (height - 1) / 2.0) / seen.focal_px
    return np.stack((along * x, along * y[:, None], along), axis=-1)


def in_lidar(points: Array, lidar: LidarDescription) -> Array:
    """Points (n, 3) of a scan, told in the vehicle's axes (forward, right, down), in its lidar_link's."""
    turn = math.radians(lidar.depression_deg)
    s, c = math.sin(turn), math.cos(turn)
    local = (np.asarray(points, np.float64) - lidar.place_m) @ np.array(((c, 0.0, -s), (0.0, 1.0, 0.0), (s, 0.0, c)))
    return np.asarray(local * (1.0, -1.0, -1.0))


def is_plane(lidar: LidarDescription) -> bool:
    """Whether all that it sees lies in the plane that it spins in: then it is a LaserScan."""
    return lidar.rows == 1 and lidar.elevation_deg[0] == 0.0


def scan(time_us: int, frame: str, points: Array, lidar: LidarDescription) -> dict[str, Any]:
    """sensor_msgs/LaserScan of points (n, 3) in the lidar's axes: from straight ahead to the left, all around."""
    step = math.tau / lidar.columns
    ranges = np.full(lidar.columns, math.inf, np.float32)
    rays = np.rint(np.arctan2(points[:, 1], points[:, 0]) / step).astype(int) % lidar.columns
    ranges[rays] = np.hypot(points[:, 0], points[:, 1])
    return {
        "header": header(time_us, frame),
        "angle_min": 0.0,
        "angle_max": step * (lidar.columns - 1),
        "angle_increment": step,
        "time_increment": 0.0,  # all rays are of one moment
        "scan_time": 1.0 / lidar.rate_hz,
        "range_min": lidar.range_m[0],
        "range_max": lidar.range_m[1],
        "ranges": ranges.tolist(),
        "intensities": (),
    }


def range_(time_us: int, frame: str, seen: RangeSeen) -> dict[str, Any]:
    """sensor_msgs/Range."""
    return {
        "header": header(time_us, frame),
        "radiation_type": INFRARED,
        "field_of_view": seen.field_of_view_rad,
        "min_range": seen.nearest_m,
        "max_range": seen.farthest_m,
        "range": seen.range_m,
        "variance": seen.variance_m2,
    }
