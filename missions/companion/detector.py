"""Finds weed patches and diseased corn in a picture: the detector's interface, and a classical one behind it.

`Detector` is what a mission knows; a trained network drops in behind it.

`ClassicalDetector` uses OpenCV and a very small classifier. A picture is reduced to a fixed ground sampling distance,
so that a patch looks alike from 20 m and from a mast. Per pixel it takes greenness (excess green, Woebbecke et al.
1995), warmth (red over blue), brightness and fine texture, and what morphology leaves of the green once rows are opened
away. Their means over windows of 0.2 to 2 m of ground, less those of the surroundings (5 m), so that light matters
little, are the features of one cell of ground, 0.2 m wide. A two-layer perceptron makes of them the probabilities of
weed, disease and neither; its weights, trained on fields of other seeds than those it is judged on, lie in
`detector_weights.json` (`tools/train_detector.py` makes them). Cells join to blobs; a blob of a target's size is a
detection, its score the mean probability of its heart. So colour alone decides nothing: window means see where green
stands between rows, how mottled it is and how far it reaches.

It does not know species, nor stages of corn far from V5 to V8, nor a closed canopy.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Maps = npt.NDArray[np.float32]

LABELS = ("weed", "disease")
WEIGHTS = Path(__file__).with_name("detector_weights.json")

WORK_GSD_M = 0.07
MAX_SCALE = 1.6
CELL_PX = 3
"""Pixels at `WORK_GSD_M` along a cell's side."""
WINDOWS = (3, 5, 9, 23)
"""Sides of the windows that features are means over, in cells; the last is the surroundings."""
_DISCS = tuple(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)) for side in (5, 7))
DEFAULT_GSD_M = 15.0 / 320.0
"""From 15 m, with 640 pixels over 90 degrees: taken when no distance is given."""
MIN_DIAMETER_M, MAX_DIAMETER_M = 0.42, 3.2
PEAK, EDGE = 0.5, 0.3
"""Smoothed probability a blob must reach somewhere, and that which bounds it."""


class Detection(NamedTuple):
    """One find. Centre and size of its box in pixels of the picture; score 0..1 is a probability, as honest as the
    training."""

    label: str
    score: float
    x: float
    y: float
    w: float
    h: float


class Detector(Protocol):
    """Whatever finds things in pictures. `labels` are those it may give."""

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels of its detections."""

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """Finds in a BGR picture (height, width, 3). `gsd_m`: metres a pixel on the optical axis, if known."""


class Weights(NamedTuple):
    """The classifier: features are (x - mean) / scale, then one hidden layer of rectified units, then softmax."""

    mean: Maps
    scale: Maps
    hidden: Maps
    hidden_bias: Maps
    out: Maps
    out_bias: Maps


@cache
def load_weights(path: Path = WEIGHTS) -> Weights:
    """Weights from their JSON file; ValueError if they don't fit these features."""
    stored = json.loads(path.read_text())
    weights = Weights(*(np.asarray(stored[name], np.float32) for name in Weights._fields))
    if weights.hidden.shape[0] != len(weights.mean):
        raise ValueError(f"{path}: {weights.hidden.shape[0]} rows of weights for {len(weights.mean)} features")
    return weights


def reduce(image: Image, gsd_m: float) -> Image:
    """The picture at `WORK_GSD_M`; one from much too high is not blown up without end."""
    scale = min(gsd_m / WORK_GSD_M, MAX_SCALE)
    size = (max(24, round(image.shape[1] * scale)), max(24, round(image.shape[0] * scale)))
    how = cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size, interpolation=how), np.uint8)


