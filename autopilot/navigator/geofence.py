"""The fence: polygons and circles, inside or outside of them, and GF_MAX_HOR_DIST and GF_MAX_VER_DIST from home.

PX4's Geofence (src/modules/navigator/geofence.cpp, v1.18) and Navigator::geofence_breach_check, with its texts. Checked
every 200 ms, by the estimator's position or, with GF_SOURCE 1, the GNSS receiver's own; nothing is predicted. Where a
breach leads to, is decided by the commander's failsafe by GF_ACTION. After one that leads to HOLD, nothing is taken
back while the vehicle holds there.
"""

from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import Plan
from sitl_emu.autopilot.topics import GeofenceResult
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import distance_m

CHECK_INTERVAL_US = 200_000
"""Navigator::geofence_breach_check, GEOFENCE_CHECK_INTERVAL_US."""
HOLD_BEGINS_US = 100_000
"""Navigator::geofence_breach_check: so long after a breach the mode may still be another than HOLD."""
ACTION_HOLD: Final = 2
SOURCE_GPS = 1
POLYGONS = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLES = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}
TEXT_WITHOUT_HOME = "Geofence invalid, doesn't contain Home position\t"
TEXT_WITHOUT_VEHICLE = "Geofence invalid, doesn't contain current vehicle position\t"


class Polygon(NamedTuple):
    """Vertices as (lat_deg, lon_deg)."""

    inclusion: bool
    vertex_count: int
    vertices: tuple[tuple[float, float], ...]
    """Those that the plan has."""

    def contains(self, lat_deg: float, lon_deg: float) -> bool:
        """Even-odd rule; what lacks a vertex contains nothing (Geofence::insidePolygon)."""
        if len(self.vertices) < self.vertex_count:
            return False
        inside = False
        lat1, lon1 = self.vertices[-1]
        for lat2, lon2 in self.vertices:
            if (lon2 > lon_deg) != (lon1 > lon_deg) and lat_deg < (lat1 - lat2) * (lon_deg - lon2) / (
                lon1 - lon2
            ) + lat2:
                inside = not inside
            lat1, lon1 = lat2, lon2
        return inside


class Circle(NamedTuple):
    """Centre and radius."""

    inclusion: bool
    lat_deg: float
    lon_deg: float
    radius_m: float

    def contains(self, lat_deg: float, lon_deg: float) -> bool:
        """Within the radius, of which only the size counts."""
        return distance_m(self.lat_deg, self.lon_deg, lat_deg, lon_deg) < abs(self.radius_m)


Area = Polygon | Circle


def areas_of(plan: Plan) -> tuple[Area, ...]:
    """Areas of a fence plan; items that belong to none are passed over.

    Behind a circle, each vertex of a polygon begins an area of its own, of as many items from there on as it counts.
    That is a flaw of PX4's, which never forgets that it has met a circle (Geofence::_updateFence, is_circle_area).
    """
    areas: list[Area] = []
    items = plan.items
    index, after_circle = 0, False
    while index < len(items):
        item, taken = items[index], 1
        if item.command in CIRCLES:
            after_circle = True
            areas.append(Circle(CIRCLES[item.command], item.lat_deg, item.lon_deg, item.param1))
        elif item.command in POLYGONS:
            count = max(int(item.param1), 1)
            vertices = tuple((corner.lat_deg, corner.lon_deg) for corner in items[index : index + count])
            areas.append(Polygon(POLYGONS[item.command], count, vertices))
            taken = 1 if after_circle else count
        index += taken
    return tuple(areas)


def inside_areas(areas: tuple[Area, ...], lat_deg: float, lon_deg: float) -> bool:
    """In each of the inclusions, and in no exclusion (Geofence::isInsidePolygonOrCircle)."""
    return all(area.contains(lat_deg, lon_deg) is area.inclusion for area in areas)


