"""Areas of water, debris and fire on the ground, from pictures: what was looked at, and what was seen there.

The area is a grid of cells, and every frame tells of each cell that it shows, by the camera's pose and the ground's
height there, whether that is of a region: an occupancy grid (Moravec and Elfes, High resolution maps from wide angle
sonar, 1985), one for each label, with log-odds that are added and clamped (Hornung et al., OctoMap, 2013).

A detector that knows areas says it of each part of its picture. One that knows boxes alone says only how far a region
reaches; in the box lies dry ground, too. But a place that a frame shows *outside* all boxes is not of the region: from
many places the boxes carve a region's shape as silhouettes carve a body's.

What stands between hides a cell, the more so the farther aslant it is seen. A look from there at a cell that shows no
region says little against it: the share of the ground that is seen at an angle falls as exp(-FRONTAL tan(angle)).
Nor does a look from there make a region of what was seen from farther above to be none (`WORSE`).

**Confirmed** is a cell that so many consecutive frames have seen so, of those that show it, with a mean score that
reaches `confirm_score`: the paper's N = 3. **A region** is what cells make that are confirmed and still more
likely than not; those nearer to each other than `GAP_M` are one. So *two sightings are one target* when nothing wider
than that lies between the places that they cover, whenever and from wherever they were made.

A pure state machine on frames. Metres north and east of the caller's origin, heights upwards from it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from sitl_emu.missions.companion import planar_projection
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, distorted
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Detection, Detections
from sitl_emu.missions.companion.terrain.terrain_map import Bounds

Grid = npt.NDArray[np.float64]
Cells = npt.NDArray[np.bool_]
Where = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]
"""Rows and columns of cells."""

Projection = Callable[[CameraModel, CameraPose, Grid, Grid, Grid | float], tuple[Grid, Grid]]
"""From places (north, east, height) to pixels (x, y); NaN where one can't be seen."""

RESOLUTION_M = 1.0
GAP_M = 3.0
"""As of the detector's own regions (tools/detector/disaster.py)."""
LEAST_M2 = 4.0
"""What is smaller is no region; as there."""


class Evidence(NamedTuple):
    """How often a frame says of a cell that it is of a region, where it is of one, and where it is not."""

    if_there: float
    if_not: float

    def odds(self, says: Cells, visible: Grid) -> Grid:
        """Log-odds that a frame adds, by whether it says so, and by how likely a cell is not hidden from it."""
        there = np.maximum(self.if_there * visible, self.if_not)
        return np.where(says, np.log(there / self.if_not), np.log((1.0 - there) / (1.0 - self.if_not)))


BOX = Evidence(0.8, 0.35)
"""A cell in a box: the paper's Table 2 (recall 0.78); near a region, as boxes are larger; the second is ours."""
AREA = Evidence(0.85, 0.05)
"""A part that an area's share says is of it: water, ruins and fire are so in 0.97, 0.82 and 0.90 of the parts that show
them, others in 0.004 (companion/networks/disaster.md, test, from a half on). Less sure here, as frames of one place err
alike."""
FRONTAL = 0.5
"""What stands, seen from the side, over the ground that it stands on: 0.1 to 0.5 of towns (Grimmond and Oke, 1999), and
urban_flood is a dense one."""
STANDS_M = 2.0
"""So high over the ground stands what a picture shows of a ruin, a fire or a town's walls, and by so much times the
tangent of a look's angle from straight down it is seen beside its place. Walls of `debris_field` are 0.9 to 5.2 m high,
slabs lie 0.4 to 2.2 m up (its `kind.py`); one figure for all is ours."""
WORSE = RESOLUTION_M / 2.0 / STANDS_M
"""By so much more, half a cell's worth, is the tangent of the angle of a look from which nothing is believed that
better ones deny. Frames of one place and one angle err alike, and soon outvote what was seen from above: three at 45
degrees did ninety, and edges of ruins lay 0.32 m too far out in the mean instead of 0.15 (16ea5349)."""
LEAN = 0.25
"""By so much more where the camera's tilt is not reckoned with (`equations`): about the tangent of what a vehicle leans
by as it sets off and brakes. With `WORSE` alone 90 of 105 targets were found by equations, not all (07d0a51f). Ours."""
LEAST_SHARE = 0.65
"""Share from which a part of a picture is of a region. More than a half, as the network's shares are too large beside
edges, which count more in its training (`tools/detector/loss.py`): with a half, 6 of 17 places that the line was left
for in the towns of seeds 2, 4 and 6 were of no water. Ours."""
MOST = 3.5
"""Of log-odds, to either side: a cell changes its mind after as many frames (OctoMap's 0.97)."""
LOW_M = 12.0
"""Over the ground: from lower little dry ground is taken for an area (`places.LOW_DOUBT`)."""
NEAREST_M, NEAREST_BELOW_M = 0.05, 0.1
EDGE_PX = 4.0
"""A cell nearer to the picture's edge than this is not looked at."""


