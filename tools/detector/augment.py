"""Pictures with their boxes, changed at random: the second paper's augmentations, and those of real cameras besides.

The paper's: flips, 15 degrees of rotation, 20 per cent of brightness and contrast, scales of 0.8 to 1.2, four pictures
in one. Besides: white balance, gamma, blur, noise, JPEG. Boxes are rows (n, 6): class, left, top, right, bottom, kind.
Of areas (water, a front of flames) a box says little about the box of a part, or of the whole when it is turned: where
it is known which pixels show them, boxes are drawn anew, and what each pixel shows comes with the picture.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import find_objects

Image = npt.NDArray[np.uint8]
Rows = npt.NDArray[np.float32]
Rng = np.random.Generator
PAD = (114, 114, 114)
LEAST_SHARE = 0.15
"""Of a box, or of a region's pixels, that must be left where a picture is cut; less of it is ignored."""
LEAST_PX = 6.0
"""Shorter sides are ignored."""
IGNORED = 2.0
UNKNOWN = 255
"""Of pixels: what may be a class, or not."""


class Sample(NamedTuple):
    """A picture and what is in it."""

    image: Image
    rows: Rows
    regions: Image | None = None
    """(height, width): by row, from 1 on, the pixels that show it; None: boxes are all that is known."""


class Strength(NamedTuple):
    """How much is changed. All 0 and 1: nothing."""

    flip: float = 0.5
    rotation_deg: float = 15.0
    light: float = 0.2
    scale: tuple[float, float] = (0.8, 1.2)
    shift: float = 0.1
    mosaic: float = 0.8
    white_balance: float = 0.15
    gamma: tuple[float, float] = (0.7, 1.4)
    camera: float = 0.3
    """How often each of blur, noise and JPEG comes."""


class Changed(NamedTuple):
    """What became of a picture."""

    image: Image
    rows: Rows
    shown: Image | None
    """(height, width): 1 + the class that a pixel shows, 0 for none, or UNKNOWN; None: boxes are all that is known."""


def sample(pick: Callable[[int], Sample], number: int, count: int, how: Strength, rng: Rng) -> Changed:
    """Picture `number` of `count`, with others where it becomes one of four about a point near the middle."""
    one = pick(number)
    height, width = one.image.shape[:2]
    parts, windows = [one], [(0, 0, width, height)]
    if rng.random() < how.mosaic:
        x, y = (int(side * rng.uniform(0.3, 0.7)) for side in (width, height))
        windows = [(0, 0, x, y), (x, 0, width, y), (0, y, x, height), (x, y, width, height)]
        parts += [pick(int(k)) for k in rng.integers(count, size=3)]
    whole = np.empty_like(one.image)
    all_shown = np.full((height, width), UNKNOWN, np.uint8)
    all_rows = []
    for part, (left, top, right, bottom) in zip(parts, windows, strict=True):
        image, rows, shown = _turned(part, right - left, bottom - top, how, rng)
        whole[top:bottom, left:right] = image
        if shown is not None:
            all_shown[top:bottom, left:right] = shown
        rows[:, 1:5] += (left, top) * 2
        all_rows.append(rows)
    rows = np.concatenate(all_rows)
    is_there = ((rows[:, 3:5] - rows[:, 1:3]) > 1.0).all(axis=1)
    is_known = any(part.regions is not None for part in parts)
    return Changed(_seen(whole, how, rng), rows[is_there], all_shown if is_known else None)


def shown_by(regions: Image, rows: Rows) -> Image:
    """What each pixel shows, as `Changed` has it, by which row it shows."""
    table = np.zeros(256, np.uint8)
    table[1 : len(rows) + 1] = np.where(rows[:255, 5] == IGNORED, UNKNOWN, 1 + rows[:255, 0])
    return table[regions]


def _turned(one: Sample, wide: int, high: int, how: Strength, rng: Rng) -> Changed:
    """A part, so wide and high, of a picture that is flipped, rotated, scaled and moved."""
    height, width = one.image.shape[:2]
    angle = math.radians(float(rng.uniform(-how.rotation_deg, how.rotation_deg)))
    scale = math.exp(float(rng.uniform(*np.log(how.scale))))
    mirror_x, mirror_y = (-1.0 if rng.random() < how.flip else 1.0 for _ in range(2))
    turn = scale * np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))
    turn = turn @ np.diag((mirror_x, mirror_y))
    middle = np.array((width, height)) / 2
    corner = int(rng.integers(width - wide + 1)), int(rng.integers(height - high + 1))
    shift = middle - turn @ middle + rng.uniform(-how.shift, how.shift, 2) * (width, height) - corner
    matrix = np.concatenate((turn, shift[:, None]), axis=1)
    image = np.asarray(
        cv2.warpAffine(one.image, matrix, (wide, high), flags=cv2.INTER_LINEAR, borderValue=PAD), np.uint8
    )
    rows = _moved(one.rows, turn, shift, wide, high)
    if one.regions is None:
        return Changed(image, rows, None)
    regions = np.asarray(cv2.warpAffine(one.regions, matrix, (wide, high), flags=cv2.INTER_NEAREST), np.uint8)
    before = scale * scale * pixels_of(one.regions, len(rows))
    return Changed(image, about_regions(rows, one.rows[:, 5], regions, before), shown_by(regions, one.rows))


