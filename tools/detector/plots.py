"""How a training went and what came of it, as one picture."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # after the choice of what draws

from tools.detector.conditions import Bin
from tools.detector.scores import STEPS, Curves


def draw(path: Path, told: Mapping[str, str], result: Mapping[str, Any], curves: Sequence[Curves]) -> None:
    """Write it: a training's history, precision against recall, F1 against score, and confusion.

    `told`: the model's metadata; `result`: what `evaluate` found; `curves`: of the test split, class by class.
    """
    labels = list(result["confusion"]["labels"][:-1])
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    _history(axes[0, 0], json.loads(told.get("history", "[]")))
    for label, curve in zip(labels, curves, strict=True):
        axes[0, 1].plot(curve.recall, curve.precision, label=label)
        axes[1, 0].plot(STEPS, curve.f1, label=label)
    axes[0, 1].set(xlabel="recall", ylabel="precision", xlim=(0, 1), ylim=(0, 1.02), title="test, IoU 0.5")
    axes[1, 0].set(xlabel="score", ylabel="F1", xlim=(0, 1), ylim=(0, 1.02), title="test, IoU 0.5")
    axes[1, 0].axvline(result["at"], color="grey", linestyle=":")
    axes[0, 1].legend()
    _confusion(axes[1, 1], np.array(result["confusion"]["rows"]), result["confusion"]["labels"])
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_conditions(path: Path, conditions: Mapping[str, Sequence[Bin]], at: float) -> None:
    """Write it: for each condition what share was found, and how much was found that is not there."""
    figure, axes = plt.subplots(1, len(conditions), figsize=(5.5 * len(conditions), 4), layout="constrained")
    for axis, (name, bins) in zip(np.atleast_1d(axes), conditions.items(), strict=True):
        places = range(len(bins))
        axis.bar(places, [one.found / max(one.truths, 1) for one in bins], color="tab:blue", alpha=0.7)
        for place, one in zip(places, bins, strict=True):
            axis.text(place, 0.02, f"{one.truths} in\n{one.pictures}", ha="center", fontsize=8)
        axis.set(xlabel=name, ylabel=f"share found, score {at:.2f}, IoU 0.5", ylim=(0, 1))
        axis.set_xticks(places, [f"{one.low:g}-{one.high:g}" for one in bins])
        false = axis.twinx()
        false.plot(places, [one.false / one.pictures for one in bins], color="tab:red", marker="o")
        false.set_ylabel("false finds a picture", color="tab:red")
        false.set_ylim(bottom=0)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _history(axis: Any, rows: Sequence[Mapping[str, Any]]) -> None:
    epochs = [row["epoch"] for row in rows]
    known = [row for row in rows if "map50" in row]
    for key, label in (("map50", "mAP@0.5"), ("map50_95", "mAP@0.5:0.95")):
        axis.plot([row["epoch"] for row in known], [row[key] for row in known], marker=".", label=label)
    axis.set(xlabel="epoch", ylabel="validation", ylim=(0, 1), title="training")
    losses = axis.twinx()
    losses.plot(epochs, [sum(row["loss"]) for row in rows], color="grey", linestyle="--", label="loss")
    losses.set_ylabel("loss")
    if rows:
        losses.set_ylim(0, 1.1 * max(sum(row["loss"]) for row in rows[1:] or rows))
    axis.legend(loc="lower left")
    losses.legend(loc="lower right")


def _confusion(axis: Any, rows: npt.NDArray[np.int64], labels: Sequence[str]) -> None:
    share = rows / np.maximum(rows.sum(axis=1, keepdims=True), 1)
    axis.imshow(share, cmap="Blues", vmin=0, vmax=1)
    for (i, j), count in np.ndenumerate(rows):
        axis.text(j, i, str(count), ha="center", va="center", color="white" if share[i, j] > 0.5 else "black")
    places = range(len(labels))
    axis.set_xticks(places, labels, rotation=30, ha="right")
    axis.set_yticks(places, labels)
    axis.set(xlabel="found", ylabel="there is", title="test, counts")
