"""How good detections are: average precision, precision and recall, confusion; as COCO counts them, in numpy alone.

Detections are matched best first, each to the truth of its class that it overlaps most and that is still free. One that
lies mostly in something ignored is neither right nor wrong. Average precision is the mean, over 101 recalls, of the
best precision at that recall or a higher one. Precision, recall and F1 are those at the score where the mean F1 is
highest.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.yolo import Found, overlaps

Floats = npt.NDArray[np.float64]
IOUS = tuple(0.5 + 0.05 * k for k in range(10))
STEPS = np.arange(1, 1000) / 1000.0
"""Scores at which precision, recall and F1 are taken."""
COVERED = 0.5
"""Share of a detection that lies in something ignored, from which it does not count."""


class Truth(NamedTuple):
    """Of one picture."""

    boxes: npt.NDArray[np.float32]
    """(n, 4): left, top, right, bottom."""
    labels: npt.NDArray[np.int64]
    ignored: npt.NDArray[np.bool_]


class ClassScore(NamedTuple):
    """One row of the paper's Table 2, and what the stricter measure says."""

    precision: float
    recall: float
    f1: float
    ap50: float
    ap50_95: float
    truths: int


class Curves(NamedTuple):
    """Of a class, over STEPS: what detections from each score on come to."""

    precision: Floats
    recall: Floats
    f1: Floats


class Score(NamedTuple):
    """Of a data set."""

    classes: tuple[ClassScore, ...]
    at: float
    """The score from which detections count for precision, recall, F1."""

    @property
    def map50(self) -> float:
        """Mean over the classes that are there."""
        return float(np.mean([one.ap50 for one in self.classes if one.truths] or [0.0]))

    @property
    def map50_95(self) -> float:
        """Mean over the classes that are there."""
        return float(np.mean([one.ap50_95 for one in self.classes if one.truths] or [0.0]))


def score(found: Sequence[Found], truths: Sequence[Truth], classes: int, at: float | None = None) -> Score:
    """Of pictures, detections and truths in the same order; `at`: see Score, None: where the mean F1 is highest."""
    every = [[_ranked(found, truths, label, iou) for iou in IOUS] for label in range(classes)]
    curves = [_curves(*ranked[0]) for ranked in every]
    means = np.mean([curve.f1 for curve, ranked in zip(curves, every, strict=True) if ranked[0][2]] or [STEPS * 0], 0)
    k = int(np.argmax(means)) if at is None else int(np.searchsorted(STEPS, at))
    rows = []
    for ranked, curve in zip(every, curves, strict=True):
        aps = [average_precision(hits, count) for _, hits, count in ranked]
        precision, recall, f1 = (float(each[k]) for each in curve)
        rows.append(ClassScore(precision, recall, f1, aps[0], float(np.mean(aps)), ranked[0][2]))
    return Score(tuple(rows), float(STEPS[k]))


def _ranked(
    found: Sequence[Found], truths: Sequence[Truth], label: int, iou: float
) -> tuple[Floats, npt.NDArray[np.bool_], int]:
    """Scores of all detections of a class that count, best first; whether each is right; how many there are to find."""
    scores: list[float] = []
    hits: list[bool] = []
    count = 0
    for one, truth in zip(found, truths, strict=True):
        own, real = one.labels == label, (truth.labels == label) & ~truth.ignored
        hidden = truth.boxes[(truth.labels == label) & truth.ignored]
        count += int(real.sum())
        for value, hit in zip(one.scores[own], matched(one.boxes[own], truth.boxes[real], hidden, iou), strict=True):
            if hit is not None:
                scores.append(float(value))
                hits.append(hit)
    order = np.argsort(-np.array(scores), kind="stable")
    return np.array(scores)[order], np.array(hits, np.bool_)[order], count


def matched(
    boxes: npt.NDArray[np.float32],
    real: npt.NDArray[np.float32],
    hidden: npt.NDArray[np.float32],
    iou: float,
) -> list[bool | None]:
    """Whether each of a picture's boxes (best first) of one class is right; None: it does not count."""
    free = np.ones(len(real), np.bool_)
    result: list[bool | None] = []
    table = overlaps(boxes, real)
    for box, row in zip(boxes, table, strict=True):
        row = np.where(free, row, -1.0)
        if len(row) and row.max() >= iou:
            free[int(row.argmax())] = False
            result.append(True)
        else:
            result.append(None if _covered(box, hidden) >= COVERED else False)
    return result


def _covered(box: npt.NDArray[np.float32], hidden: npt.NDArray[np.float32]) -> float:
    """The largest share of a box that lies in one of others."""
    if not len(hidden):
        return 0.0
    low, high = np.maximum(box[:2], hidden[:, :2]), np.minimum(box[2:], hidden[:, 2:])
    area = max(float((box[2:] - box[:2]).prod()), 1e-9)
    return float(np.clip(high - low, 0, None).prod(axis=1).max()) / area


def average_precision(hits: npt.NDArray[np.bool_], count: int) -> float:
    """Of detections in their order, best first, with `count` to find; 0 where there is nothing to find."""
    if not count or not len(hits):
        return 0.0
    right = np.cumsum(hits)
    precision = right / np.arange(1, len(hits) + 1)
    best = np.maximum.accumulate(precision[::-1])[::-1]
    place = np.searchsorted(right / count, np.linspace(0, 1, 101) - 1e-9)
    return float(np.append(best, 0.0)[place].mean())


def curves(found: Sequence[Found], truths: Sequence[Truth], classes: int) -> list[Curves]:
    """Of pictures, class by class, at an IoU of 0.5."""
    return [_curves(*_ranked(found, truths, label, IOUS[0])) for label in range(classes)]


def _curves(scores: Floats, hits: npt.NDArray[np.bool_], count: int) -> Curves:
    kept = np.searchsorted(-scores, -STEPS, side="right")
    right = np.append(0, np.cumsum(hits))[kept].astype(np.float64)
    precision, recall = right / np.maximum(kept, 1), right / max(count, 1)
    return Curves(precision, recall, 2 * precision * recall / np.maximum(precision + recall, 1e-9))


def confusion(
    found: Sequence[Found], truths: Sequence[Truth], classes: int, at: float, iou: float = 0.5
) -> npt.NDArray[np.int64]:
    """(classes + 1, classes + 1): rows what there is, columns what was found, the last of each: nothing."""
    table = np.zeros((classes + 1, classes + 1), np.int64)
    for one, truth in zip(found, truths, strict=True):
        real, hidden = truth.boxes[~truth.ignored], truth.boxes[truth.ignored]
        labels = truth.labels[~truth.ignored]
        free = np.ones(len(real), np.bool_)
        chosen = one.scores >= at
        for box, label in zip(one.boxes[chosen], one.labels[chosen], strict=True):
            row = np.where(free, overlaps(box[None], real)[0], -1.0)
            if len(row) and row.max() >= iou:
                k = int(row.argmax())
                free[k] = False
                table[labels[k], label] += 1
            elif _covered(box, hidden) < COVERED:
                table[classes, label] += 1
        for label in labels[free]:
            table[label, classes] += 1
    return table
