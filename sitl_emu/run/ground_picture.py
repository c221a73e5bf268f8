"""The ground of a run's world from straight above, kept in its folder for its page."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from sitl_emu.run.picture_files import jpeg

FILE = "map.jpg"
JPEG_QUALITY = 85
"""Ours."""


def encoded(photo: npt.NDArray[np.uint8]) -> bytes:
    """(height, width, 3) RGB as a JPEG."""
    return jpeg(photo[:, :, ::-1], JPEG_QUALITY)


def write(photo: npt.NDArray[np.uint8], folder: Path) -> None:
    """Keep it. Raises OSError."""
    (folder / FILE).write_bytes(encoded(photo))