class Region(NamedTuple):
    """Cells of one label that belong together."""

    label: str
    cells: Cells
    """(rows, columns)."""
    score: float
    """Mean probability of its cells."""
    middle_m: tuple[float, float]
    """Of its cells."""

    @property
    def area_m2(self) -> float:
        """How much of it was seen."""
        return float(self.cells.sum()) * RESOLUTION_M**2


class _Look(NamedTuple):
    """What one frame shows: n cells."""

    cells: Where
    x: Grid
    y: Grid
    """Their pixels."""
    ray: Grid
    """(3, n): unit vectors to them, north, east, down."""
    steep: Grid
    """Tangents of the rays' angles from straight down."""
    height_m: float
    """Of the camera over the ground, the median of theirs."""


class RegionMap:
    """Takes frames' detections, gives regions."""

    def __init__(
        self,
        bounds: Bounds,
        labels: Sequence[str],
        camera: CameraModel,
        wanted: Confirming,
        location: str = "rays",
        scattered: Sequence[str] = (),
        whole_from_m: float = 0.0,
        area: Polygon | None = None,
    ) -> None:
        """`wanted`: `confirmations` and `confirm_score` of it count. `location`: one of `PROJECTIONS`.

        `scattered`: labels of which frames from lower over the ground than `whole_from_m` tell neither where they are
        nor where they are not, but that no parcel goes where they may be (`low_doubt`). `area`: regions are of what
        lies in it; what is seen beyond, and mostly from aslant, only says where no parcel goes.
        """
        south, west, north, east = bounds
        self.south_m, self.west_m = south, west
        rows, columns = math.ceil((north - south) / RESOLUTION_M), math.ceil((east - west) / RESOLUTION_M)
        self.shape = rows, columns
        self.labels, self._camera, self.wanted = tuple(labels), camera, wanted
        self._whole_from_m = whole_from_m
        self._project, self._scattered = PROJECTIONS[location], frozenset(scattered)
        self._worse = WORSE if location == "rays" else WORSE + LEAN
        row, column = np.mgrid[0:rows, 0:columns]
        self.north_m: Grid = south + (row + 0.5) * RESOLUTION_M
        self.east_m: Grid = west + (column + 0.5) * RESOLUTION_M
        self.looks = np.zeros(self.shape, np.int32)
        """How many frames have shown a cell."""
        self.rough = np.zeros(self.shape)
        """Mean share of edges in what these show of it."""
        self.steepness = np.full(self.shape, np.inf)
        """Tangent of the angle from straight down at which it was seen best."""
        self._first = np.zeros((3, *self.shape))
        self.turned = np.ones(self.shape)
        """Cosine of the greatest angle between the first look at a cell and another."""
        self._asked: Cells = np.ones(self.shape, np.bool_)
        if area is not None:
            self._asked = shapely.contains_xy(area, self.north_m, self.east_m)
        self.doubt = np.zeros(self.shape)
        """Mean of the greatest share of any label that these give it, each weighed by how near to its place it shows
        what stands (`_weight`), 0 where a detector knows boxes alone: what is too little to be of a region, as of
        shallow water."""
        self._weights = np.zeros(self.shape)
        """Of these, all together."""
        self.low_looks = np.zeros(self.shape, np.int32)
        self.low_doubt = np.zeros(self.shape)
        """The same of those frames alone that were taken from lower than `LOW_M`."""
        layers = (len(self.labels), *self.shape)
        self.odds = np.zeros(layers)
        """Logarithm of the odds that a cell is of a label."""
        self._run, self._run_score = np.zeros(layers, np.int32), np.zeros(layers)
        self._confirmed = np.zeros(layers, np.bool_)

    def update(
        self,
        pose: CameraPose,
        ground_m: Grid | float,
        detections: Sequence[Detection],
        edges: npt.NDArray[np.float32] | None = None,
    ) -> None:
        """A frame. `ground_m`: heights of the cells. `edges`: the share of edges in each part of the picture."""
        look = self._look(pose, ground_m)
        if look is None:
            return
        self.looks[look.cells] += 1
        self._tell_from_where(look)
        if edges is not None:
            _add_to_mean(self.rough, self.looks, look.cells, self._parts(edges, look))
        areas = detections.areas if isinstance(detections, Detections) else None
        shares = np.zeros((len(self.labels), len(look.x)))
        if areas is not None:
            shares[:] = [areas.at(label, look.x, look.y) for label in self.labels]
        self._tell_doubt(look, shares)
        worse = look.steep > self.steepness[look.cells] + self._worse
        for layer, label in enumerate(self.labels):
            if label in self._scattered and look.height_m < self._whole_from_m:
                continue
            if areas is not None:
                scores, evidence = np.where(shares[layer] >= LEAST_SHARE, shares[layer], 0.0), AREA
                visible = np.exp(-FRONTAL * look.steep)
            else:
                scores = _scores(look.x, look.y, [one for one in detections if one.label == label])
                evidence, visible = BOX, np.ones_like(look.steep)
            counts = ~((scores > 0.0) & worse)
            rows, columns = look.cells
            self._tell(layer, (rows[counts], columns[counts]), scores[counts], evidence, visible[counts])

    def regions(self) -> list[Region]:
        """What is confirmed and still there, label by label."""
        found = []
        for layer, label in enumerate(self.labels):
            there = self._confirmed[layer] & (self.odds[layer] > 0.0) & self._asked
            if not there.any():
                continue
            grow = round(GAP_M / 2.0 / RESOLUTION_M)
            kernel = np.ones((2 * grow + 1, 2 * grow + 1), np.uint8)
            count, numbers = cv2.connectedComponents(cv2.dilate(there.astype(np.uint8), kernel), connectivity=8)
            for number in range(1, count):
                cells = there & (numbers == number)
                if cells.sum() * RESOLUTION_M**2 >= LEAST_M2:
                    likely = 1.0 / (1.0 + np.exp(-self.odds[layer][cells]))
                    middle = float(self.north_m[cells].mean()), float(self.east_m[cells].mean())
                    found.append(Region(label, cells, float(likely.mean()), middle))
        return found

    def outlines(self, region: Region) -> list[list[tuple[float, float]]]:
        """The corners of a region's parts, each along the middles of its outermost cells."""
        rings, _ = cv2.findContours(region.cells.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        corners = [cv2.approxPolyDP(ring, 0.7, True).reshape(-1, 2).tolist() for ring in rings]
        return [
            [(float(self.north_m[row, 0]), float(self.east_m[0, column])) for column, row in ring] for ring in corners
        ]

    def cell(self, north_m: float, east_m: float) -> tuple[int, int] | None:
        """Row and column of a place; None beyond the map."""
        row = math.floor((north_m - self.south_m) / RESOLUTION_M)
        column = math.floor((east_m - self.west_m) / RESOLUTION_M)
        return (row, column) if 0 <= row < self.shape[0] and 0 <= column < self.shape[1] else None

    def is_asked(self, north_m: float, east_m: float) -> bool:
        """Whether a place lies in the area that regions are of."""
        at = self.cell(north_m, east_m)
        return at is not None and bool(self._asked[at])

    def _tell(self, layer: int, cells: Where, scores: Grid, evidence: Evidence, visible: Grid) -> None:
        """What one frame says of the cells that it shows: their scores, 0 of what is of no region."""
        hit = scores > 0.0
        at = layer, *cells
        self.odds[at] = np.clip(self.odds[at] + evidence.odds(hit, visible), -MOST, MOST)
        run = np.where(hit, self._run[at] + 1, 0)
        total = np.where(hit, self._run_score[at] + scores, 0.0)
        self._run[at], self._run_score[at] = run, total
        self._confirmed[at] |= (run >= self.wanted.confirmations) & (total >= self.wanted.confirm_score * run)

    def _look(self, pose: CameraPose, ground_m: Grid | float) -> _Look | None:
        """Which cells a frame shows, where in its picture, and from where; None: none of them."""
        camera = self._camera
        x, y = self._project(camera, pose, self.north_m, self.east_m, ground_m)
        shown = (x >= EDGE_PX) & (x <= camera.width - 1 - EDGE_PX)
        shown &= (y >= EDGE_PX) & (y <= camera.height - 1 - EDGE_PX)
        if not shown.any():
            return None
        rows, columns = np.nonzero(shown)
        cells = rows, columns
        north_m, east_m, down_m = (float(axis) for axis in pose.position_m)
        below = np.maximum(-down_m - np.broadcast_to(ground_m, self.shape)[cells], NEAREST_BELOW_M)
        north, east = self.north_m[cells] - north_m, self.east_m[cells] - east_m
        steep = np.hypot(north, east) / below
        ray = np.stack([north, east, below]) / (below * np.hypot(1.0, steep))
        return _Look(cells, x[cells], y[cells], ray, steep, float(np.median(below)))

    def _tell_from_where(self, look: _Look) -> None:
        """How near to straight down each cell was seen, and from how different places."""
        cells = rows, columns = look.cells
        self.steepness[cells] = np.minimum(self.steepness[cells], look.steep)
        first = np.where(self.looks[cells] == 1, look.ray, self._first[:, rows, columns])
        self._first[:, rows, columns] = first
        self.turned[cells] = np.minimum(self.turned[cells], (first * look.ray).sum(axis=0))

    def _tell_doubt(self, look: _Look, shares: Grid) -> None:
        """`shares`: of each label and cell."""
        most, weight = shares.max(axis=0, initial=0.0), _weight(look.steep)
        self._weights[look.cells] += weight
        _add_to_mean(self.doubt, self._weights, look.cells, most, weight)
        if look.height_m < LOW_M:
            self.low_looks[look.cells] += 1
            _add_to_mean(self.low_doubt, self.low_looks, look.cells, most)

    def _parts(self, edges: npt.NDArray[np.float32], look: _Look) -> Grid:
        """Of each cell's pixel: what is told of the part of the picture that it lies in."""
        rows, columns = edges.shape
        row = np.clip((look.y * rows / self._camera.height).astype(np.intp), 0, rows - 1)
        column = np.clip((look.x * columns / self._camera.width).astype(np.intp), 0, columns - 1)
        return np.asarray(edges[row, column], np.float64)


def by_rays(
    camera: CameraModel, pose: CameraPose, north_m: Grid, east_m: Grid, ground_m: Grid | float
) -> tuple[Grid, Grid]:
    """The pixels (x, y) at which places appear, by the whole attitude and the lens; NaN behind the camera."""
    places = np.broadcast_arrays(north_m, east_m, np.negative(ground_m))
    away = np.stack([axis - float(at) for axis, at in zip(places, pose.position_m, strict=True)])
    x, y, z = np.einsum("ij,jrc->irc", pose.to_ned.T, away)
    z = np.where(z > NEAREST_M, z, np.nan)
    x, y = x / z, y / z
    if any(camera.distortion):
        x, y = distorted(x, y, camera.distortion)
    return x * camera.fx + camera.cx, y * camera.fy + camera.cy


PROJECTIONS: Mapping[str, Projection] = {"rays": by_rays, "equations": planar_projection.pixels}
"""By the option `location`: the first is ours, the other the paper's equations 1 to 3."""


def _weight(steep: Grid) -> Grid:
    """What a look tells of a cell, by the tangent of its angle from straight down: by the variance of where it shows
    what stands there, a cell's and that of its height."""
    return np.asarray(1.0 / (RESOLUTION_M**2 + (STANDS_M * steep) ** 2))


def _add_to_mean(
    mean: Grid, total: Grid | npt.NDArray[np.int32], cells: Where, new: Grid, weight: Grid | float = 1.0
) -> None:
    """`total`: the weights of the values that the mean of each cell is of, all together, the new one's with them."""
    mean[cells] += (new - mean[cells]) * weight / total[cells]


def _scores(x: Grid, y: Grid, boxes: Sequence[Detection]) -> Grid:
    """Of each pixel the best score of the boxes that it lies in; 0 outside of all."""
    best = np.zeros(x.shape)
    for one in boxes:
        inside = (np.abs(x - one.x) <= one.w / 2.0) & (np.abs(y - one.y) <= one.h / 2.0)
        best[inside] = np.maximum(best[inside], one.score)
    return best
