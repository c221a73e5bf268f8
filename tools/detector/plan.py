"""What a data set is made of: worlds to draw, each in one split, and frames with what is seen in them."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.truth import Seen

SPLITS = ("train", "val", "test", "asset", "light")
OF_TWENTY, VAL, TEST = 20, (3, 10, 16), (6, 13, 19)
"""Which of twenty worlds of a kind are for validation and test; the others, 70 per cent, are for training."""


class Plan(NamedTuple):
    """One data set."""

    folder: Path
    images: int = 4200
    """Of training, validation and test together."""
    held_out: int = 360
    """Of each of the sets `asset` and `light`."""
    per_world: int = 24
    width: int = 640
    height: int = 480
    seed: int = 1
    subject: str = "disaster"
    """What is looked for: a name of `dataset.SUBJECTS`."""
    splits: tuple[str, ...] = SPLITS
    """Whose worlds are drawn."""


class Job(NamedTuple):
    """One world to draw."""

    plan: Plan
    family: str
    number: int
    split: str

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.family}_{self.number:04d}"


class Frame(NamedTuple):
    """One picture."""

    image: npt.NDArray[np.uint8]
    seen: list[Seen]
    shot: dict[str, Any]
    """Where and when it was taken; `above_m` among it."""
    regions: npt.NDArray[np.uint8] | None = None
    """(height, width): which of `seen` a pixel shows, from 1 on; 0: none. None: boxes are all that is known."""


class World(NamedTuple):
    """One world, drawn as its frames are asked for."""

    about: dict[str, Any]
    """`kind`, `haze_1_m`, `sun_deg`."""
    frames: Iterator[Frame]


class Subject(NamedTuple):
    """What a network learns to find."""

    classes: tuple[str, ...]
    jobs: Callable[[Plan], list[Job]]
    draw: Callable[[Job], World]


def dealt(place: int) -> str:
    """The split of world number `place` of its kind."""
    place %= OF_TWENTY
    return "val" if place in VAL else "test" if place in TEST else "train"
