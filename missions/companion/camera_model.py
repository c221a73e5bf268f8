"""The camera as its companion knows it: pinhole intrinsics, mounts, and where a point of the world is seen.

Camera axes: x right and y down in the picture, z along the optical axis. Pixel (0, 0) is the middle of the top left
pixel. Positions are metres NED from whatever origin the caller keeps to (the autopilot's local origin); attitude is the
quaternion (w, x, y, z) body FRD to NED, as in ATTITUDE_QUATERNION. The lens' distortion is OpenCV's
(https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html): `project` applies it, `CameraModel.ray` undoes it. A camera is
read from its calibration file (`calibration.py`).
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Quaternion = tuple[float, float, float, float]
Point = tuple[float, float, float]
UNDISTORT_STEPS = 50
UNDISTORTED_WITHIN = 1e-9
"""In focal lengths: far below what a pixel tells."""


class Distortion(NamedTuple):
    """OpenCV's coefficients, in its order; all 0: none."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0


class CameraModel(NamedTuple):
    """Picture size, focal lengths and principal point in pixels, and distortion; by default 90 degrees across."""

    width: int = 640
    height: int = 480
    fx: float = 320.0
    fy: float = 320.0
    cx: float = 319.5
    cy: float = 239.5
    distortion: Distortion = Distortion()
    readout_s: float = 0.0
    """From the first row's exposure to the last one's, of a rolling shutter; a frame's time is its middle row's."""

    @property
    def focal_px(self) -> float:
        """Focal length, the mean of both axes: for distances on the ground."""
        return (self.fx + self.fy) / 2.0

    def misfit(self, rows: int, columns: int) -> str:
        """What is wrong with pictures of a size that it is not calibrated for: where they lie is not known; else ""."""
        if (columns, rows) == (self.width, self.height):
            return ""
        calibrated = f"the camera is calibrated for {self.width} x {self.height}"
        return f"pictures of {columns} x {rows}, and {calibrated}: give its own `calibration`"

    def ray(self, x_px: float, y_px: float) -> FloatArray:
        """Direction (3,) through a pixel, in camera axes, with z = 1."""
        x, y = (x_px - self.cx) / self.fx, (y_px - self.cy) / self.fy
        if any(self.distortion):
            x, y = undistorted(x, y, self.distortion)
        return np.array((x, y, 1.0))


def distorted(x: float, y: float, lens: Distortion) -> tuple[float, float]:
    """Where a direction (x, y, 1) appears, in focal lengths from the principal point."""
    k1, k2, p1, p2, k3 = lens
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), y * radial + p1 * (
        r2 + 2.0 * y * y
    ) + 2.0 * p2 * x * y


def undistorted(x: float, y: float, lens: Distortion) -> tuple[float, float]:
    """The direction (x, y, 1) that appears at a place: the inverse of `distorted`, by Newton's steps along the radius.

    The tangential part is small: what it moves is put right from step to step.
    """
    from_x, from_y = x, y
    for _ in range(UNDISTORT_STEPS):
        at_x, at_y = distorted(from_x, from_y, lens)
        miss_x, miss_y = x - at_x, y - at_y
        if math.hypot(miss_x, miss_y) < UNDISTORTED_WITHIN:
            break
        r2 = from_x * from_x + from_y * from_y
        radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
        slope = radial + 2.0 * r2 * (lens.k1 + r2 * (2.0 * lens.k2 + 3.0 * r2 * lens.k3))
        # along the radius the picture grows by `slope`, across it by `radial`
        along = (miss_x * from_x + miss_y * from_y) / r2 if r2 > 0.0 else 0.0
        from_x, from_y = (
            from_x + (miss_x - along * from_x) / radial + along * from_x / slope,
            from_y + (miss_y - along * from_y) / radial + along * from_y / slope,
        )
    return from_x, from_y


