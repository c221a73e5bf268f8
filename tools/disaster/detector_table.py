"""The paper's Table 2 beside the network that ships."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion import networks
from tools.detector import dataset, evaluate
from tools.detector.plan import Plan

PAPER = {
    "water_body": ("0.87", "0.84", "0.85", "0.89"),
    "debris_field": ("0.81", "0.78", "0.79", "0.84"),
    "fire_region": ("0.76", "0.72", "0.74", "0.78"),
    "all": ("0.81", "0.78", "0.79", "0.84"),
}
"""The paper's: precision, recall, F1 and mAP@0.5; its test set is of real pictures."""
COLUMNS = "precision", "recall", "F1", "mAP@0.5"
SEED = 1000
"""Of the worlds that the network is scored by: far from those of any training (`networks/disaster.md`)."""


def scored(out: Path, processes: int) -> str:
    """Table 2, of the network that ships: draws worlds for validation and test where they are missing. Markdown."""
    plan = Plan(out / "data", seed=SEED, splits=("val", "test"))
    print("Table 2: drawing worlds, then scoring; some 15 minutes of one core")
    dataset.draw(plan, processes)
    evaluate.evaluate(networks.path_of("disaster"), plan.folder, out / "scores")
    return rows_of(json.loads((out / "scores" / "scores.json").read_text())["sets"]["test"])


def rows_of(scores: Mapping[str, Any]) -> str:
    """`scores`: of one set, as `tools.detector evaluate` writes them. Markdown."""
    lines = ["### Table 2: the detector", "", f"| class | {' | '.join(COLUMNS)} | paper |"]
    lines += ["| --- |" + " --- |" * (len(COLUMNS) + 1)]
    each = {name: (one["precision"], one["recall"], one["f1"], one["ap50"]) for name, one in scores["classes"].items()}
    f1 = math.fsum(one[2] for one in each.values()) / len(each)
    each["all"] = scores["precision"], scores["recall"], f1, scores["map50"]
    for name, values in each.items():
        cells = " | ".join(f"{value:.2f}" if k < 3 else f"{value:.3f}" for k, value in enumerate(values))
        lines.append(f"| {name} | {cells} | {', '.join(PAPER[name])} |")
    return "\n".join(lines) + "\n"
