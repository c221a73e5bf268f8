"""What a frame gives the disaster mission: detections, corners to map the ground by, and how much of it is edges.

Where ground is plain, nothing lies or stands: edges by Canny's detector, in any colour, tell of whatever is there,
known to a detector or not, as in the search for forced landing sites (D. Fitzgerald, R. Walker and D. Campbell, A
vision based forced landing site selection system for an autonomous UAV, 2005). Nothing of ours finds persons or
vehicles by name: that the ground is plain is what keeps a parcel off them.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection, Detections, Detector
from sitl_emu.missions.companion.terrain.features import Feature, FeatureTracker, Gray

Edges = npt.NDArray[np.float32]
FINEST_M = 0.06
"""A pixel on the ground, as our scan's camera has it from 20 m: what is smaller is texture. Gravel seen from 7 m is all
edges, and no less plain than from 20 m."""
LENS_PX = 0.5
"""One sigma by which a picture taken from there is blurred: what was finer than a pixel is more than averaged; ours."""
PART_PX = 8
"""Side of a part: half a metre."""
WEAK, STRONG = 60, 150
"""Canny's thresholds, of 8-bit gradients of each colour; ours: grass and asphalt from 20 m have no edges with them,
persons have. Grey has not: a parcel lay 0.6 m from a person in blue on a street in shade, whom blue alone shows. Of ten
persons of the town of seed 20 four, six and seven are rough (`places.ROUGH`) in grey from 20, 12 and 7 m, and nine, ten
and ten in colours; the share of plain ground falls from 0.86, 0.87 and 0.90 to 0.73, 0.76 and 0.78."""


class Sight(Detections):
    """The detections of a frame, with `edges`, the share of edges in its parts (rows, columns), corners, and itself."""

    def __init__(
        self, detections: list[Detection], edges: Edges, features: Sequence[Feature] = (), gray: Gray | None = None
    ) -> None:
        super().__init__(detections, detections.areas if isinstance(detections, Detections) else None)
        self.edges, self.features, self.gray = edges, features, gray


class Eye:
    """Looks at frames in their order."""

    def __init__(self, detector: Detector) -> None:
        self._detector, self._tracker = detector, FeatureTracker()

    def look(self, image: Image, gsd_m: float) -> Sight:
        """All that a frame gives."""
        gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        found = self._detector.detect(image, gsd_m or None)
        return Sight(found, edges_of(image, gsd_m), self._tracker.follow(gray), gray)


def edges_of(image: Image, gsd_m: float) -> Edges:
    """The share of edges, 0 to 1, in each part of a picture; a pixel is `gsd_m` wide on the ground, 0: nobody knows."""
    if 0.0 < gsd_m < FINEST_M:
        share = gsd_m / FINEST_M
        image = np.asarray(cv2.resize(image, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), np.uint8)
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), LENS_PX), np.uint8)
    lines = np.bitwise_or.reduce([cv2.Canny(colour, WEAK, STRONG) for colour in cv2.split(image)])
    size = max(image.shape[1] // PART_PX, 1), max(image.shape[0] // PART_PX, 1)
    return np.asarray(cv2.resize((lines > 0).astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32)
