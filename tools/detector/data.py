"""A split of a data set in memory, at the network's input size."""

import json
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
    images, moved, names, regions = [], [], [], list[Image | None]()
    for each in table["images"][:most]:
        path = folder / "images" / split / each["file_name"]
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise ValueError(f"{path}: can't be read as a picture")
        fit = fitted(np.asarray(image, np.uint8), width, height)
        own = np.array(rows[each["id"]], np.float32).reshape(-1, 6)
        own[:, 1:5] = own[:, 1:5] * fit.scale + (fit.left, fit.top) * 2
        images.append(fit.image)
        moved.append(own)
        names.append(each["file_name"])
        regions.append(
            _regions((folder / "regions" / split / each["file_name"]).with_suffix(".png"), fit, width, height)
        )
    labels = tuple(each["name"] for each in categories)
    return Split(labels, tuple(names), images, moved, regions, table["images"][:most])


def _regions(path: Path, fit: Fitted, width: int, height: int) -> Image | None:
    """Moved as its picture was, but that numbers don't mix."""
    if not path.exists():
        return None
    read = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if read is None:
        raise ValueError(f"{path}: can't be read as a picture")
    matrix = np.array(((fit.scale, 0.0, fit.left), (0.0, fit.scale, fit.top)))
    return np.asarray(cv2.warpAffine(read, matrix, (width, height), flags=cv2.INTER_NEAREST), np.uint8)