def features(work: Image) -> Maps:
    """Features of every cell of a reduced picture: (rows, columns, features)."""
    bgr = work.astype(np.float32)
    blue, green, red = cv2.split(bgr)
    total = blue + green + red + np.float32(12.0)
    greenness = (green * np.float32(3.0) - total) / total
    warmth = (red - blue) / total
    bright = total * np.float32(1.0 / max(cv2.mean(total)[0], 1.0))
    # 0 is soil, 1 is leaf: soft, so that a mixed pixel counts by its share.
    leaf = np.clip((greenness - np.float32(0.06)) * np.float32(5.0), 0.0, 1.0)
    dry = np.clip((warmth - np.float32(0.14)) * np.float32(6.0), 0.0, 1.0)
    sharp = np.abs(cv2.Laplacian(bright, cv2.CV_32F))
    # What of the green is wider than a row's leaves: a patch between the rows stays, rows go.
    byte = (leaf * np.float32(255.0)).astype(np.uint8)
    opened = [cv2.morphologyEx(byte, cv2.MORPH_OPEN, disc).astype(np.float32) / np.float32(255.0) for disc in _DISCS]
    maps = (leaf, greenness, warmth, bright, sharp, leaf * leaf, dry, dry * leaf, bright * bright, *opened)
    size = (work.shape[1] // CELL_PX, work.shape[0] // CELL_PX)
    cells = cv2.merge([cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in maps])
    # How unlike its neighbours a cell's cover is: rows alternate, a patch does not.
    cells = np.concatenate((cells, cells[..., :1] ** 2, cells[..., 2:3] ** 2), axis=2)
    near = [cells] + [cv2.blur(cells, (side, side), borderType=cv2.BORDER_REFLECT_101) for side in WINDOWS]
    far = near.pop()
    return np.concatenate([one - far for one in near] + [far], axis=2)


def probabilities(cells: Maps, weights: Weights) -> Maps:
    """(rows, columns, 3): probability of neither, weed, disease."""
    rows, columns, count = cells.shape
    x = (cells.reshape(-1, count) - weights.mean) / weights.scale
    hidden = np.maximum(x @ weights.hidden + weights.hidden_bias, 0.0)
    logits = hidden @ weights.out + weights.out_bias
    logits -= logits.max(axis=1, keepdims=True)
    odds = np.exp(logits)
    return np.asarray((odds / odds.sum(axis=1, keepdims=True)).reshape(rows, columns, -1), np.float32)


class ClassicalDetector:
    """Colour, texture, shape and size by OpenCV, weighed by a small classifier."""

    labels = LABELS

    def __init__(self, weights: Weights | None = None) -> None:
        self._weights = weights if weights is not None else load_weights()

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """Finds in a BGR picture, best score first; `gsd_m` as in `Detector`, else 15 m of height are taken."""
        work = reduce(image, gsd_m if gsd_m else DEFAULT_GSD_M)
        likely = probabilities(features(work), self._weights)
        # A cell, in pixels of the picture.
        cell_x, cell_y = image.shape[1] / likely.shape[1], image.shape[0] / likely.shape[0]
        found: list[Detection] = []
        for index, label in enumerate(LABELS, start=1):
            smooth = np.asarray(cv2.GaussianBlur(np.ascontiguousarray(likely[..., index]), (3, 3), 0.8), np.float32)
            found += _blobs(smooth, label, cell_x, cell_y)
        return _strongest(found)


def _blobs(smooth: Maps, label: str, cell_x: float, cell_y: float) -> list[Detection]:
    """Connected cells of one label, if they have a target's size."""
    count, marks, stats, _ = cv2.connectedComponentsWithStats((smooth > EDGE).astype(np.uint8), connectivity=8)
    cell_m = CELL_PX * WORK_GSD_M
    found: list[Detection] = []
    for i in range(1, count):
        left, top, wide, tall, area = stats[i].tolist()
        part = smooth[top : top + tall, left : left + wide]
        weight = np.where(marks[top : top + tall, left : left + wide] == i, part, 0.0)
        if float(weight.max()) < PEAK:
            continue
        if not MIN_DIAMETER_M <= 1.13 * area**0.5 * cell_m <= MAX_DIAMETER_M:
            continue
        heart = weight[weight > 0.8 * weight.max()]
        total = float(weight.sum())
        x = left + float((weight.sum(axis=0) @ np.arange(wide)) / total) + 0.5
        y = top + float((weight.sum(axis=1) @ np.arange(tall)) / total) + 0.5
        score = min(0.99, float(heart.mean()))
        found.append(Detection(label, score, x * cell_x - 0.5, y * cell_y - 0.5, wide * cell_x, tall * cell_y))
    return found


def _strongest(found: list[Detection]) -> list[Detection]:
    """Of detections that share their place, the best: a patch has one label."""
    kept: list[Detection] = []
    for one in sorted(found, key=lambda d: -d.score):
        if all(abs(one.x - k.x) > (one.w + k.w) / 2.5 or abs(one.y - k.y) > (one.h + k.h) / 2.5 for k in kept):
            kept.append(one)
    return kept
