"""Pictures as the contents of files: (height, width) or (height, width, 3) BGR, as OpenCV has them."""

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def jpeg(picture: Array, quality: int) -> bytes:
    """`quality`: 0 to 100, libjpeg's."""
    return _encoded(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])


def png(picture: Array) -> bytes:
    """Of 8 or 16 bits."""
    return _encoded(".png", picture, [])


def _encoded(suffix: str, picture: Array, settings: list[int]) -> bytes:
    done, data = cv2.imencode(suffix, np.ascontiguousarray(picture), settings)
    assert done
    return data.tobytes()
