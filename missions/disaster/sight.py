"""What a frame gives the disaster mission: detections, and how much of each part of the picture is edges.

Where ground is plain, nothing lies or stands: edges by Canny's detector tell of whatever is there, known to a detector
or not, as in the search for forced landing sites (D. Fitzgerald, R. Walker and D. Campbell, A vision based forced
landing site selection system for an autonomous UAV, 2005). Nothing of ours finds persons or vehicles by name: that the
ground is plain is what keeps a parcel off them.
"""

from collections.abc import Iterable

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection

Edges = npt.NDArray[np.float32]
PART_PX = 8
"""Side of a part: half a metre from 20 m."""
WEAK, STRONG = 60, 150
"""Canny's thresholds, of 8-bit gradients; ours: grass and asphalt from 20 m have no edges with them, persons have."""


class Sight(list[Detection]):
    """The detections of a frame, with `edges`, the share of edges in its parts (rows, columns)."""

    def __init__(self, detections: Iterable[Detection], edges: Edges) -> None:
        super().__init__(detections)
        self.edges = edges


def edges_of(image: Image) -> Edges:
    """The share of edges, 0 to 1, in each part of a picture."""
    lines = cv2.Canny(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), WEAK, STRONG)
    size = image.shape[1] // PART_PX, image.shape[0] // PART_PX
    return np.asarray(cv2.resize((lines > 0).astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32)
