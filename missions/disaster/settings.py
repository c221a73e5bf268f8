"""The options of the disaster mission, and what they mean."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from shapely import Polygon

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.missions.companion import calibration
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, Mount
from sitl_emu.missions.companion.coverage import CoverageError, footprint, inset, polygon
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Perception, looking_of
from sitl_emu.missions.companion.release_point import Parcel
from sitl_emu.missions.companion.swarm.key import SwarmKey, key_of
from sitl_emu.missions.companion.terrain.terrain_map import MOST_CELLS
from sitl_emu.missions.disaster.detectors import FROM_THE_AIR
from sitl_emu.missions.disaster.regions import RESOLUTION_M

LOCATIONS, ALTITUDES = ("rays", "equations"), ("fixed", "terrain")
ENGAGES = ("places", "detections")

LEAST_CORNERS = 3
MOST_MEMBERS = 16
"""As many bits has `records.State`."""
GATHER_TIMEOUT_S = 120.0
"""As long as an autopilot may take to be ready; ours."""


class Team(NamedTuple):
    """Who flies together, and what they agree on."""

    key: SwarmKey
    members: tuple[int, ...]
    """MAVLink systems of all."""
    datum_amsl_m: float
    """From which the scan altitude counts, the same for all."""
    gather_timeout_s: float = GATHER_TIMEOUT_S
    """So long each waits on the ground for those that it has not heard yet."""


class Settings(NamedTuple):
    """What a flight is to be."""

    corners_deg: tuple[Corner, ...]
    """Latitude and longitude of the area's corners;"""
    holes_deg: tuple[tuple[Corner, ...], ...]
    """and of those of its holes."""
    perception: Perception
    camera: CameraModel
    mount: Mount
    parcel: Parcel | None
    """None: it carries none, and only scans."""
    scan_altitude_m: float = 20.0
    """Above home, and above the mapped ground with `altitude: terrain`; the paper's."""
    scan_speed_m_s: float = 5.0
    """With which it goes from place to place; PX4's MPC_XY_CRUISE."""
    release_height_m: float = 7.0
    """Above the ground: what the lidar measures (TF-Luna: 8 m)."""
    ground_sigma_m: float = 2.0
    """How far the ground may be from home's height where it is not mapped (geolocation.HOME_HEIGHT_SIGMA_M)."""
    overlap: float = 0.3
    margin_m: float = 0.0
    fence_margin_m: float = 30.0
    location: str = "rays"
    altitude: str = "fixed"
    engage: str = "places"
    """`detections`: as the paper prints it (`as_printed.py`)."""
    terrain_map: Path | None = None
    """A GeoTIFF to write when the scan has ended."""
    ready_timeout_s: float = 120.0
    team: Team | None = None
    """None: alone."""

    @property
    def middle_deg(self) -> Corner:
        """Latitude and longitude of the mean of the area's corners."""
        lat_deg, lon_deg = (math.fsum(each) / len(each) for each in zip(*self.corners_deg, strict=True))
        return lat_deg, lon_deg

    def area_m(self, lat_deg: float, lon_deg: float) -> Polygon:
        """The area in metres north and east of a place. Raises CoverageError."""
        rings = (self.corners_deg, *self.holes_deg)
        corners, *holes = ([to_metres(*corner, lat_deg, lon_deg) for corner in ring] for ring in rings)
        return polygon(corners, holes)

    def map_m(self, area: Polygon) -> tuple[float, float, float, float]:
        """The bounds of what is mapped, south, west, north, east: an area, and what is seen from over its edge."""
        south, west, north, east = area.buffer(max(footprint(self.camera, self.scan_altitude_m)) / 2.0).bounds
        return south, west, north, east


