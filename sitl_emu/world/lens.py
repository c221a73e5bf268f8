"""What a camera is: its picture, lens and place on the vehicle, and what its lens does to a direction.

Distortion is OpenCV's model of five coefficients (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html): a direction
(x, y, 1) of the scene appears at

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y,    r² = x² + y²
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
UNDISTORT_STEPS = 20
UNDISTORTED = 1e-12
"""A step of the last of directions below which none follows: the rest is rounding."""
ZOOM_GRID_PX = 4
"""Between the pixels of a zoomed picture that are undistorted; linear between: within 0.03 pixels for k1 of -0.35."""
CLOSE_ENOUGH_PX = 0.05
WIDEST_SOURCE = 4.0
"""A picture whose lens needs more of the scene than so many times its own size is refused: it costs as much to draw."""


class LensError(ValueError):
    """A lens that can't be; the text is one line for people."""


class Distortion(NamedTuple):
    """OpenCV's coefficients, in its order; all 0: none."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0


class Intrinsics(NamedTuple):
    """Picture size, the focal length that the horizontal field of view makes, and the lens' distortion.

    The field of view is that of the lens without its distortion: the focal length says it.
    """

    width: int = 640
    height: int = 480
    hfov_deg: float = 90.0
    distortion: Distortion = Distortion()

    @property
    def focal_px(self) -> float:
        """Focal length of both axes."""
        return self.width / 2.0 / math.tan(math.radians(self.hfov_deg) / 2.0)

    def zoomed(self, zoom: float) -> "Intrinsics":
        """With so many times the focal length, and the same distortion of directions: the coefficients stay."""
        half = math.tan(math.radians(self.hfov_deg) / 2.0) / zoom
        return self._replace(hfov_deg=2.0 * math.degrees(math.atan(half)))


class Mount(NamedTuple):
    """Where the camera sits in the body (forward, right, down, in metres) and how far below the horizon it looks."""

    forward_m: float
    right_m: float
    down_m: float
    depression_deg: float


NADIR = Mount(0.0, 0.0, 0.15, 90.0)
"""Below the UAS, looking straight down."""
MAST = Mount(0.2, 0.0, -1.8, 60.0)
"""On the UGV: 2 m above the ground where the vehicle's origin is 0.2 m above it."""
GIMBAL = Mount(0.0, 0.0, 0.15, 0.0)
"""On the head of a gimbal below the UAS, which says where it looks."""
MOUNTS = {"nadir": NADIR, "mast": MAST, "gimbal": GIMBAL}


def distorted(x: FloatArray, y: FloatArray, lens: Distortion) -> tuple[FloatArray, FloatArray]:
    """Where directions (x, y, 1) of the scene appear, in focal lengths from the principal point."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    return (
        x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
        y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y,
    )


def undistorted(x: FloatArray, y: FloatArray, lens: Distortion) -> tuple[FloatArray, FloatArray]:
    """The directions (x, y, 1) of the scene that appear at these places: the inverse, by Newton's steps."""
    from_x, from_y = x, y
    for _ in range(UNDISTORT_STEPS):
        at_x, at_y = distorted(from_x, from_y, lens)
        miss_x, miss_y = x - at_x, y - at_y
        xx, xy, yy = _derivatives(from_x, from_y, lens)
        determinant = xx * yy - xy * xy
        step_x = (yy * miss_x - xy * miss_y) / determinant
        step_y = (xx * miss_y - xy * miss_x) / determinant
        from_x, from_y = from_x + step_x, from_y + step_y
        if max(float(np.abs(step_x).max()), float(np.abs(step_y).max())) < UNDISTORTED:
            break
    return from_x, from_y


