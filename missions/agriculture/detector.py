"""Finds weed patches and diseased corn in a picture, by classical means; a trained network drops in for it.

`ClassicalDetector` uses OpenCV and a very small classifier. A picture is reduced to a fixed ground sampling distance,
so that a patch looks alike from 20 m and from a mast. Per pixel it takes greenness (excess green, Woebbecke et al.
1995), warmth (red over blue), brightness and fine texture, the same of the leaves alone, what morphology leaves of the
green and of the dry once rows are opened away, and both weighed by where the rows stand (`rows_wave`): weeds and
residue lie between rows too, sick corn stands in them. The means of these over windows of 0.2 to 2 m of ground, less
those of the surroundings (5 m), so that light matters little, are the features of one cell of ground, 0.2 m wide. A
two-layer perceptron makes of them the probabilities of weed, disease and neither; its weights, trained on fields of
other seeds than those it is judged on, lie in `detector_weights.json`, made by `tools/agriculture/train_detector.py`.
Cells join to blobs; a blob of a target's size is a detection, its score the mean probability of its heart.
`tools/agriculture/score_detector.py` measures it, and holds the figures.

It does not know species, nor stages of corn far from V5 to V8, nor a closed canopy; it is weakest on weed patches less
than 1 m across at V8, where the rows all but close.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.detector import Detection

Maps = npt.NDArray[np.float32]

LABELS = ("weed", "disease")
WEIGHTS = Path(__file__).with_name("detector_weights.json")

WORK_GSD_M = 0.07
MAX_SCALE = 1.6
CELL_PX = 3
"""Pixels at `WORK_GSD_M` along a cell's side."""
WINDOWS = (3, 5, 9, 23)
"""Sides of the windows that features are means over, in cells; the last is the surroundings."""
ROW_PITCH_M = 0.75
ROW_PITCH_SLACK = (0.72, 1.4)
"""How much shorter or longer the rows' pitch may look, where the ground is not at the height that was taken."""
ROW_WINDOW_M = 4.2
"""Side of the window that the rows' place is judged in: wider than a patch, so that the rows around it tell."""
_DISCS = tuple(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)) for side in (5, 7))
DEFAULT_GSD_M = 15.0 / 320.0
"""From 15 m, with 640 pixels over 90 degrees: taken when no distance is given."""
MIN_DIAMETER_M, MAX_DIAMETER_M = 0.42, 3.2
PEAK, EDGE = 0.5, 0.3
"""Smoothed probability a blob must reach somewhere, and that which bounds it."""
FEATURES = 90
"""Of a cell: 18 maps, each over itself and the windows."""


class Weights(NamedTuple):
    """The classifier: one hidden layer of rectified units on the features as they come, then softmax."""

    hidden: Maps
    hidden_bias: Maps
    out: Maps
    out_bias: Maps


@cache
def load_weights(path: Path = WEIGHTS) -> Weights:
    """Weights from their JSON file; ValueError if they don't fit these features."""
    stored = json.loads(path.read_text())
    weights = Weights(*(np.asarray(stored[name], np.float32) for name in Weights._fields))
    if weights.hidden.shape[0] != FEATURES:
        raise ValueError(f"{path}: {weights.hidden.shape[0]} rows of weights for {FEATURES} features")
    return weights


def reduce(image: Image, gsd_m: float) -> Image:
    """The picture at `WORK_GSD_M`; one from much too high is not blown up without end."""
    scale = min(gsd_m / WORK_GSD_M, MAX_SCALE)
    size = (max(24, round(image.shape[1] * scale)), max(24, round(image.shape[0] * scale)))
    how = cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size, interpolation=how), np.uint8)


