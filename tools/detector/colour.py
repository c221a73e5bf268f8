"""What a baseline by colour alone learns: how often each colour is of each class, over training pictures.

    python -m tools.detector.colour [FOLDER] [FILE]

writes it for the disaster mission, from the pictures of FOLDER.
"""

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.colour import BINS, Colours, binned, write
from tools.detector import data
from tools.detector.augment import IGNORED, Sample
from tools.detector.data import Split

SMOOTHING = 20.0
"""Pixels that each class is taken to have had of each colour: what was never seen is of none."""
MOST = 600
"""Pictures that the mission's table is counted over."""


def learn(split: Split) -> Colours:
    """From all pictures of a split."""
    classes = len(split.labels)
    counts = np.full((int(np.prod(BINS)), classes + 1), SMOOTHING)
    for number in range(len(split.images)):
        one = split.sample(number)
        of, colours = _classes(one, classes).reshape(-1), binned(one.image).reshape(-1)
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


def main(folder: str = "runs/detector/disaster/data", file: str = "missions/disaster/colours.json") -> None:
    """Learn, and write the table."""
    split = data.load(Path(folder), "train", 640, 480, MOST)
    write(Path(file), split.labels, learn(split))


if __name__ == "__main__":
    main(*sys.argv[1:])