class Mount(NamedTuple):
    """Where the camera sits in the body (forward, right, down, in metres) and how far below the horizon it looks."""

    forward_m: float
    right_m: float
    down_m: float
    depression_deg: float
    on_gimbal: bool = False
    """It sits on a gimbal's head there, which tells where it looks (GIMBAL_DEVICE_ATTITUDE_STATUS)."""


NADIR = Mount(0.0, 0.0, 0.15, 90.0)
"""Below a UAS, looking straight down, the picture's top forward."""
MAST = Mount(0.2, 0.0, -1.8, 60.0)
"""On a UGV's mast, 2 m above the ground."""


class CameraPose(NamedTuple):
    """Where the camera is, and the rotation (3, 3) from its axes to NED."""

    position_m: FloatArray
    to_ned: FloatArray


class Sweep(NamedTuple):
    """Where the camera was when its first and its last row were read: of a global shutter the same."""

    first: CameraPose
    last: CameraPose

    def origins_m(self, shares: FloatArray) -> FloatArray:
        """Where it was (n, 3) at rows, given as shares (n,) of the way from the first to the last."""
        return self.first.position_m + shares[:, None] * (self.last.position_m - self.first.position_m)

    def directions(self, rays: FloatArray, shares: FloatArray) -> FloatArray:
        """Unit vectors NED (n, 3) of directions (n, 3) in camera axes, that were seen in those rows.

        Between the two attitudes it goes evenly: they differ by what a camera turns in a frame.
        """
        first, last = rays @ self.first.to_ned.T, rays @ self.last.to_ned.T
        turned = first + shares[:, None] * (last - first)
        return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


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


def camera_pose(position_ned_m: Point, q: Quaternion, mount: Mount, head: Quaternion | None = None) -> CameraPose:
    """The camera's pose from its vehicle's, and from the attitude (to NED) of the gimbal's head that carries it."""
    body = body_to_ned(q)
    turned = body if head is None else body_to_ned(head)
    s, c = math.sin(math.radians(mount.depression_deg)), math.cos(math.radians(mount.depression_deg))
    to_body = np.array(((0.0, -s, c), (1.0, 0.0, 0.0), (0.0, c, s)))
    return CameraPose(np.asarray(position_ned_m) + body @ np.array(mount[:3]), turned @ to_body)


def depth_points(camera: CameraModel, pose: CameraPose, depth_m: npt.NDArray[np.float32]) -> FloatArray:
    """The points (height, width, 3) NED that a depth image shows; not finite where it shows none."""
    rows, columns = np.mgrid[0 : camera.height, 0 : camera.width]
    x, y = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
    if any(camera.distortion):
        pairs = np.array([undistorted(*at, camera.distortion) for at in zip(x.flat, y.flat, strict=True)])
        x, y = pairs[:, 0].reshape(x.shape), pairs[:, 1].reshape(y.shape)
    rays = np.stack((x, y, np.ones(x.shape)), axis=-1) @ pose.to_ned.T
    with np.errstate(invalid="ignore"):
        return np.asarray(pose.position_m + depth_m[..., None] * rays)


def body_points(position_ned_m: Point, q: Quaternion, points_m: npt.NDArray[np.float32]) -> FloatArray:
    """The points (n, 3) of a scan, given in body axes, in NED."""
    return np.asarray(np.asarray(position_ned_m) + points_m @ body_to_ned(q).T)


def project(camera: CameraModel, pose: CameraPose, point_ned_m: Point) -> tuple[float, float] | None:
    """The pixel (x, y) at which a point appears, perhaps beyond the picture's edge; None if it lies behind."""
    x, y, z = (pose.to_ned.T @ (np.asarray(point_ned_m) - pose.position_m)).tolist()
    if z <= 0.05:
        return None
    x, y = x / z, y / z
    if any(camera.distortion):
        x, y = distorted(x, y, camera.distortion)
    return x * camera.fx + camera.cx, y * camera.fy + camera.cy


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
