"""Where a parcel has come to lie, as the camera sees it: what has changed since just before it was let go.

Two pictures from over the place become two pieces of one map of the ground, by their poses and the lens; poses err by
pixels, so the second is then laid on the first by its looks (G. Evangelidis and E. Psarakis, Parametric image alignment
using enhanced correlation coefficient maximization, IEEE TPAMI 2008). Where they differ by more than noise something
has come or gone (R. Radke et al., Image change detection algorithms: a systematic survey, IEEE TIP 2005). The parcel is
the strongest change of a parcel's size, where a change counts the less the farther it is from where the parcel was to
lie: what stands higher than the ground shifts between two pictures, too.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose
from sitl_emu.missions.companion.terrain.features import Gray

REACH_M = 5.0
"""Of the map, to each side: pictures are the better laid on each other the more they show."""
WITHIN_M, SPREAD_M = 3.0, 1.0
"""So far from where it is to lie it is looked for, and how far it lies from there: from 10 m within 1.4 m
nine times of ten (vehicles/README.md), with what the receiver is off between the two pictures; ours."""
CELL_M = 0.03
"""Of the map; from 7 m a pixel of the camera is 0.022 m."""
LEAST_M2, MOST_M2 = 0.0035, 0.25
"""Four cells: its shadow alone, where it is as light as the ground; and a parcel with its shadow under a sun 15 degrees
high; ours."""
NOISE_SIGMAS, LEAST_LEVELS = 6.0, 14.0
"""What a change is more than: the pictures' own noise, and grey levels of 255; ours."""
BLUR_CELLS = 1.2
ALIGNED_STEPS, ALIGNED_WITHIN = 60, 1e-5
"""When the pictures' correlation rises by less, they lie on each other."""


class View(NamedTuple):
    """A picture, and from where it was taken."""

    time_us: int
    gray: Gray
    pose: CameraPose


def find(before: View, after: View, camera: CameraModel, about_m: Corner, ground_down_m: float) -> Corner | None:
    """North and east of the parcel in `after`, near `about_m` on level ground; None where none is seen.

    Metres are those of the poses.
    """
    old, old_seen = _map(before, camera, about_m, ground_down_m)
    new, new_seen = _map(after, camera, about_m, ground_down_m)
    both = (old_seen & new_seen).astype(np.uint8)
    if not both.any():
        return None
    warp = np.eye(2, 3, dtype=np.float32)
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, ALIGNED_STEPS, ALIGNED_WITHIN)
    try:
        _, warp = cv2.findTransformECC(new, old, warp, cv2.MOTION_AFFINE, until, both, 5)
    except cv2.error:  # nothing in them to be aligned by
        return None
    size = new.shape[1], new.shape[0]
    laid = cv2.warpAffine(old, warp, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    there = cv2.warpAffine(both, warp, size, flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP) & both
    change = np.abs(cv2.GaussianBlur(new, (0, 0), BLUR_CELLS) - cv2.GaussianBlur(laid, (0, 0), BLUR_CELLS))
    change[cv2.erode(there, np.ones((5, 5), np.uint8)) == 0] = 0.0
    return _strongest(change, about_m)


def _map(
    view: View, camera: CameraModel, about_m: Corner, down_m: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """The ground about a place, north up, and which of it the picture shows."""
    reach = np.arange(-REACH_M, REACH_M, CELL_M) + CELL_M / 2.0
    north, east = np.meshgrid(about_m[0] - reach, about_m[1] + reach, indexing="ij")
    points = np.stack((north, east, np.full(north.shape, down_m)), axis=-1).reshape(-1, 3)
    to_camera = view.pose.to_ned.T
    turn, shift = cv2.Rodrigues(to_camera)[0], -to_camera @ view.pose.position_m
    lens = np.array(((camera.fx, 0.0, camera.cx), (0.0, camera.fy, camera.cy), (0.0, 0.0, 1.0)))
    pixels, _ = cv2.projectPoints(points, turn, shift, lens, np.array(camera.distortion))
    x, y = (each.reshape(north.shape).astype(np.float32) for each in pixels[:, 0].T)
    depth = (points @ to_camera[2] + shift[2]).reshape(north.shape)
    seen = (depth > 0.1) & (x >= 0.0) & (x <= camera.width - 1.0) & (y >= 0.0) & (y <= camera.height - 1.0)
    return np.asarray(cv2.remap(view.gray, x, y, cv2.INTER_LINEAR), np.float32), seen


def _strongest(change: npt.NDArray[np.float32], about_m: Corner) -> Corner | None:
    """The middle of the strongest change of a parcel's size, as north and east."""
    known = change[change > 0.0]
    noise = 1.4826 * float(np.median(known)) if len(known) else 0.0
    mask = (change > max(NOISE_SIGMAS * noise, LEAST_LEVELS)).astype(np.uint8)
    count, labels, stats, middles = cv2.connectedComponentsWithStats(mask)
    away_m = (middles[:, ::-1] + 0.5) * (-CELL_M, CELL_M) + (REACH_M, -REACH_M)
    area_m2, away2_m2 = stats[:, cv2.CC_STAT_AREA] * CELL_M**2, np.sum(away_m**2, axis=1)
    fits = (area_m2 >= LEAST_M2) & (area_m2 <= MOST_M2) & (away2_m2 <= WITHIN_M**2)
    fits[0] = False  # what has not changed
    if not fits.any():
        return None
    strength = np.bincount(labels.reshape(-1), change.reshape(-1), minlength=count)
    north_m, east_m = away_m[np.argmax(np.where(fits, strength * np.exp(-0.5 * away2_m2 / SPREAD_M**2), -1.0))]
    return about_m[0] + float(north_m), about_m[1] + float(east_m)
