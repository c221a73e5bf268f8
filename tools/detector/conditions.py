"""How finds depend on where and when a picture was taken: its height, the sun and the haze."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from sitl_emu.missions.companion.yolo import Found
from tools.detector.scores import Truth, confusion


class Condition(NamedTuple):
    """One that is told apart."""

    name: str
    key: str
    """What `dataset` calls it."""
    scale: float
    """From `dataset`'s unit to that of `name`."""
    edges: tuple[float, ...]


CONDITIONS = (
    Condition("height above ground, m", "above_m", 1.0, (0, 5, 10, 15, 20, 25, 30, 40, 60)),
    Condition("sun above the horizon, degrees", "sun_deg", 1.0, (0, 10, 20, 30, 40, 50, 70)),
    Condition("haze, 1/km", "haze_1_m", 1e3, (0.0, 0.4, 0.8, 1.6, 3.0, 4.5, 6.0)),
)


class Bin(NamedTuple):
    """What was found under one condition, from a score on, at an IoU of 0.5 and with its own label."""

    low: float
    high: float
    pictures: int
    truths: int
    found: int
    false: int


def binned(
    condition: Condition, found: Sequence[Found], truths: Sequence[Truth], about: Sequence[Mapping[str, Any]],
    classes: int, at: float,
) -> list[Bin]:  # fmt: skip
    """Of pictures, detections, truths and what is known of them in the same order; empty bins are left out."""
    bins = []
    for low, high in zip(condition.edges[:-1], condition.edges[1:], strict=True):
        chosen = [k for k, one in enumerate(about) if low <= condition.scale * one[condition.key] < high]
        if chosen:
            table = confusion([found[k] for k in chosen], [truths[k] for k in chosen], classes, at)
            right = int(table.diagonal()[:classes].sum())
            bins.append(
                Bin(low, high, len(chosen), int(table[:classes].sum()), right, int(table[:, :classes].sum()) - right)
            )
    return bins