def rows_wave(leaf: Maps) -> Maps:
    """Where the rows stand in a reduced picture: about 1 on a row, -1 midway between two, 0 where there are none.

    The strongest wave of about a row's pitch in the whole picture tells direction and pitch; how the leaves around a
    place fit that wave (demodulation) tells its phase there, so that tilt and hills bend it.
    """
    step = 2
    tall, wide = leaf.shape[0] // step, leaf.shape[1] // step
    half = cv2.resize(leaf, (wide, tall), interpolation=cv2.INTER_AREA)
    half -= cv2.blur(half, (9, 9), borderType=cv2.BORDER_REFLECT_101)
    spectrum = np.abs(np.fft.rfft2(half * _hann(tall, wide)))
    allowed, fy, fx = _row_frequencies(tall, wide, step)
    best = int(allowed[np.argmax(spectrum.ravel()[allowed])])
    angle_y = np.arange(tall, dtype=np.float32) * np.float32(2.0 * np.pi * fy[best // len(fx)])
    angle_x = np.arange(wide, dtype=np.float32) * np.float32(2.0 * np.pi * fx[best % len(fx)])
    carrier = np.exp(1j * angle_y).astype(np.complex64)[:, None] * np.exp(1j * angle_x).astype(np.complex64)[None, :]
    low = (half * carrier.conj()).view(np.float32).reshape(tall, wide, 2)
    side = int(ROW_WINDOW_M / (WORK_GSD_M * step)) | 1
    low = cv2.blur(low, (side, side), borderType=cv2.BORDER_REFLECT_101)
    amplitude = cv2.magnitude(np.ascontiguousarray(low[..., 0]), np.ascontiguousarray(low[..., 1]))
    wave = (low[..., 0] * carrier.real - low[..., 1] * carrier.imag) / (amplitude + np.float32(0.02))
    return np.asarray(cv2.resize(wave, leaf.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


@cache
def _hann(tall: int, wide: int) -> Maps:
    return np.outer(np.hanning(tall), np.hanning(wide)).astype(np.float32)


@cache
def _row_frequencies(tall: int, wide: int, step: int) -> tuple[npt.NDArray[np.intp], Maps, Maps]:
    """Flat indices into a half spectrum of the waves that rows may make, and its frequencies in cycles a pixel."""
    fy, fx = np.fft.fftfreq(tall).astype(np.float32), np.fft.rfftfreq(wide).astype(np.float32)
    pitch_m = WORK_GSD_M * step / np.maximum(np.hypot(fy[:, None], fx[None, :]), 1e-6)
    fits = (pitch_m > ROW_PITCH_M * ROW_PITCH_SLACK[0]) & (pitch_m < ROW_PITCH_M * ROW_PITCH_SLACK[1])
    return np.flatnonzero(fits.ravel()), fy, fx


def features(averaged: list[Maps]) -> Maps:
    """Features of every cell, (rows, columns, features), from what `windows` gives: for training."""
    *near, far = averaged
    return np.concatenate([one - far for one in near] + [far], axis=2)


def windows(work: Image) -> list[Maps]:
    """The cells' maps of a reduced picture, (rows, columns, maps), as they are and averaged over each of `WINDOWS`."""
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
    # The same of the dry: residue lies broad, sick leaves stand in a row.
    byte = (dry * np.float32(255.0)).astype(np.uint8)
    opened.append(cv2.morphologyEx(byte, cv2.MORPH_OPEN, _DISCS[0]).astype(np.float32) / np.float32(255.0))
    wave = rows_wave(leaf)
    by_row = (leaf * wave, dry * wave, np.abs(wave))
    # The leaves' own colour and texture, however much soil lies between them.
    of_leaf = (leaf * warmth, leaf * bright, leaf * sharp, leaf * dry)
    maps = (leaf, greenness, warmth, bright, sharp, dry, *of_leaf, *opened, *by_row)
    columns, rows = work.shape[1] // CELL_PX, work.shape[0] // CELL_PX
    whole = [one[: rows * CELL_PX, : columns * CELL_PX] for one in maps]
    cells = cv2.merge([cv2.resize(one, (columns, rows), interpolation=cv2.INTER_AREA) for one in whole])
    # How unlike its neighbours a cell's cover is: rows alternate, a patch does not.
    cells = np.concatenate((cells, cells[..., :1] ** 2, cells[..., 2:3] ** 2), axis=2)
    return [cells] + [cv2.blur(cells, (side, side), borderType=cv2.BORDER_REFLECT_101) for side in WINDOWS]


def probabilities(averaged: list[Maps], weights: Weights) -> Maps:
    """(3, rows, columns): probability of neither, weed, disease, from what `windows` gives.

    The same as from `features`, but those are not made, which would cost as much as all the rest: the first layer is
    linear, so what would be subtracted of the surroundings everywhere is subtracted once, of their weights.
    """
    rows, columns, count = averaged[0].shape
    *near, far = weights.hidden.reshape(len(averaged), count, -1)
    first = np.concatenate((*near, far - np.sum(near, axis=0)))
    hidden = np.concatenate(averaged, axis=2).reshape(-1, FEATURES) @ first
    hidden += weights.hidden_bias
    np.maximum(hidden, 0.0, out=hidden)
    logits = weights.out.T @ hidden.T
    logits += weights.out_bias[:, None]
    logits -= logits.max(axis=0)
    odds = np.exp(logits, out=logits)
    odds /= odds.sum(axis=0)
    return np.asarray(odds.reshape(-1, rows, columns), np.float32)


class ClassicalDetector:
    """Colour, texture, shape and size by OpenCV, weighed by a small classifier."""

    labels = LABELS

    def __init__(self, weights: Weights | None = None) -> None:
        self._weights = weights if weights is not None else load_weights()

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        """Finds in a BGR picture, best score first; `gsd_m` as in `Detector`, else 15 m of height are taken."""
        work = reduce(image, gsd_m if gsd_m else DEFAULT_GSD_M)
        likely = probabilities(windows(work), self._weights)
        # A cell, in pixels of the picture.
        cell_x, cell_y = CELL_PX * image.shape[1] / work.shape[1], CELL_PX * image.shape[0] / work.shape[0]
        found: list[Detection] = []
        for index, label in enumerate(LABELS, start=1):
            smooth = np.asarray(cv2.GaussianBlur(likely[index], (3, 3), 0.8), np.float32)
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
