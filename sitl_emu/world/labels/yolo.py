"""YOLO's files: a text a picture, a line for each box, and `data.yaml`, which says where they are and what is what.

As Ultralytics reads them (https://docs.ultralytics.com/datasets/detect/).
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import yaml

if TYPE_CHECKING:
    from sitl_emu.world.render.truth import Seen


def text(seen: Iterable["Seen"], classes: Sequence[str], width: int, height: int) -> str:
    """A line for each that counts: class, middle and size in shares of the picture."""
    lines = []
    for each in seen:
        if not each.is_ignored:
            left, top, right, bottom = each.box
            shares = ((left + right) / 2 / width, (top + bottom) / 2 / height, (right - left) / width,
                      (bottom - top) / height)  # fmt: skip
            lines.append(f"{classes.index(each.label)} " + " ".join(f"{share:.6f}" for share in shares) + "\n")
    return "".join(lines)


def data(classes: Sequence[str], splits: Mapping[str, str]) -> str:
    """The text of data.yaml; `splits`: folders of pictures beside it, by what they are for."""
    names = dict(enumerate(classes))
    told: str = yaml.safe_dump({"path": ".", **splits, "names": names}, sort_keys=False, allow_unicode=True)
    return told
