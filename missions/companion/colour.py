"""Areas by the colour of their pixels alone: a baseline that a network has to beat, as a `Detector`.

A table says how likely each class is for each colour; `tools/detector/colour.py` counts it over training pictures. A
pixel is of the class whose share of its colour is largest, and pixels that touch are one find, with their mean share
for its score.
"""

import json
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.yolo import Found

BINS = (18, 8, 8)
"""Of hue, saturation and value."""
RANGES = (180.0, 256.0, 256.0)
CLOSED_PX = 9
LEAST_PIXELS = 60
LEAST = 0.5
"""Score from which an area is a detection."""


class Colours(NamedTuple):
    """What was learnt."""

    shares: npt.NDArray[np.float32]
    """(colours, classes + 1): how likely each class is, all being as frequent; the last: none of them."""

    def found(self, image: Image, least: float) -> Found:
        """As yolo.OnnxDetector has it."""
        shares = self.shares[binned(image)]
        best, boxes, scores, labels = shares.argmax(axis=2), list[list[float]](), list[float](), list[int]()
        for label in range(shares.shape[2] - 1):
            mask = cv2.morphologyEx((best == label).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((CLOSED_PX, CLOSED_PX)))
            count, numbers, figures, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
            means = np.bincount(numbers.reshape(-1), shares[..., label].reshape(-1), count)
            for number in range(1, count):
                left, top, wide, high, pixels = (int(each) for each in figures[number])
                score = round(float(means[number]) / pixels, 3)
                if pixels >= LEAST_PIXELS and score >= least:
                    boxes.append([left, top, left + wide, top + high])
                    scores.append(score)
                    labels.append(label)
        order = np.argsort(-np.array(scores), kind="stable")
        return Found(
            np.array(boxes, np.float32).reshape(-1, 4)[order],
            np.array(scores, np.float32)[order],
            np.array(labels, np.int64)[order],
        )


class ColourDetector:
    """See the module."""

    def __init__(self, path: Path, least: float = LEAST) -> None:
        """`path`: as `write` has written it."""
        table = json.loads(path.read_text())
        self._labels, self._least = tuple(table["labels"]), least
        self._colours = Colours(np.array(table["thousandths"], np.float32) / np.float32(1000.0))

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels of its detections."""
        return self._labels

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """See Detector."""
        boxes, scores, labels = self._colours.found(image, self._least)
        return [
            Detection(
                self._labels[label], score, (left + right) / 2.0, (top + bottom) / 2.0, right - left, bottom - top
            )
            for (left, top, right, bottom), score, label in zip(
                boxes.tolist(), scores.tolist(), labels.tolist(), strict=True
            )
        ]


def write(path: Path, labels: tuple[str, ...], colours: Colours) -> None:
    """For `ColourDetector`. Raises OSError."""
    rows = (1000.0 * colours.shares).round().astype(int).tolist()
    path.write_text(json.dumps({"labels": labels, "thousandths": rows}, separators=(",", ":")) + "\n")


def binned(image: Image) -> npt.NDArray[np.intp]:
    """(height, width): each pixel's colour."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    number = np.zeros(image.shape[:2], np.intp)
    for channel, (bins, whole) in enumerate(zip(BINS, RANGES, strict=True)):
        number = number * bins + (hsv[..., channel] * (bins / whole)).astype(np.intp)
    return number
