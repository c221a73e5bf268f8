"""QGroundControl's `.plan` files: to mission items and back.

Format: https://docs.qgroundcontrol.com/master/en/qgc-dev-user-guide/file_formats/plan.html, as QGroundControl 4.4
writes it. `read_plan` gives what QGroundControl would upload to a PX4: SimpleItems, the generated items of a Survey
or CorridorScan (`TransectStyleComplexItem.Items`), fence polygons and circles, rally points. `survey_plan` makes a
file's content with a Survey from a polygon, as QGroundControl would save it for a camera without specifications. Not
supported, and told: StructureScan and landing patterns (no generated items in the file), terrain following, MAVLink
commands outside 0..65535. `breachReturn` is left out: PX4 does not use it.
"""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.gcs.geodesy import distance_m, from_metres, to_metres
from sitl_emu.gcs.mission import MissionItem

FRAME_GLOBAL, FRAME_MISSION, FRAME_GLOBAL_RELATIVE_ALT = 0, 2, 3
GLOBAL_FRAMES = (0, 3, 5, 6)
LOCAL_FRAMES = (1, 2)
NAV_WAYPOINT, NAV_RETURN_TO_LAUNCH, NAV_TAKEOFF = 16, 20, 22
DO_JUMP, DO_CHANGE_SPEED, DO_SET_CAM_TRIGG_DIST = 177, 178, 206
FENCE_POLYGON_INCLUSION, FENCE_POLYGON_EXCLUSION = 5001, 5002
FENCE_CIRCLE_INCLUSION, FENCE_CIRCLE_EXCLUSION = 5003, 5004
RALLY_POINT = 5100
TRANSECT_ITEMS = ("survey", "CorridorScan")
UNSET_INT = 0x7FFFFFFF
LARGEST_FLOAT = 3.4028234663852886e38
"""The largest that 32 bits hold; params, altitudes and radii travel so."""
MOST_ITEMS = 65535


class PlanError(ValueError):
    """A plan file that can't be read; one line with file, field, value and what is allowed."""


class FlightPlan(NamedTuple):
    """What a plan file asks to upload, for MAV_MISSION_TYPE mission, fence and rally."""

    mission: tuple[MissionItem, ...]
    fence: tuple[MissionItem, ...]
    rally: tuple[MissionItem, ...]
    home: tuple[float, float, float]
    """plannedHomePosition: latitude, longitude in degrees, altitude above sea in m."""
    area: tuple[tuple[float, float], ...] = ()
    """Corners (latitude, longitude in degrees) of the first Survey's polygon; empty without one."""


class _Reader:
    """Takes values out of parsed JSON; every complaint names file, field, value and what is allowed."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def wrong(self, field: str, value: object, allowed: str) -> PlanError:
        shown = json.dumps(value)
        shown = shown if len(shown) <= 60 else shown[:57] + "..."
        return PlanError(f"{self.path}: {field}: {shown}; allowed: {allowed}")

    def get(self, data: dict[str, Any], field: str, name: str, kind: type, allowed: str) -> Any:
        if name not in data:
            raise PlanError(f"{self.path}: {field}.{name}: missing; allowed: {allowed}".replace(": .", ": "))
        value = data[name]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise self.wrong(f"{field}.{name}".lstrip("."), value, allowed)
        return value

    def each(self, data: dict[str, Any], field: str, name: str, kind: type, allowed: str) -> list[tuple[str, Any]]:
        values = self.get(data, field, name, list, f"a list of {allowed}")
        named = [(f"{field}.{name}[{i}]".lstrip("."), value) for i, value in enumerate(values)]
        for where, value in named:
            if not isinstance(value, kind):
                raise self.wrong(where, value, allowed)
        return named

    def number(self, field: str, value: object, allowed: str, fits: Callable[[float], bool] = lambda _: True) -> float:
        """A number that travels in 32 bits."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not fits(value):
            raise self.wrong(field, value, allowed)
        if not abs(value) <= LARGEST_FLOAT:
            raise self.wrong(field, value, f"{allowed}, within ±3.4e38")
        return float(value)

    def whole(self, field: str, value: object, allowed: str, fits: Callable[[int], bool]) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not fits(value):
            raise self.wrong(field, value, allowed)
        return value

    def position(self, field: str, value: object) -> tuple[int, int]:
        """[latitude, longitude, ...] as 1e-7 deg."""
        if not isinstance(value, list) or len(value) < 2:
            raise self.wrong(field, value, "[latitude, longitude]")
        lat = self.number(f"{field}[0]", value[0], "a latitude, -90 to 90", lambda x: abs(x) <= 90.0)
        lon = self.number(f"{field}[1]", value[1], "a longitude, -180 to 180", lambda x: abs(x) <= 180.0)
        return round(lat * 1e7), round(lon * 1e7)


