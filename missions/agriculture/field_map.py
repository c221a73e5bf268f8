"""A farmer's map of a field of row crop: where its rows run, how far apart, and how much room there is to turn.

What a guidance system for tractors keeps of a field: its outline, the rows' heading, the first of them, their spacing,
and the headland. The UGV has it as its option `field_map` (a mapping, or the name of a JSON file with one):

    origin: [40.47, -86.99]     # latitude and longitude of the point that the metres below count from
    outline_m: [[0, 0], [0, 80], [80, 80], [80, 0]]   # corners, north and east: a rectangle along the rows
    rows_deg: 0                 # heading of the rows, from north over east
    first_row_m: 3.25           # from the side of the outline that is to the left as one looks along the rows
    row_spacing_m: 0.75
    headland_m: 3               # without crop, within the outline, at the rows' ends and along the sides
    margin_m: 3                 # beyond the outline, that may be driven on

In a simulated run `origin` and `outline_m` may be left out: they are the world's, as for a scout's `plan: field`. The
rest is the scenario's word, and nobody checks it against the plants.

Places are worked with in metres along the rows and across them, to the right: (along_m, across_m). A *lane* is the line
midway between two rows, or as far outside the outermost ones: what a rover drives on.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeGuard

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.mission import Setting

NAME = "field_map"
SQUARE_M = 0.5
"""So far a corner may lie off the rectangle that the rows' heading makes of the outline."""
NUMBERS = {
    "rows_deg": (-360.0, 360.0),
    "first_row_m": (0.0, 1000.0),
    "row_spacing_m": (0.2, 5.0),
    "headland_m": (0.0, 100.0),
    "margin_m": (0.0, 100.0),
}
"""What a map says beside origin and outline, each with its limits."""

Spot = tuple[float, float]
"""Metres along the rows and across them, from the map's origin."""


class Box(NamedTuple):
    """A rectangle along and across the rows."""

    along0_m: float
    along1_m: float
    across0_m: float
    across1_m: float

    def wider(self, by_m: float) -> "Box":
        """The same, larger on all four sides."""
        return Box(self.along0_m - by_m, self.along1_m + by_m, self.across0_m - by_m, self.across1_m + by_m)

    def contains(self, spot: Spot) -> bool:
        """Whether a spot lies within."""
        return self.along0_m < spot[0] < self.along1_m and self.across0_m < spot[1] < self.across1_m


class FieldMap(NamedTuple):
    """See the module."""

    origin_deg: tuple[float, float]
    outline: Box
    """Along and across the rows."""
    rows_deg: float
    first_row_m: float
    row_spacing_m: float
    headland_m: float
    margin_m: float

    @property
    def crop(self) -> Box:
        """Where plants stand: from the first row to the last, between the headlands."""
        outline, first_m = self.outline, self.outline.across0_m + self.first_row_m
        last_m = first_m + (self._rows - 1) * self.row_spacing_m
        return Box(outline.along0_m + self.headland_m, outline.along1_m - self.headland_m, first_m, last_m)

    @property
    def drivable(self) -> Box:
        """The outline and what may be driven on around it."""
        return self.outline.wider(self.margin_m)

    @property
    def _rows(self) -> int:
        width_m = self.outline.across1_m - self.outline.across0_m - self.first_row_m - self.headland_m
        return math.floor(width_m / self.row_spacing_m + 1e-6) + 1

    def lane_m(self, across_m: float) -> float:
        """Across, of the lane that is nearest to a place."""
        first_m = self.outline.across0_m + self.first_row_m - self.row_spacing_m / 2.0
        lane = round((across_m - first_m) / self.row_spacing_m)
        return first_m + min(max(lane, 0), self._rows) * self.row_spacing_m

    def spot(self, lat_deg: float, lon_deg: float) -> Spot:
        """A place, along and across the rows."""
        return self.turned(*to_metres(lat_deg, lon_deg, *self.origin_deg))

    def turned(self, north_m: float, east_m: float) -> Spot:
        """A direction, or a place from the origin, along and across the rows."""
        return _turned(north_m, east_m, self.rows_deg)

    def place(self, spot: Spot) -> tuple[float, float]:
        """Latitude and longitude of a spot."""
        return from_metres(*self.unturned(*spot), *self.origin_deg)

    def unturned(self, along_m: float, across_m: float) -> tuple[float, float]:
        """The inverse of `turned`: north and east."""
        return _turned(along_m, across_m, -self.rows_deg)


