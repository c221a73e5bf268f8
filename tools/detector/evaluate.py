"""Scores an exported network on what no training saw, as the second paper's Table 2 does, and how it breaks.

Writes `scores.json`, `scores.md`, `curves.png`, `conditions.png` (finds by height, sun and haze), and `misses.png`, the
page of the worst misses and false finds.
Precision, recall and F1 of all sets are those at the score where the validation split's mean F1 is highest.
"""

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.inference import be_repeatable
from sitl_emu.missions.companion.yolo import Found, OnnxDetector, overlaps
from tools.detector import areas, data
from tools.detector.changes import Change, changes
from tools.detector.colour import learn
from tools.detector.conditions import CONDITIONS, binned
from tools.detector.plots import draw, draw_conditions
from tools.detector.scores import Score, Truth, confusion, curves, score

Image = npt.NDArray[np.uint8]
SETS = ("val", "test", "asset", "light")
LEAST = 0.01
"""Score from which detections count for average precision."""
COLUMNS, ROWS = 5, 4
WIDTH, HEIGHT = 640, 480
"""Of pictures as they are read, and changed: as a vehicle's camera takes them. The model fits them to its own input."""


def evaluate(model: Path, folder: Path, out: Path, baseline: bool = False) -> None:
    """Write all tables and the page; `baseline`: with that of colour alone. Raises OSError, ValueError."""
    be_repeatable()
    out.mkdir(parents=True, exist_ok=True)
    detector = OnnxDetector(model)
    splits = {name: data.load(folder, name, WIDTH, HEIGHT) for name in SETS}
    splits = {name: split for name, split in splits.items() if split.images}
    found = {name: [detector.found(image, LEAST) for image in split.images] for name, split in splits.items()}
    truths = {name: [split.truth(k) for k in range(len(split.images))] for name, split in splits.items()}
    classes = len(detector.labels)
    at = score(found["val"], truths["val"], classes).at
    scores = {name: score(found[name], truths[name], classes, at) for name in splits}
    drops = {name: _changed(detector, splits["test"], change, at) for name, change in changes().items()}
    unseen = [name for name in splits if name != "val"]
    every, real = [one for name in unseen for one in found[name]], [one for name in unseen for one in truths[name]]
    about = [one for name in unseen for one in splits[name].about]
    conditions = {each.name: binned(each, every, real, about, classes, at) for each in CONDITIONS}
    table = confusion(found["test"], truths["test"], classes, at)
    result = {"model": model.name, "input": [detector.width, detector.height], "at": at,
              "images": {name: len(split.images) for name, split in splits.items()},
              "sets": {name: _plain(one, detector.labels) for name, one in scores.items()},
              "changed": {name: _plain(one, detector.labels) for name, one in drops.items()},
              "conditions": {name: [one._asdict() for one in bins] for name, bins in conditions.items()},
              "areas": _areas(detector, splits, found, at),
              "colour_alone": _baseline(folder, splits, truths) if baseline else {},
              "confusion": {"labels": [*detector.labels, "nothing"], "rows": table.tolist()},
              "frames_s": round(_speed(detector, splits["test"].images), 1)}  # fmt: skip
    (out / "scores.json").write_text(json.dumps(result, indent=1) + "\n")
    text = markdown(result)
    (out / "scores.md").write_text(text)
    draw(out / "curves.png", detector.told, result, curves(found["test"], truths["test"], classes))
    draw_conditions(out / "conditions.png", conditions, at)
    cv2.imwrite(str(out / "misses.png"), misses(splits["test"], found["test"], truths["test"], at))
    print(text)


def _baseline(folder: Path, splits: Mapping[str, data.Split], truths: Mapping[str, Sequence[Truth]]) -> dict[str, Any]:
    """Test and held-out sets, by colour alone."""
    colours = learn(data.load(folder, "train", WIDTH, HEIGHT))
    labels = splits["val"].labels
    found = {name: [colours.found(image, LEAST) for image in split.images] for name, split in splits.items()}
    at = score(found["val"], truths["val"], len(labels)).at
    return {name: _plain(score(found[name], truths[name], len(labels), at), labels) for name in splits}


def _areas(
    detector: OnnxDetector, splits: Mapping[str, data.Split], found: Mapping[str, Sequence[Found]], at: float
) -> dict[str, Any]:
    """Of all sets whose pictures' pixels are known, by what gives them: the network's areas, and its boxes."""
    given: dict[str, Any] = {}
    for name, split in splits.items():
        ways = {"boxes": [areas.of_boxes(one, at, len(split.labels), (HEIGHT, WIDTH)) for one in found[name]]}
        seen = [detector.detect(image).areas for image in split.images] if detector.has_areas else []
        if seen:
            ways["areas"] = [areas.in_parts(one, (HEIGHT, WIDTH)) for one in seen if one is not None]
        for way, shares in ways.items():
            scores = areas.scored(shares, split)
            rows = {label: {key: round(value, 4) for key, value in one._asdict().items()}
                    for label, one in zip(split.labels, scores, strict=False)}  # fmt: skip
            if rows:
                given.setdefault(name, {})[way] = rows
    return given


def _changed(detector: OnnxDetector, split: data.Split, change: Change, at: float) -> Score:
    """Of a split as another camera sees it."""
    seen = [change(split.sample(k)) for k in range(len(split.images))]
    found = [detector.found(one.image, LEAST) for one in seen]
    return score(found, [data.truth_of(one.rows) for one in seen], len(detector.labels), at)