def read_plan(path: Path) -> FlightPlan:
    """Reads a plan file. Raises PlanError for what it can't use, and for a file that can't be read."""
    try:
        return _read(path)
    except RecursionError:
        raise PlanError(f"{path}: nested too deeply; allowed: a plan as QGroundControl saves it") from None


def _read(path: Path) -> FlightPlan:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlanError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise PlanError(f"{path}: not JSON: {error}") from error
    if not isinstance(data, dict):
        raise PlanError(f"{path}: not a plan; allowed: a JSON object as QGroundControl saves it")
    reader = _Reader(path)
    if data.get("fileType") != "Plan":
        raise reader.wrong("fileType", data.get("fileType"), '"Plan"')
    reader.whole("version", data.get("version"), "1", lambda x: x == 1)
    mission = reader.get(data, "", "mission", dict, "an object")
    home = reader.get(mission, "mission", "plannedHomePosition", list, "[latitude, longitude, altitude]")
    reader.position("mission.plannedHomePosition", home)
    if len(home) != 3:
        raise reader.wrong("mission.plannedHomePosition", home, "[latitude, longitude, altitude]")
    altitude = reader.number("mission.plannedHomePosition[2]", home[2], "an altitude in m")
    plan = FlightPlan(
        _mission(reader, mission),
        _fence(reader, data.get("geoFence", {"polygons": [], "circles": []})),
        _rally(reader, data.get("rallyPoints", {"points": []})),
        (home[0], home[1], altitude),
        _area(reader, mission),
    )
    for field, items in (("mission", plan.mission), ("geoFence", plan.fence), ("rallyPoints", plan.rally)):
        if len(items) > MOST_ITEMS:
            raise PlanError(f"{path}: {field}: {len(items)} items to upload; allowed: at most {MOST_ITEMS}")
    return plan


def _mission(reader: _Reader, mission: dict[str, Any]) -> tuple[MissionItem, ...]:
    simple: list[tuple[str, dict[str, Any]]] = []
    for field, item in reader.each(mission, "mission", "items", dict, "objects"):
        kind = item.get("type")
        if kind == "SimpleItem":
            simple.append((field, item))
        elif kind == "ComplexItem":
            name = item.get("complexItemType")
            if name not in TRANSECT_ITEMS:
                raise reader.wrong(f"{field}.complexItemType", name, f"{', '.join(TRANSECT_ITEMS)}")
            transect = reader.get(item, field, "TransectStyleComplexItem", dict, "an object")
            simple += reader.each(transect, f"{field}.TransectStyleComplexItem", "Items", dict, "SimpleItem objects")
        else:
            raise reader.wrong(f"{field}.type", kind, "SimpleItem, ComplexItem")
    jump_ids = {
        reader.number(f"{field}.doJumpId", item["doJumpId"], "a number"): seq
        for seq, (field, item) in enumerate(simple)
        if item.get("doJumpId") is not None
    }
    return tuple(_simple_item(reader, field, item, jump_ids) for field, item in simple)


def _area(reader: _Reader, mission: dict[str, Any]) -> tuple[tuple[float, float], ...]:
    for field, item in reader.each(mission, "mission", "items", dict, "objects"):
        if item.get("complexItemType") == "survey":
            corners = reader.each(item, field, "polygon", list, "[latitude, longitude]")
            positions = [reader.position(where, corner) for where, corner in corners]
            return tuple((lat * 1e-7, lon * 1e-7) for lat, lon in positions)
    return ()


def _simple_item(reader: _Reader, field: str, item: dict[str, Any], jump_ids: dict[Any, int]) -> MissionItem:
    if item.get("type") != "SimpleItem":
        raise reader.wrong(f"{field}.type", item.get("type"), "SimpleItem")
    command = reader.whole(f"{field}.command", item.get("command"), "a MAV_CMD, 0 to 65535", lambda x: 0 <= x < 65536)
    frames = (*LOCAL_FRAMES, *GLOBAL_FRAMES)
    frame = reader.whole(
        f"{field}.frame",
        item.get("frame"),
        f"a MAV_FRAME of {', '.join(map(str, sorted(frames)))} (terrain frames are not supported)",
        lambda x: x in frames,
    )
    raw = reader.get(item, field, "params", list, "seven numbers or null")
    if len(raw) != 7:
        raise reader.wrong(f"{field}.params", raw, "seven numbers or null")
    params = [
        math.nan if _is_unset(value) else reader.number(f"{field}.params[{i}]", value, "a number or null")
        for i, value in enumerate(raw)
    ]
    if command == DO_JUMP:
        if params[0] not in jump_ids:
            raise reader.wrong(f"{field}.params[0]", raw[0], "the doJumpId of an item of this plan")
        params[0] = jump_ids[params[0]]
    if frame in GLOBAL_FRAMES and not any(map(_is_unset, raw[4:6])):
        x, y = reader.position(f"{field}.params[4:6]", raw[4:6])
    elif frame in GLOBAL_FRAMES:
        x, y = UNSET_INT, UNSET_INT
    else:
        x, y = (_whole_x(reader, f"{field}.params[{i}]", params[i]) for i in (4, 5))
    autocontinue = item.get("autoContinue", True)
    if not isinstance(autocontinue, bool):
        raise reader.wrong(f"{field}.autoContinue", autocontinue, "true, false")
    p1, p2, p3, p4, _, _, z = params
    return MissionItem(frame, command, p1, p2, p3, p4, x, y, z, int(autocontinue))


