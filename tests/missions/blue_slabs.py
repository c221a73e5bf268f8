"""A detector for tests: blue slabs are debris fields. What it does not know it does not see, and it is never wrong."""

import cv2
import numpy as np

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection

LEAST_PX = 12


class Blue:
    """See the module."""

    labels = ("debris_field",)

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """See Detector."""
        blue, green, red = (image[..., channel].astype(np.int16) for channel in range(3))
        mask = ((blue > green + 40) & (blue > red + 40)).astype(np.uint8)
        count, _, figures, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        boxes = [figures[number].tolist() for number in range(1, count)]
        return [
            Detection("debris_field", 0.9, left + wide / 2, top + high / 2, float(wide), float(high))
            for left, top, wide, high, pixels in boxes
            if pixels >= LEAST_PX
        ]
