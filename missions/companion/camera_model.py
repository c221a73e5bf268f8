"""The camera as its companion knows it: pinhole intrinsics, mounts, and where a point of the world is seen.

Camera axes: x right and y down in the picture, z along the optical axis. Pixel (0, 0) is the middle of the top left
pixel; the principal point is the middle of the picture. Positions are metres NED from whatever origin the caller keeps
to (the autopilot's local origin); attitude is the quaternion (w, x, y, z) body FRD to NED, as in ATTITUDE_QUATERNION.
No lens distortion: pictures are taken as rectified.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Quaternion = tuple[float, float, float, float]
Point = tuple[float, float, float]


class CameraModel(NamedTuple):
    """Picture size in pixels and horizontal field of view."""

    width: int = 640
    height: int = 480
    hfov_deg: float = 90.0

    @property
    def focal_px(self) -> float:
        """Focal length of both axes."""
        return self.width / 2.0 / math.tan(math.radians(self.hfov_deg) / 2.0)

    def ray(self, x_px: float, y_px: float) -> FloatArray:
        """Direction (3,) through a pixel, in camera axes, with z = 1."""
        focal = self.focal_px
        return np.array(((x_px - (self.width - 1) / 2.0) / focal, (y_px - (self.height - 1) / 2.0) / focal, 1.0))


class Mount(NamedTuple):
    """Where the camera sits in the body (forward, right, down, in metres) and how far below the horizon it looks."""

    forward_m: float
    right_m: float
    down_m: float
    depression_deg: float


NADIR = Mount(0.0, 0.0, 0.15, 90.0)
"""Below a UAS, looking straight down, the picture's top forward."""
MAST = Mount(0.2, 0.0, -1.8, 60.0)
"""On a UGV's mast, 2 m above the ground."""


class CameraPose(NamedTuple):
    """Where the camera is, and the rotation (3, 3) from its axes to NED."""

    position_m: FloatArray
    to_ned: FloatArray


def body_to_ned(q: Quaternion) -> FloatArray:
    """Rotation matrix (3, 3) of a unit quaternion."""
    w, x, y, z = q
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


def camera_pose(position_ned_m: Point, q: Quaternion, mount: Mount) -> CameraPose:
    """The camera's pose from its vehicle's."""
    body = body_to_ned(q)
    s, c = math.sin(math.radians(mount.depression_deg)), math.cos(math.radians(mount.depression_deg))
    to_body = np.array(((0.0, -s, c), (1.0, 0.0, 0.0), (0.0, c, s)))
    return CameraPose(np.asarray(position_ned_m) + body @ np.array(mount[:3]), body @ to_body)


def project(camera: CameraModel, pose: CameraPose, point_ned_m: Point) -> tuple[float, float] | None:
    """The pixel (x, y) at which a point appears, perhaps beyond the picture's edge; None if it lies behind."""
    x, y, z = (pose.to_ned.T @ (np.asarray(point_ned_m) - pose.position_m)).tolist()
    if z <= 0.05:
        return None
    focal = camera.focal_px
    return x / z * focal + (camera.width - 1) / 2.0, y / z * focal + (camera.height - 1) / 2.0


def in_view(camera: CameraModel, pose: CameraPose, point_ned_m: Point, margin_px: float = 0.0) -> bool:
    """Whether a point appears at least `margin_px` inside the picture's edges."""
    pixel = project(camera, pose, point_ned_m)
    if pixel is None:
        return False
    x, y = pixel
    return margin_px <= x <= camera.width - 1 - margin_px and margin_px <= y <= camera.height - 1 - margin_px


def gsd_m(camera: CameraModel, pose: CameraPose, ground_down_m: float) -> float | None:
    """Ground sampling distance on the optical axis (metres a pixel), above level ground; None if it looks up."""
    drop = float(pose.to_ned[2, 2])
    above = ground_down_m - float(pose.position_m[2])
    if drop < 0.2 or above <= 0.0:
        return None
    return above / drop / camera.focal_px
