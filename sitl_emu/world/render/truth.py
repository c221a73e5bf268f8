"""What is to be seen in a frame, as the renderer knows it: boxes of things, and of areas such as water or a fire.

A thing (car, person) has a box of what is seen and one of all of it, and the share that others hide. An area (water,
ruins, fire) is what pixels show: those nearer to each other than `Area.gap_m` are one region, whose box is that of its
part in the picture, however far the area reaches beyond. A region too small to be asked for is there all the same,
as `is_ignored`: whoever finds it is neither right nor wrong.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.world.render.burning import EMBERS_S, NEVER, arrival_s
from sitl_emu.world.render.kernel import F32, F64, I32
from sitl_emu.world.render.raster import NEAR_M, NOTHING, Buffers, Drawn, Pinhole, project, rasterise
from sitl_emu.world.render.scene import MeshScene, View

Mask = npt.NDArray[np.bool_]
Box = tuple[float, float, float, float]
"""Left, top, right, bottom in pixels; right and bottom are the first that it does not reach."""


class Area(NamedTuple):
    """A class of areas."""

    label: str
    of: tuple[str, ...]
    """Objects whose label begins with one of these are parts of it."""
    gap_m: float
    """Parts nearer than this are one region."""
    least_m2: float
    """What is seen of a smaller one is ignored."""
    burns: bool = False
    """Ground that burns or still glows (burning.EMBERS_S) is part of it as well, smoke or not."""
    ignored: tuple[str, ...] = ()
    """Objects whose label begins with one of these are no region of their own: they are ignored."""


SMALLEST_SHARE = 1.0 / 32.0
"""Of the picture's height: boxes with a shorter side are ignored."""


class Seen(NamedTuple):
    """One thing or region in a frame."""

    label: str
    name: str
    """The object's; of a region, its area's label."""
    box: Box
    """Of what is seen."""
    whole_box: Box | None
    """Of all of it, also what is hidden or beyond the picture; None: an area, or partly behind the camera."""
    pixels: int
    """How many show it."""
    hidden: float
    """The share that others hide of what the picture would show of it alone; 0 for areas."""
    is_cut: bool
    """It reaches the picture's edge."""
    is_ignored: bool


def masked_regions(
    scene: MeshScene, view: View, camera: Pinhole, areas: Sequence[Area], time_s: float = 0.0
) -> list[tuple[Seen, Mask]]:
    """All regions of all areas in a view of a time, area by area, from top to bottom, each with its pixels."""
    found: list[tuple[Seen, Mask]] = []
    for area in areas:
        found += regions_of(area, mask_of(scene, view, camera, area, time_s), view, camera)
        if area.ignored:
            loose = regions_of(area, _of_labels(scene, view, area.ignored), view, camera)
            found += [(seen._replace(is_ignored=True), mask) for seen, mask in loose]
    return found


def _of_labels(scene: MeshScene, view: View, beginnings: tuple[str, ...]) -> Mask:
    part = np.array([label.startswith(beginnings) for label in scene.labels] + [False])
    return np.asarray(part[view.objects])  # SKY is -1, the last


def mask_of(scene: MeshScene, view: View, camera: Pinhole, area: Area, time_s: float = 0.0) -> Mask:
    """(height, width): the pixels that show an area."""
    mask = _of_labels(scene, view, area.of)
    for fire in scene.world.description.fires if area.burns else ():
        rows, columns = np.nonzero(view.objects == scene.labels.index("terrain"))
        north, east, _ = _places(view.depth_m, camera, rows, columns)
        since_s = time_s - arrival_s(fire, scene.world.description, north, east)
        mask[rows, columns] |= (since_s >= 0.0) & (since_s < (fire.burns_s or NEVER) + EMBERS_S)
    return np.asarray(mask)


def _places(depth: F32, camera: Pinhole, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]) -> F64:
    """(3, n), NED: where pixels' rays end."""
    z = depth[rows, columns].astype(np.float64)
    x = (columns + 0.5 - 0.5 * camera.width) / camera.focal_px * z
    y = (rows + 0.5 - 0.5 * camera.height) / camera.focal_px * z
    return np.asarray(camera.rotation @ np.stack((x, y, z)) + camera.position[:, None])


