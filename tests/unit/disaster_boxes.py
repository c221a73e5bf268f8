"""What a faultless detector draws about areas on the ground, as a camera that looks straight down sees them."""

import numpy as np

from sitl_emu.core.attitude import quaternion
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, CameraPose, camera_pose, project
from sitl_emu.missions.companion.detector import Detection

CAMERA = CameraModel()
LABELS = ("water_body", "fire_region")
UP_M = 20.0
Box = tuple[float, float, float, float]
"""South, west, north, east in metres."""
POND: Box = (10.0, 10.0, 20.0, 18.0)


def pose_at(
    north_m: float, east_m: float, yaw_rad: float = 0.0, tilt_rad: float = 0.0, up_m: float = UP_M
) -> CameraPose:
    return camera_pose((north_m, east_m, -up_m), quaternion(0.0, tilt_rad, yaw_rad), NADIR)


def box_of(pose: CameraPose, area: Box, label: str = "water_body", score: float = 0.8) -> list[Detection]:
    """What a faultless detector draws about an area on ground at height 0; nothing where it is out of the picture."""
    south, west, north, east = area
    steps = np.linspace(0.0, 1.0, 21)
    edge = [(south + t * (north - south), e) for t in steps for e in (west, east)]
    edge += [(n, west + t * (east - west)) for t in steps for n in (south, north)]
    pixels = [pixel for n, e in edge if (pixel := project(CAMERA, pose, (n, e, 0.0))) is not None]
    xs, ys = (np.array(one) for one in zip(*pixels, strict=True))
    left, right = max(xs.min(), 0.0), min(xs.max(), CAMERA.width - 1.0)
    top, bottom = max(ys.min(), 0.0), min(ys.max(), CAMERA.height - 1.0)
    if right - left < 2.0 or bottom - top < 2.0:
        return []
    return [Detection(label, score, (left + right) / 2, (top + bottom) / 2, right - left, bottom - top)]