def settings_of(given: Options) -> Settings:
    """From a scenario's options, or a command line's. Raises ValueError."""
    corners, holes = _area(given.content("area"))
    camera, mount = calibration.of(given, NADIR)
    carries = given.yes_or_no("parcel", True)
    parcel = Parcel(
        given.number("parcel_mass_kg", 2.0, 0.05, 10.0),
        given.number("parcel_drag_m2", 0.045, 0.0, 1.0),
        given.number("parcel_half_height_m", 0.06, 0.0, 1.0),
    )
    perception = looking_of(given, FROM_THE_AIR)
    confirming = perception.confirming._replace(
        confirmations=given.whole("confirmations", perception.confirming.confirmations, 1, 100),
        confirm_score=given.number("confirm_score", perception.confirming.confirm_score, 0.0, 1.0),
    )
    altitude, engage, team = _word(given, "altitude", ALTITUDES), _word(given, "engage", ENGAGES), _team(given)
    if team is not None and altitude != ALTITUDES[0]:
        raise ValueError(f"option altitude: {altitude!r}: several aircraft keep apart by height; allowed: fixed")
    if team is not None and engage != ENGAGES[0]:
        raise ValueError(f"option engage: {engage!r}: several aircraft share regions, not boxes; allowed: places")
    made = Settings(
        corners,
        holes,
        perception._replace(confirming=confirming),
        camera,
        mount,
        parcel if carries else None,
        scan_altitude_m=given.number("scan_altitude_m", 20.0, 3.0, 100.0),
        scan_speed_m_s=given.number("scan_speed_m_s", 5.0, 0.5, 20.0),
        release_height_m=given.number("release_height_m", 7.0, 3.0, 100.0),
        ground_sigma_m=given.number("ground_sigma_m", 2.0, 0.1, 50.0),
        overlap=given.number("overlap", 0.3, 0.0, 0.9),
        margin_m=given.number("margin_m", 0.0, 0.0, 100.0),
        fence_margin_m=given.number("fence_margin_m", 30.0, 0.0, 1000.0),
        location=_word(given, "location", LOCATIONS),
        altitude=altitude,
        engage=engage,
        terrain_map=given.file("terrain_map"),
        ready_timeout_s=given.number("ready_timeout_s", 120.0, 5.0, 3600.0),
        team=team,
    )
    _check_area(made)
    return made


def _check_area(settings: Settings) -> None:
    """Raises ValueError for an area over which no lines can be laid, or of which the map would be too large."""
    try:
        area = settings.area_m(*settings.middle_deg)
    except CoverageError as error:
        raise ValueError(f"option {error}") from None
    try:
        inset(area, settings.margin_m)
    except CoverageError:
        small = f"option margin_m: {settings.margin_m:g}: leaves nothing of the area"
        raise ValueError(f"{small}; allowed: less than half of its width") from None
    south, west, north, east = settings.map_m(area)
    if (north - south) * (east - west) > MOST_CELLS * RESOLUTION_M**2:
        large = f"option area: {north - south:.0f} x {east - west:.0f} m, with what is seen from its edges"
        raise ValueError(f"{large}; allowed: {MOST_CELLS * RESOLUTION_M**2:.0f} m2; divide it")


def _team(given: Options) -> Team | None:
    """Who flies together; None where it is one alone. Raises ValueError."""
    text = given.text("members", "alone")
    gather_timeout_s = given.number("gather_timeout_s", GATHER_TIMEOUT_S, 0.0, 3600.0)
    if text == "alone":
        return None
    allowed = f"the MAVLink systems of all, 2 to {MOST_MEMBERS}, such as '1 2 3'"
    try:
        members = tuple(sorted({int(word) for word in text.split()}))
    except ValueError:
        members = ()
    if not 2 <= len(members) <= MOST_MEMBERS or not all(0 < one < 251 for one in members):
        raise ValueError(f"option members: {text!r}; allowed: {allowed}")
    datum_amsl_m = given.number("datum_amsl_m", math.nan, -500.0, 9000.0)
    return Team(key_of(given), members, datum_amsl_m, gather_timeout_s)


def _word(given: Options, name: str, allowed: tuple[str, ...]) -> str:
    word = given.text(name, allowed[0])
    if word not in allowed:
        raise ValueError(f"option {name}: {word!r}; allowed: {', '.join(allowed)}")
    return word


def _area(area: Mapping[str, Any] | None) -> tuple[tuple[Corner, ...], tuple[tuple[Corner, ...], ...]]:
    """Corners and holes of the option. Raises ValueError."""
    allowed = (
        "{corners: [[lat, lon], …], holes: […]} in degrees, or a JSON file with it; in a simulated run also `world`"
    )
    if area is None or set(area) - {"corners", "holes"} or "corners" not in area:
        raise ValueError(f"option area: {'missing' if area is None else repr(area)}; allowed: {allowed}")
    try:
        corners, *holes = (
            tuple((float(lat), float(lon)) for lat, lon in ring) for ring in (area["corners"], *area.get("holes", ()))
        )
    except (TypeError, ValueError):
        raise ValueError(f"option area: {area!r}; allowed: {allowed}") from None
    if len(corners) < LEAST_CORNERS:
        raise ValueError(f"option area: {len(corners)} corners; allowed: {LEAST_CORNERS} or more")
    if not all(abs(lat) <= 90.0 and abs(lon) <= 180.0 for ring in (corners, *holes) for lat, lon in ring):
        raise ValueError(f"option area: {area!r}: beyond the Earth; allowed: {allowed}")
    return corners, tuple(holes)