def _plain(one: Score, labels: tuple[str, ...]) -> dict[str, Any]:
    rows = {label: {name: round(value, 4) for name, value in row._asdict().items()}
            for label, row in zip(labels, one.classes, strict=True)}  # fmt: skip
    there = [row for row in one.classes if row.truths]
    precision = float(np.mean([row.precision for row in there] or [0.0]))
    recall = float(np.mean([row.recall for row in there] or [0.0]))
    return {"map50": round(one.map50, 4), "map50_95": round(one.map50_95, 4), "precision": round(precision, 4),
            "recall": round(recall, 4), "classes": rows}  # fmt: skip


def _speed(detector: OnnxDetector, images: list[Image]) -> float:
    """Frames a second of CPU time of this thread, which is one core's."""
    detector.found(images[0], LEAST)
    began = time.thread_time()
    for image in images[:60]:
        detector.found(image, LEAST)
    return min(len(images), 60) / (time.thread_time() - began)


def markdown(result: Mapping[str, Any]) -> str:
    """The tables, to be read. Precision and recall of all classes are their means."""
    lines = [f"Precision, recall and F1 at a score of {result['at']:.2f}, IoU 0.5; input {result['input']}; "
             f"{result['frames_s']} frames a second of one core.", "",
             "| set | class | precision | recall | F1 | mAP@0.5 | mAP@0.5:0.95 | to find |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    colour = {f"{name}, colour alone": one for name, one in result["colour_alone"].items()}
    for name, one in {**result["sets"], **colour}.items():
        for label, row in one["classes"].items():
            lines.append(f"| {name} | {label} | {row['precision']:.2f} | {row['recall']:.2f} | {row['f1']:.2f} | "
                         f"{row['ap50']:.3f} | {row['ap50_95']:.3f} | {row['truths']} |")  # fmt: skip
        pictures = result["images"][name.partition(",")[0]]
        lines.append(f"| {name} | all of {pictures} pictures | {one['precision']:.2f} | {one['recall']:.2f} | | "
                     f"{one['map50']:.3f} | {one['map50_95']:.3f} | |")  # fmt: skip
    lines += ["", "| test pictures, changed | mAP@0.5 |", "| --- | --- |"]
    lines += [f"| {name} | {one['map50']:.3f} |" for name, one in result["changed"].items()]
    if result["areas"]:
        lines += ["", "| parts of pictures | by | class | IoU | precision | recall | others taken for it |",
                  "| --- " * 7 + "|"]  # fmt: skip
    for name, ways in result["areas"].items():
        for way, rows in ways.items():
            lines += [f"| {name} | {way} | {label} | {one['iou']:.2f} | {one['precision']:.2f} | "
                      f"{one['recall']:.2f} | {one['others']:.3f} |" for label, one in rows.items()]  # fmt: skip
    for name, bins in result["conditions"].items():
        lines += [
            "",
            f"| all but validation, {name} | pictures | to find | found | false a picture |",
            "| --- " * 5 + "|",
        ]
        lines += [f"| {one['low']:g} to {one['high']:g} | {one['pictures']} | {one['truths']} | "
                  f"{one['found'] / max(one['truths'], 1):.0%} | {one['false'] / one['pictures']:.2f} |"
                  for one in bins]  # fmt: skip
    labels = result["confusion"]["labels"]
    lines += ["", "| there is \\ found | " + " | ".join(labels) + " |", "| --- " * (len(labels) + 1) + "|"]
    lines += [f"| {label} | " + " | ".join(str(count) for count in row) + " |"
              for label, row in zip(labels, result["confusion"]["rows"], strict=True)]  # fmt: skip
    return "\n".join(lines) + "\n"


def misses(split: data.Split, found: list[Found], truths: list[Truth], at: float) -> Image:
    """The pictures with most that is wrong: white what there is, grey what is ignored, red what was found."""
    ranked = sorted(range(len(found)), key=lambda k: (-_wrong(found[k], truths[k], at), k))[: COLUMNS * ROWS]
    cells = [_drawn(split.images[k], found[k], truths[k], split, at) for k in ranked]
    cells += [np.zeros_like(cells[0])] * (COLUMNS * ROWS - len(cells))
    return np.vstack([np.hstack(cells[row * COLUMNS : (row + 1) * COLUMNS]) for row in range(ROWS)])


def _wrong(found: Found, truth: Truth, at: float) -> float:
    """Truths without a find, by 1 less the best overlap, and finds that overlap no truth, by their score."""
    real = truth.boxes[~truth.ignored]
    kept = found.scores >= at
    table = overlaps(real, found.boxes[kept]) if kept.any() and len(real) else np.zeros((len(real), int(kept.sum())))
    missed = sum(1.0 - (row.max() if len(row) else 0.0) for row in table)
    every = overlaps(truth.boxes, found.boxes[kept])
    false = sum(float(s) for s, column in zip(found.scores[kept], every.T, strict=True) if column.max(initial=0) < 0.5)
    return float(missed + false)


def _drawn(image: Image, found: Found, truth: Truth, split: data.Split, at: float) -> Image:
    image = image.copy()
    for box, ignored in zip(truth.boxes, truth.ignored, strict=True):
        left, top, right, bottom = (round(float(side)) for side in box)
        colour = (130, 130, 130) if ignored else (255, 255, 255)
        cv2.rectangle(image, (left, top), (right - 1, bottom - 1), colour, 2)
    for box, value, label in zip(found.boxes, found.scores, found.labels, strict=True):
        if value >= at:
            left, top, right, bottom = (round(float(side)) for side in box)
            cv2.rectangle(image, (left, top), (right - 1, bottom - 1), (60, 60, 255), 1)
            text = f"{split.labels[label]} {value:.2f}"
            cv2.putText(image, text, (left + 2, top + 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (60, 60, 255), 1)
    return image
