"""The ground of a run's world from straight above, kept in its folder for its page."""

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

FILE = "map.jpg"
JPEG_QUALITY = 85
"""Ours."""


def encoded(photo: npt.NDArray[np.uint8]) -> bytes:
    """(height, width, 3) RGB as a JPEG."""
    _, data = cv2.imencode(".jpg", np.ascontiguousarray(photo[:, :, ::-1]), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


def write(photo: npt.NDArray[np.uint8], folder: Path) -> None:
    """Keep it. Raises OSError."""
    (folder / FILE).write_bytes(encoded(photo))
