"""COCO's table of detections (https://cocodataset.org/#format-data), with what else is known in fields of our own.

A box is x, y, width and height in pixels from the left upper corner. `iscrowd` is 1 for what is too small to be asked
for: evaluations leave it out, and its segmentation is run lengths; of all others it is polygons.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sitl_emu.world.labels import outline
from sitl_emu.world.labels.outline import Mask

if TYPE_CHECKING:
    from sitl_emu.world.render.truth import Seen


def table(classes: Sequence[str], description: str = "") -> dict[str, Any]:
    """An empty one; categories are numbered from 1."""
    return {
        "info": {"description": description, "version": "1.0"},
        "licenses": [],
        "images": [],
        "annotations": [],
        "categories": [{"id": k + 1, "name": name, "supercategory": ""} for k, name in enumerate(classes)],
    }


def add_image(table: dict[str, Any], file: str, width: int, height: int, **more: Any) -> int:
    """Add one picture: its number. `more`: fields of one's own."""
    number = len(table["images"]) + 1
    table["images"].append({"id": number, "file_name": file, "width": width, "height": height, **more})
    return number


def add(table: dict[str, Any], image: int, seen: "Seen", mask: Mask | None = None, **more: Any) -> None:
    """Add what is seen in a picture; its label must be a category. Ours: `hidden` (share), `cut`, `more`."""
    left, top, right, bottom = seen.box
    category = next(each["id"] for each in table["categories"] if each["name"] == seen.label)
    row = {
        "id": len(table["annotations"]) + 1,
        "image_id": image,
        "category_id": category,
        "bbox": [left, top, right - left, bottom - top],
        "area": seen.pixels,
        "iscrowd": int(seen.is_ignored),
        "hidden": seen.hidden,
        "cut": seen.is_cut,
        **more,
    }
    if mask is not None:
        row["segmentation"] = outline.run_lengths(mask) if seen.is_ignored else outline.polygons(mask)
    table["annotations"].append(row)
