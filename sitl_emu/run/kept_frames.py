"""What a run keeps of its cameras, depth cameras and lidars, for whoever looks on or looks back: a frame a second.

`feeds/VEHICLE-FEED/TIME_US.SUFFIX` in the run's folder. A picture becomes a JPEG of at most 480 pixels across (31 kB of
crop on average), depth a PNG of millimetres (16 bits, 0 where nothing is: ROS REP 118), a scan an .npy of its
points in body axes (float32, metres). A frame is written after it was handed on, so nobody waits for it; and under its
name when it is whole, so that nobody reads half a file.
"""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.run.configs import ProcessConfig
from sitl_emu.run.picture_files import jpeg, png

Array = npt.NDArray[Any]
Encode = Callable[[Array], tuple[str, bytes]]
"""From a frame to a file's suffix and contents."""
FOLDER = "feeds"
RATE_HZ = 1.0
WIDTH_PX = 480
JPEG_QUALITY = 75
"""These three are ours: what a page needs to show, in a tenth of the space of all that is rendered."""
MM_MAX = 65535


class KeptFrames:
    """One feed's frames in the run's folder."""

    def __init__(self, config: ProcessConfig, feed: str, encode: Encode) -> None:
        self._folder, self._encode = folder_of(Path(config.folder), config.name, feed), encode

    def keep(self, time_us: int, frame: Array) -> None:
        """Raises OSError."""
        self._folder.mkdir(parents=True, exist_ok=True)
        suffix, data = self._encode(frame)
        part = self._folder / "part"
        part.write_bytes(data)
        part.rename(self._folder / f"{time_us}{suffix}")


def every(rate_hz: float) -> int:
    """Of how many frames of a feed one is kept, the first to begin with."""
    return max(1, round(rate_hz / RATE_HZ))


def folder_of(run: Path, vehicle: str, feed: str) -> Path:
    """Where a feed's frames are in a run's folder."""
    return run / FOLDER / f"{vehicle}-{feed}"


def image_file(image: Array) -> tuple[str, bytes]:
    """(height, width, 3) BGR as a JPEG, smaller where it is wide."""
    height, width = image.shape[:2]
    if width > WIDTH_PX:
        image = cv2.resize(image, (WIDTH_PX, round(height * WIDTH_PX / width)), interpolation=cv2.INTER_AREA)
    return ".jpg", jpeg(image, JPEG_QUALITY)


def depth_file(depth_m: Array) -> tuple[str, bytes]:
    """(height, width) in metres, inf where nothing is, as a PNG of millimetres."""
    mm = np.where(np.isfinite(depth_m), np.round(depth_m * 1000.0), 0.0)
    return ".png", png(np.clip(mm, 0.0, MM_MAX).astype(np.uint16))


def points_file(points_m: Array) -> tuple[str, bytes]:
    """(n, 3) in metres as an .npy."""
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(points_m, np.float32), allow_pickle=False)
    return ".npy", buffer.getvalue()
