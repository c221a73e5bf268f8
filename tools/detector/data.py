"""A split of a data set in memory, at the network's input size."""

import json
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.yolo import Fitted, fitted
from tools.detector.augment import IGNORED, Sample
from tools.detector.scores import Truth

Image = npt.NDArray[np.uint8]
REAL = 1.0


class Split(NamedTuple):
    """Pictures and what is in them."""

    labels: tuple[str, ...]
    names: tuple[str, ...]
    images: list[Image]
    """(height, width, 3), BGR."""
    rows: list[npt.NDArray[np.float32]]
    """(n, 6) each: class, left, top, right, bottom in pixels, and kind."""
    regions: list[Image | None]
    """(height, width) each: the row that a pixel shows, from 1 on; None: boxes are all that is known."""
    about: list[dict[str, Any]]
    """What `dataset` wrote of each: height above ground, sun, haze."""

    def sample(self, number: int) -> Sample:
        """As `augment` and `changes` read it."""
        return Sample(self.images[number], self.rows[number], self.regions[number])

    def truth(self, number: int) -> Truth:
        """As `scores` reads it."""
        return truth_of(self.rows[number])


def truth_of(rows: npt.NDArray[np.float32]) -> Truth:
    """What rows tell, as `scores` reads it; those without extent are not there."""
    there = rows[((rows[:, 3:5] - rows[:, 1:3]) > 0.0).all(axis=1)]
    return Truth(there[:, 1:5], there[:, 0].astype(np.int64), there[:, 5] == IGNORED)


def load(folder: Path, split: str, width: int, height: int, most: int | None = None) -> Split:
    """Read a split (COCO, `SPLIT.json` beside `images/SPLIT/`). Raises OSError, ValueError."""
    table = json.loads((folder / f"{split}.json").read_text())
    categories = sorted(table["categories"], key=lambda each: int(each["id"]))
    number = {each["id"]: k for k, each in enumerate(categories)}
    rows: dict[int, list[list[float]]] = {each["id"]: [] for each in table["images"]}
    for each in table["annotations"]:
        left, top, wide, high = each["bbox"]
        kind = IGNORED if each.get("iscrowd") else REAL
        rows[each["image_id"]].append([number[each["category_id"]], left, top, left + wide, top + high, kind])
    asked = table["images"][:most]
    with ThreadPoolExecutor() as pool:  # OpenCV lets go of Python's lock
        read = list(pool.map(partial(_read, folder, split, width, height), (each["file_name"] for each in asked)))
    moved = []
    for each, (fit, _) in zip(asked, read, strict=True):
        own = np.array(rows[each["id"]], np.float32).reshape(-1, 6)
        own[:, 1:5] = own[:, 1:5] * fit.scale + (fit.left, fit.top) * 2
        moved.append(own)
    return Split(
        tuple(each["name"] for each in categories), tuple(each["file_name"] for each in asked),
        [fit.image for fit, _ in read], moved, [regions for _, regions in read], asked,
    )  # fmt: skip


def _read(folder: Path, split: str, width: int, height: int, name: str) -> tuple[Fitted, Image | None]:
    """A picture, and its regions."""
    path = folder / "images" / split / name
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError(f"{path}: can't be read as a picture")
    fit = fitted(np.asarray(image, np.uint8), width, height)
    return fit, _regions((folder / "regions" / split / name).with_suffix(".png"), fit, width, height)


def _regions(path: Path, fit: Fitted, width: int, height: int) -> Image | None:
    """Moved as its picture was, but that numbers don't mix."""
    if not path.exists():
        return None
    read = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if read is None:
        raise ValueError(f"{path}: can't be read as a picture")
    matrix = np.array(((fit.scale, 0.0, fit.left), (0.0, fit.scale, fit.top)))
    return np.asarray(cv2.warpAffine(read, matrix, (width, height), flags=cv2.INTER_NEAREST), np.uint8)