def _turned(north_m: float, east_m: float, heading_deg: float) -> tuple[float, float]:
    c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    return north_m * c + east_m * s, east_m * c - north_m * s


def of(given: Options) -> FieldMap | None:
    """The map of a program's option `field_map`, None without one. Raises ValueError."""
    told = given.content(NAME)
    return None if told is None else read(told)


def with_world(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The options, origin and outline of a `field_map` that lacks them being the world's. Raises ValueError."""
    if options.get(NAME) is None:
        return options
    told = Options({NAME: options[NAME]}).content(NAME) or {}
    if "outline_m" not in told and not setting.outline_m:
        raise ValueError(f"option {NAME}: outline_m: missing, and world {setting.world} has no field; give its corners")
    world = {"origin": list(setting.home[:2]), "outline_m": [list(corner) for corner in setting.outline_m]}
    whole = {**world, **told}
    read(whole)
    return {**options, NAME: whole}


def read(told: Mapping[str, Any]) -> FieldMap:
    """A map from what its mapping says. Raises ValueError, which names what is wrong and what is allowed."""
    known = ("origin", "outline_m", *NUMBERS)
    unknown = next((name for name in told if name not in known), None)
    if unknown is not None:
        raise ValueError(f"option {NAME}: {unknown}: unknown; allowed: {', '.join(known)}")
    numbers = {name: _number(told, name) for name in NUMBERS}
    origin = told.get("origin")
    if not _is_pair(origin) or abs(origin[0]) > 90.0 or abs(origin[1]) > 180.0:
        raise ValueError(f"option {NAME}: origin: {origin!r}; allowed: [latitude, longitude] in degrees")
    outline = _outline(told.get("outline_m"), numbers["rows_deg"])
    made = FieldMap((float(origin[0]), float(origin[1])), outline, **numbers)
    crop = made.crop
    if crop.along1_m <= crop.along0_m or crop.across1_m < crop.across0_m:
        raise ValueError(f"option {NAME}: headland_m: {made.headland_m:g}: leaves no room for rows within the outline")
    return made


def _outline(corners: Any, rows_deg: float) -> Box:
    if not isinstance(corners, list | tuple) or len(corners) != 4 or not all(map(_is_pair, corners)):
        raise ValueError(f"option {NAME}: outline_m: {corners!r}; allowed: four corners [north, east] in metres")
    along, across = zip(*(_turned(north_m, east_m, rows_deg) for north_m, east_m in corners), strict=True)
    box = Box(min(along), max(along), min(across), max(across))
    for spot in zip(along, across, strict=True):
        off_m = max(min(abs(m - low), abs(m - high)) for m, low, high in zip(spot, box[::2], box[1::2], strict=True))
        if off_m > SQUARE_M:
            raise ValueError(
                f"option {NAME}: outline_m: {corners!r}; allowed: a rectangle whose sides run along and across "
                f"rows of heading {rows_deg:g} deg"
            )
    return box


def _number(told: Mapping[str, Any], name: str) -> float:
    value, (low, high) = told.get(name), NUMBERS[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        shown = "missing" if value is None else repr(value)
        raise ValueError(f"option {NAME}: {name}: {shown}; allowed: a number from {low:g} to {high:g}")
    return float(value)


def _is_pair(value: Any) -> TypeGuard[Sequence[float]]:
    return (
        isinstance(value, list | tuple)
        and len(value) == 2
        and all(isinstance(each, int | float) and not isinstance(each, bool) and math.isfinite(each) for each in value)
    )