def _is_unset(value: object) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))


def _whole_x(reader: _Reader, field: str, value: float) -> int:
    """Param 5 or 6 of an item without a place on the globe."""
    if math.isnan(value):
        return UNSET_INT
    return reader.whole(field, round(value), "-2147483648 to 2147483647, or null", lambda x: -(2**31) <= x < 2**31)


def _fence(reader: _Reader, fence: object) -> tuple[MissionItem, ...]:
    if not isinstance(fence, dict):
        raise reader.wrong("geoFence", fence, "an object")
    items: list[MissionItem] = []
    for field, polygon in reader.each({"polygons": [], **fence}, "geoFence", "polygons", dict, "objects"):
        inclusion = reader.get(polygon, field, "inclusion", bool, "true, false")
        command = FENCE_POLYGON_INCLUSION if inclusion else FENCE_POLYGON_EXCLUSION
        corners = reader.each(polygon, field, "polygon", list, "[latitude, longitude]")
        if len(corners) < 3:
            raise reader.wrong(f"{field}.polygon", polygon["polygon"], "three corners or more")
        for where, corner in corners:
            x, y = reader.position(where, corner)
            items.append(MissionItem(FRAME_GLOBAL, command, float(len(corners)), x=x, y=y))
    for field, circle in reader.each({"circles": [], **fence}, "geoFence", "circles", dict, "objects"):
        inclusion = reader.get(circle, field, "inclusion", bool, "true, false")
        command = FENCE_CIRCLE_INCLUSION if inclusion else FENCE_CIRCLE_EXCLUSION
        shape = reader.get(circle, field, "circle", dict, "an object with center and radius")
        x, y = reader.position(f"{field}.circle.center", shape.get("center"))
        radius = reader.number(f"{field}.circle.radius", shape.get("radius"), "a radius in m above 0", lambda r: r > 0)
        items.append(MissionItem(FRAME_GLOBAL, command, radius, x=x, y=y))
    return tuple(items)


def _rally(reader: _Reader, rally: object) -> tuple[MissionItem, ...]:
    if not isinstance(rally, dict):
        raise reader.wrong("rallyPoints", rally, "an object")
    items = []
    for field, point in reader.each({"points": [], **rally}, "rallyPoints", "points", list, "[lat, lon, altitude]"):
        if len(point) != 3:
            raise reader.wrong(field, point, "[latitude, longitude, altitude]")
        x, y = reader.position(field, point)
        z = reader.number(f"{field}[2]", point[2], "an altitude above home in m")
        items.append(MissionItem(FRAME_GLOBAL_RELATIVE_ALT, RALLY_POINT, x=x, y=y, z=z))
    return tuple(items)


Corner = tuple[float, float]
"""Latitude and longitude in degrees."""


def transects(polygon: Sequence[Corner], spacing_m: float, angle_deg: float) -> list[tuple[Corner, Corner]]:
    """Parallel lines over a convex polygon, flown there and back, the outermost half a spacing (or less) from the edge.

    `angle_deg`: direction of the first line from north over east. The first line lies to the left of the others.
    Raises ValueError for a polygon of less than three corners or a spacing that is not above 0.
    """
    if len(polygon) < 3:
        raise ValueError(f"polygon: {len(polygon)} corners; a survey needs three or more")
    if not spacing_m > 0.0:
        raise ValueError(f"spacing_m: {spacing_m}; must be above 0")
    origin = polygon[0]
    along, across = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    corners = [to_metres(*corner, *origin) for corner in polygon]
    # u runs along the lines, v to their right
    turned = [(n * along + e * across, e * along - n * across) for n, e in corners]
    low, high = min(v for _, v in turned), max(v for _, v in turned)
    count = max(1, round((high - low) / spacing_m))
    first = (low + high - (count - 1) * spacing_m) / 2.0
    lines = []
    for i in range(count):
        v = first + i * spacing_m
        crossings = []
        for (u1, v1), (u2, v2) in zip(turned, turned[1:] + turned[:1], strict=True):
            if min(v1, v2) <= v < max(v1, v2):
                crossings.append(u1 + (v - v1) / (v2 - v1) * (u2 - u1))
        if len(crossings) < 2:
            continue
        ends = [
            from_metres(u * along - v * across, u * across + v * along, *origin)
            for u in (min(crossings), max(crossings))
        ]
        lines.append((ends[0], ends[1]) if i % 2 == 0 else (ends[1], ends[0]))
    return lines