class Geofence:
    """Writes geofence_result."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._plan: Plan | None = None
        self.areas: tuple[Area, ...] = ()
        """What of it is watched."""
        self._checked_us = 0
        self._held_since_us: int | None = None
        self._held = False
        """It was held for the breach that lasts (_geofence_reposition_sent)."""

    def update(self) -> bool:
        """Compare the vehicle with the fence, at most every 200 ms; True when it is to hold here, once in a breach.

        What is broken is told whatever GF_ACTION says, and it may become HOLD in a breach that lasts.
        """
        state = self._state
        self._take_plan()
        self._forget_hold_that_was_left()
        if state.now_us - self._checked_us <= CHECK_INTERVAL_US or not state.position.valid:
            return False
        self._checked_us = state.now_us
        result = state.topics.geofence_result
        action, now_us = state.settings.gf_action, state.now_us
        triggered = self._breaches(*self.place())
        if self._held_since_us is not None:
            # Where it was broken is held, on the fence: nothing is taken back meanwhile.
            distance, altitude, custom = triggered
            triggered = (
                distance or result.max_dist_triggered,
                altitude or result.max_alt_triggered,
                custom or result.custom_fence_triggered,
            )
        is_broken = any(triggered)
        holds = is_broken and not self._held and state.armed and action == ACTION_HOLD
        if holds:
            self._held_since_us = now_us
        self._held = is_broken and (self._held or holds)
        if (*triggered, action) != result[1:5]:
            counts = (result.breach_count + 1, now_us) if is_broken and not result.breached else result[5:]
            state.topics.geofence_result = GeofenceResult(now_us, *triggered, action, *counts)
        return holds

    def forget_hold(self) -> None:
        """The pilot has chosen another place to hold at."""
        self._held_since_us = None

    def _forget_hold_that_was_left(self) -> None:
        state = self._state
        if self._held_since_us is None or state.topics.vehicle_status.nav_state is NavState.AUTO_LOITER:
            return
        if state.now_us - self._held_since_us > HOLD_BEGINS_US:
            self._held_since_us = None

    def place(self) -> tuple[float, float, float]:
        """(lat_deg, lon_deg, altitude AMSL) by GF_SOURCE."""
        state, gps = self._state, self._state.topics.sensor_gps
        if state.settings.gf_source == SOURCE_GPS:
            return gps.latitude_deg, gps.longitude_deg, gps.altitude_msl_m
        position = state.position
        return position.lat, position.lon, position.alt

    def allows(self, lat_deg: float, lon_deg: float, alt_m: float) -> bool:
        """Whether a place (altitude AMSL) is within the fence."""
        return not any(self._breaches(lat_deg, lon_deg, alt_m))

    def _take_plan(self) -> None:
        """Notice a new fence. Areas that home, or the vehicle in flight, would break at once are not watched.

        The same fence uploaded again is none: PX4 knows it by its id, and what it left out stays so (Geofence::run).
        """
        state, fence = self._state, self._state.dataman.fence
        if fence is self._plan:
            return
        is_same = self._plan is not None and fence.opaque_id == self._plan.opaque_id
        self._plan = fence
        if is_same:
            return
        home, position = state.topics.home_position, state.position
        areas = []
        for area in areas_of(self._plan):
            at_home = not home.valid or area.contains(home.lat, home.lon) is area.inclusion
            if not at_home:
                state.say(Severity.CRITICAL, TEXT_WITHOUT_HOME, "navigator_geofence_invalid_against_home")
            at_vehicle = (
                not state.settings.gf_action
                or state.landed
                or area.contains(position.lat, position.lon) is area.inclusion
            )
            if not at_vehicle:
                state.say(Severity.CRITICAL, TEXT_WITHOUT_VEHICLE, "navigator_geofence_invalid_against_cur_pos")
            if at_home and at_vehicle:
                areas.append(area)
        self.areas = tuple(areas)

    def _breaches(self, lat_deg: float, lon_deg: float, alt_m: float) -> tuple[bool, bool, bool]:
        """Whether the place breaks the largest distance from home, the largest height above it, and the areas."""
        state = self._state
        self._take_plan()
        settings, home = state.settings, state.topics.home_position
        limit_m = settings.gf_max_hor_dist_m
        too_far = home.valid and limit_m > 0.0 and distance_m(home.lat, home.lon, lat_deg, lon_deg) >= limit_m
        too_high = home.valid and 0.0 < settings.gf_max_ver_dist_m <= alt_m - home.alt
        outside = not inside_areas(self.areas, lat_deg, lon_deg)
        return too_far, too_high, outside