def regions_of(
    area: Area, mask: Mask, view: View, camera: Pinhole, least_px: float | None = None
) -> list[tuple[Seen, Mask]]:
    """The regions of an area that a mask shows, each with its own part of the mask.

    `least_px`: those with a shorter side are ignored; None: SMALLEST_SHARE says.
    """
    if not mask.any():
        return []
    metres = view.depth_m / camera.focal_px
    reach = max(round(0.5 * area.gap_m / float(np.median(metres[mask]))), 1)
    # A level kernel of odd size: grown by half the gap to each side, parts that are nearer touch
    grown = cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    count, number = cv2.connectedComponents(grown, connectivity=8)
    found = []
    for k in range(1, count):
        own = mask & (number == k)
        box = _box(own)
        shown_m2 = float((metres[own].astype(np.float64) ** 2).sum())
        is_small = shown_m2 < area.least_m2 or _is_small(box, camera, least_px)
        found.append(
            (Seen(area.label, area.label, box, None, int(own.sum()), 0.0, _is_cut(box, camera), is_small), own)
        )
    return found


def _is_small(box: Box, camera: Pinhole, least_px: float | None) -> bool:
    least = SMALLEST_SHARE * camera.height if least_px is None else least_px
    return min(box[2] - box[0], box[3] - box[1]) < least


def _box(mask: Mask) -> Box:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def _is_cut(box: Box, camera: Pinhole) -> bool:
    return box[0] <= 0 or box[1] <= 0 or box[2] >= camera.width or box[3] >= camera.height


def things_in(
    scene: MeshScene, view: View, camera: Pinhole, classes: Mapping[str, str], least_px: float | None = None
) -> list[Seen]:
    """Things and solids of which at least a pixel is seen; `classes`: by the objects' label, what they are called.

    `least_px`: as `regions_of` has it.
    """
    return [seen for _, seen in numbered_things(scene, view, camera, classes, least_px)]


def numbered_things(
    scene: MeshScene, view: View, camera: Pinhole, classes: Mapping[str, str], least_px: float | None = None
) -> list[tuple[int, Seen]]:
    """The same, each with its object's number in `View.objects`."""
    counts = np.bincount(view.objects[view.objects >= 0], minlength=len(scene.labels))
    found = []
    for number in np.flatnonzero(counts):
        label = classes.get(scene.labels[number])
        instances = np.flatnonzero(scene.things.objects == number).astype(np.int32)
        if label is None or len(instances) == 0:
            continue
        box = _box(view.objects == number)
        whole, alone = _alone(scene, camera, instances)
        pixels = int(counts[number])
        hidden = max(1.0 - pixels / max(alone, 1), 0.0)
        cut, small = _is_cut(box if whole is None else whole, camera), _is_small(box, camera, least_px)
        found.append((int(number), Seen(label, scene.names[number], box, whole, pixels, hidden, cut, small)))
    return found


def _alone(scene: MeshScene, camera: Pinhole, instances: I32) -> tuple[Box | None, int]:
    """The box of all corners of an object's finest meshes, and how many pixels it would fill if it were alone."""
    levels = scene.things.first_level[instances]
    sizes = scene.meshes.levels[levels, 1] - scene.meshes.levels[levels, 0]
    first = (np.cumsum(sizes) - sizes).astype(np.int32)
    corners = int(sizes.sum())
    drawn = Drawn(instances, levels, first, np.zeros((corners, 3), np.float32), np.zeros((corners, 3)))
    count = camera.width * camera.height
    out = Buffers(np.zeros(count, np.float32), np.zeros(count, np.int32), np.zeros(count, np.int32))
    project(scene.meshes, scene.things, camera, drawn, len(instances))
    rasterise(scene.meshes, scene.things, camera, drawn, len(instances), out, np.empty((4, 3)))
    pixels = int((out.slot != NOTHING).sum())
    if not (drawn.seen[:, 2] > NEAR_M).all():
        return None, pixels
    (left, top), (right, bottom) = drawn.projected[:, :2].min(axis=0), drawn.projected[:, :2].max(axis=0)
    return (float(left), float(top), float(right), float(bottom)), pixels