def _simple(
    command: int, frame: int, params: list[float | None], jump_id: int, altitude_m: float | None = None
) -> dict[str, Any]:
    item: dict[str, Any] = {
        "autoContinue": True,
        "command": command,
        "doJumpId": jump_id,
        "frame": frame,
        "params": params,
        "type": "SimpleItem",
    }
    if altitude_m is not None:
        item = {"AMSLAltAboveTerrain": None, "Altitude": altitude_m, "AltitudeMode": 1, **item}
    return item


def survey_plan(
    home: tuple[float, float, float],
    polygon: Sequence[Corner],
    altitude_m: float,
    spacing_m: float,
    speed_m_s: float,
    angle_deg: float = 0.0,
    fence: Sequence[Corner] = (),
    rally: Sequence[tuple[float, float, float]] = (),
    trigger_distance_m: float = 5.0,
) -> dict[str, Any]:
    """The content of a plan: takeoff, speed, a Survey of the polygon, return to launch; fence and rally points.

    `home`: latitude, longitude, altitude above sea; `altitude_m` above home; `angle_deg` of the lines from north over
    east; `rally` altitudes above home. Raises ValueError for a survey that can't be.
    """
    lines = transects(polygon, spacing_m, angle_deg)
    points = [point for line in lines for point in line]
    takeoff = _simple(NAV_TAKEOFF, 3, [0, 0, 0, None, home[0], home[1], altitude_m], 1, altitude_m)
    speed = _simple(DO_CHANGE_SPEED, 2, [1, speed_m_s, -1, 0, 0, 0, 0], 2)
    items: list[dict[str, Any]] = []
    for i, (lat, lon) in enumerate(points):
        items.append(_simple(NAV_WAYPOINT, 3, [0, 0, 0, None, lat, lon, altitude_m], 3 + len(items)))
        if i == 0:
            trigger: list[float | None] = [trigger_distance_m, 0, 1, 0, 0, 0, 0]
            items.append(_simple(DO_SET_CAM_TRIGG_DIST, 2, trigger, 3 + len(items)))
    items.append(_simple(DO_SET_CAM_TRIGG_DIST, 2, [0, 0, 1, 0, 0, 0, 0], 3 + len(items)))
    survey = {
        "TransectStyleComplexItem": {
            "CameraCalc": {
                "AdjustedFootprintFrontal": trigger_distance_m,
                "AdjustedFootprintSide": spacing_m,
                "CameraName": "Manual (no camera specs)",
                "DistanceMode": 1,
                "DistanceToSurface": altitude_m,
                "version": 2,
            },
            "CameraShots": round(sum(distance_m(*a, *b) for a, b in lines) / trigger_distance_m),
            "CameraTriggerInTurnAround": True,
            "HoverAndCapture": False,
            "Items": items,
            "Refly90Degrees": False,
            "TurnAroundDistance": 0,
            "VisualTransectPoints": [list(point) for point in points],
            "version": 2,
        },
        "angle": angle_deg,
        "complexItemType": "survey",
        "entryLocation": 0,
        "flyAlternateTransects": False,
        "polygon": [list(corner) for corner in polygon],
        "splitConcavePolygons": False,
        "type": "ComplexItem",
        "version": 5,
    }
    back = _simple(NAV_RETURN_TO_LAUNCH, 2, [0, 0, 0, 0, 0, 0, 0], 3 + len(items))
    return {
        "fileType": "Plan",
        "geoFence": {
            "circles": [],
            "polygons": [{"inclusion": True, "polygon": [list(c) for c in fence], "version": 1}] if fence else [],
            "version": 2,
        },
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": 15,
            "firmwareType": 12,
            "globalPlanAltitudeMode": 1,
            "hoverSpeed": speed_m_s,
            "items": [takeoff, speed, survey, back],
            "plannedHomePosition": list(home),
            "vehicleType": 2,
            "version": 2,
        },
        "rallyPoints": {"points": [list(point) for point in rally], "version": 2},
        "version": 1,
    }


def write_plan(path: Path, plan: dict[str, Any]) -> None:
    """Writes a plan's content as QGroundControl does. Raises OSError whose text names the path."""
    try:
        path.write_text(json.dumps(plan, indent=4) + "\n", encoding="utf-8")
    except OSError as error:
        raise OSError(f"can't write plan {path}: {error.strerror}; choose another folder") from error
