"""A baseline that a network has to beat: areas by the colour of their pixels alone.

How often each colour is of each class is counted over training pictures; a pixel is of the class whose share of its
colour is largest, and pixels that touch are one find, with their mean share for its score.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.yolo import Found
from tools.detector.augment import IGNORED, Image, Sample
from tools.detector.data import Split

BINS = (18, 8, 8)
"""Of hue, saturation and value."""
RANGES = (180.0, 256.0, 256.0)
SMOOTHING = 20.0
"""Pixels that each class is taken to have had of each colour: what was never seen is of none."""
CLOSED_PX = 9
LEAST_PIXELS = 60


class Colours(NamedTuple):
    """What was learnt."""

    shares: npt.NDArray[np.float32]
    """(colours, classes + 1): how likely each class is, all being as frequent; the last: none of them."""

    def found(self, image: Image, least: float) -> Found:
        """As yolo.OnnxDetector has it."""
        shares = self.shares[_binned(image)]
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


def _binned(image: Image) -> npt.NDArray[np.intp]:
    """(height, width): each pixel's colour."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    number = np.zeros(image.shape[:2], np.intp)
    for channel, (bins, whole) in enumerate(zip(BINS, RANGES, strict=True)):
        number = number * bins + (hsv[..., channel] * (bins / whole)).astype(np.intp)
    return number


def learn(split: Split) -> Colours:
    """From all pictures of a split."""
    classes = len(split.labels)
    counts = np.full((int(np.prod(BINS)), classes + 1), SMOOTHING)
    for number in range(len(split.images)):
        one = split.sample(number)
        of, colours = _classes(one, classes).reshape(-1), _binned(one.image).reshape(-1)
        known = of <= classes
        np.add.at(counts, (colours[known], of[known]), 1.0)
    frequent = counts / counts.sum(axis=0)
    return Colours((frequent / frequent.sum(axis=1, keepdims=True)).astype(np.float32))


def _classes(one: Sample, classes: int) -> npt.NDArray[np.intp]:
    """(height, width): each pixel's class, `classes` for none; one more where it does not count."""
    of = np.full(one.image.shape[:2], classes, np.intp)
    for number, (label, left, top, right, bottom, kind) in enumerate(one.rows.tolist(), start=1):
        there: tuple[slice, slice] | npt.NDArray[np.bool_] = slice(int(top), int(bottom)), slice(int(left), int(right))
        if one.regions is not None:
            there = one.regions == number
        of[there] = classes + 1 if kind == IGNORED else int(label)
    return of