def _derivatives(x: FloatArray, y: FloatArray, lens: Distortion) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of `distorted`: dx'/dx, dx'/dy (which is dy'/dx), dy'/dy."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    slope = 2.0 * (lens.k1 + r2 * (2.0 * lens.k2 + 3.0 * r2 * lens.k3))
    return (
        radial + slope * x * x + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x,
        slope * x * y + 2.0 * lens.p1 * x + 2.0 * lens.p2 * y,
        radial + slope * y * y + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x,
    )


class Source(NamedTuple):
    """The undistorted picture that a distorted one is taken from: its size, and where each pixel comes from in it."""

    width: int
    height: int
    map_x: npt.NDArray[np.float32]
    map_y: npt.NDArray[np.float32]
    """(height, width) of the distorted picture, in pixels of the source; for cv2.remap."""


def source_of(intrinsics: Intrinsics) -> Source:
    """The source of a picture, with the same focal length and as large as the lens needs it, in multiples of 8.

    Raises LensError where the lens folds the picture over, or needs more of the scene than is worth drawing.
    """
    width, height, _, lens = intrinsics
    focal = intrinsics.focal_px
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float64)
    x, y = (columns - (width - 1) / 2.0) / focal, (rows - (height - 1) / 2.0) / focal
    with np.errstate(all="ignore"):
        from_x, from_y = undistorted(x, y, lens)
        at_x, at_y = distorted(from_x, from_y, lens)
        xx, xy, yy = _derivatives(from_x, from_y, lens)
        is_one_to_one = bool(np.all((xx * yy - xy * xy > 0.0) & (xx + yy > 0.0)))
        miss_px = float(np.max(np.hypot(at_x - x, at_y - y))) * focal
        reach_x, reach_y = float(np.max(np.abs(from_x))) * focal, float(np.max(np.abs(from_y))) * focal
    said = ", ".join(f"{name} {value:g}" for name, value in lens._asdict().items() if value)
    if not (is_one_to_one and miss_px < CLOSE_ENOUGH_PX):
        raise LensError(f"{said}: this lens folds the picture over before its corners; take smaller ones")
    source_width, source_height = 8 * math.ceil((reach_x + 1.0) / 4.0), 8 * math.ceil((reach_y + 1.0) / 4.0)
    if source_width > WIDEST_SOURCE * width or source_height > WIDEST_SOURCE * height:
        raise LensError(f"{said}: this lens sees more than {WIDEST_SOURCE:g} times what its focal length says")
    map_x = (from_x * focal + (source_width - 1) / 2.0).astype(np.float32)
    map_y = (from_y * focal + (source_height - 1) / 2.0).astype(np.float32)
    return Source(source_width, source_height, map_x, map_y)


@functools.lru_cache(maxsize=1)
def zoomed_source(intrinsics: Intrinsics, zoom: float, size: tuple[int, int]) -> tuple[float, Source]:
    """The source, of a size (width, height) that is given, of a picture with `zoom` (1 or more) times the focal length.

    Beside it the source's own focal length over that of `intrinsics`: `zoom`, or less where the lens then needs more of
    the scene than the size holds at that (behind a pincushion). A zoomed picture is a part of the one that is not,
    whose lens `source_of` has found to be one that can be.
    """
    width, height, _, lens = intrinsics
    focal = intrinsics.focal_px * zoom
    columns, rows = _grid(width), _grid(height)
    x = np.tile((columns - (width - 1) / 2.0) / focal, (len(rows), 1))
    y = np.tile(((rows - (height - 1) / 2.0) / focal)[:, None], (1, len(columns)))
    from_x, from_y = undistorted(x, y, lens)
    needed = tuple(8 * math.ceil((float(np.abs(each).max()) * focal + 1.0) / 4.0) for each in (from_x, from_y))
    fit = min(1.0, size[0] / needed[0], size[1] / needed[1])
    map_x, map_y = (
        _between(each * (focal * fit) + (side - 1) / 2.0, columns, rows)
        for each, side in zip((from_x, from_y), size, strict=True)
    )
    return zoom * fit, Source(*size, map_x, map_y)


def _grid(side: int) -> FloatArray:
    """The first pixel of a side, the last, and so many between that none is farther than ZOOM_GRID_PX from the next."""
    return np.linspace(0.0, side - 1.0, math.ceil((side - 1) / ZOOM_GRID_PX) + 1)


def _between(figures: FloatArray, columns: FloatArray, rows: FloatArray) -> npt.NDArray[np.float32]:
    """Figures of a grid of pixels, for all pixels, linear between."""
    for places in (rows, columns):
        at = np.arange(places[-1] + 1.0) / (places[1] - places[0])
        first = np.minimum(at.astype(int), len(places) - 2)
        share = (at - first)[:, None]
        figures = (figures[first] * (1.0 - share) + figures[first + 1] * share).T
    return np.ascontiguousarray(figures, np.float32)