def pixels_of(regions: Image, count: int) -> npt.NDArray[np.float64]:
    """How many show each row."""
    counts = np.zeros(count)
    counts[:255] = cv2.calcHist([regions], [0], None, [256], [0, 256]).reshape(-1)[1 : count + 1]
    return counts


def about_regions(rows: Rows, kinds: npt.NDArray[np.float32], regions: Image, before: npt.NDArray[np.float64]) -> Rows:
    """Boxes of what pixels show; `kinds` and `before`: what rows were, and how many pixels showed them, uncut."""
    rows, now = rows.copy(), pixels_of(regions, len(rows))
    known = np.flatnonzero(before > 0.0)
    rows[known, 1:5] = 0.0
    for row, found in enumerate(find_objects(regions, len(rows))):
        if found is not None:
            down, across = found
            rows[row, 1:5] = across.start, down.start, across.stop, down.stop
    is_little = (now < LEAST_SHARE * before) | ((rows[:, 3:5] - rows[:, 1:3]).min(axis=1) < LEAST_PX)
    rows[known, 5] = np.where(is_little, np.float32(IGNORED), kinds)[known]
    return rows


def _moved(rows: Rows, turn: npt.NDArray[np.float64], shift: npt.NDArray[np.float64], width: int, height: int) -> Rows:
    """Boxes of the ellipses in boxes: nearer to what lies in them than boxes of the turned corners."""
    middle = 0.5 * (rows[:, 1:3] + rows[:, 3:5]) @ turn.T + shift
    half = 0.5 * (rows[:, 3:5] - rows[:, 1:3])
    reach = np.sqrt((half**2) @ (turn.T**2))
    return cut(np.concatenate((rows[:, :1], middle - reach, middle + reach, rows[:, 5:]), axis=1), 0, 0, width, height)


def cut(rows: npt.NDArray[np.floating], left: float, top: float, right: float, bottom: float) -> Rows:
    """What of boxes lies in a window; those of which little is left, or nothing, are ignored from now on."""
    area = (rows[:, 3:5] - rows[:, 1:3]).prod(axis=1)
    inner = rows.astype(np.float32)
    inner[:, 1:5] = np.clip(rows[:, 1:5], (left, top, left, top), (right, bottom, right, bottom))
    sides = inner[:, 3:5] - inner[:, 1:3]
    inner[(sides.prod(axis=1) < LEAST_SHARE * area) | (sides.min(axis=1) < LEAST_PX), 5] = IGNORED
    return inner


def _seen(image: Image, how: Strength, rng: Rng) -> Image:
    """As another camera would see it."""
    bright, contrast = rng.uniform(-how.light, how.light, 2)
    balance = rng.uniform(1 - how.white_balance, 1 + how.white_balance, 3)
    gamma = math.exp(float(rng.uniform(*np.log(how.gamma))))
    level = np.arange(256) / 255.0
    curve = ((level**gamma - 0.5) * (1 + contrast) + 0.5) * (1 + bright)
    table = np.clip(curve[:, None] * balance * 255.0, 0, 255).round().astype(np.uint8)
    image = np.asarray(cv2.LUT(image, table[None]), np.uint8)
    if rng.random() < how.camera:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), float(rng.uniform(0.4, 1.4))), np.uint8)
    if rng.random() < how.camera:
        image = noisy(image, float(rng.uniform(1, 9)), rng)
    if rng.random() < how.camera:
        image = squeezed(image, int(rng.integers(30, 95)))
    return image


def noisy(image: Image, sigma: float, rng: Rng) -> Image:
    """With noise of a standard deviation."""
    noise = np.empty(image.shape, np.int16)
    cv2.setRNGSeed(int(rng.integers(1 << 31)))
    cv2.randn(noise, 0.0, sigma)  # a quarter of NumPy's time
    return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), np.uint8)


def squeezed(image: Image, quality: int) -> Image:
    """Through JPEG."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
