"""What the disaster mission does in the air, in order: up, line by line, aside to a place and back, home.

**Scan.** Lines of `coverage.lawnmower` over the area are flown in Hold from end to end (MAV_CMD_DO_REPOSITION), at
`scan_altitude_m` above home, or above the ground (`relief.py`).

**Aside.** When a region is confirmed (`regions.py`) and has had a place for the parcel (`places.py`) for a moment, the
vehicle leaves the line, stands over the place, looks again, and asks whether region and place are still there and known
well enough. It goes down (`descent.py`), looks once more whether the place still is one, or goes on to one beside it,
as a fire's front does not wait, and lets go where the parcel will meet the ground there; it tells where that should be,
and where it then sees the parcel (`drop.py`). Then it climbs, goes back to where it left the line, and goes on.

**Together** with others (`together.py`) its lines are part of a common area, a region is served by one of all, and it
flies at its own height; the air that others need is kept clear of.

**Aborted** is a delivery for any of `aborts.Reason`; the parcel stays on board, and the scan goes on or the vehicle
goes home. The same place and region are not tried for ever (`tries.py`), nor while a wind blows that has ended the last
try; a line is not left in vain for ever either. Who is alone and still has its parcel when all lines are flown goes
over what is left, and what may be a place and was seen from aslant alone, as often as `CLOSER_TRIES`.
"""

import math
from collections.abc import Callable, Generator, Sequence

import shapely

from sitl_emu.gcs.command import gripper
from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.gcs.mission import FENCE, MissionItem
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.gcs.statustext import WARNING
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraPose
from sitl_emu.missions.companion.coverage import Line, footprint, lawnmower
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.terrain.terrain_map import Bounds
from sitl_emu.missions.disaster import aborts, beginning, places, telling, tries
from sitl_emu.missions.disaster.aborts import Aborted, Reason
from sitl_emu.missions.disaster.descent import Descent
from sitl_emu.missions.disaster.detectors import SCATTERED
from sitl_emu.missions.disaster.drop import View, find
from sitl_emu.missions.disaster.flying import STANDING_M
from sitl_emu.missions.disaster.places import Lasting, Place
from sitl_emu.missions.disaster.regions import GAP_M, Cells, Grid, Region, RegionMap
from sitl_emu.missions.disaster.relief import Relief
from sitl_emu.missions.disaster.settings import Settings
from sitl_emu.missions.disaster.together import Together
from sitl_emu.missions.disaster.travel import Travel

FRAME_GLOBAL, FENCE_POLYGON_INCLUSION = 0, 5001
ON_LINE_M = 2.0
"""How near is at a line's end; ours."""
LOOKED_S, SOON_S = 2.0, 1.0
"""So long it looks from over a place, and again from the release height."""
FALLEN_S = 4.0
"""More than a fall from 20 m takes, with some to tumble."""
CLOSER_TRIES = 4
ASIDE_M = 6.0
"""So far from a place it goes on to another without climbing: what is about is mapped, and half of the column of air
that others keep clear of (`airspace.COLUMN_M`) is left; ours."""
CHOOSE_EVERY_US = 500_000
LOOKS_FROM_M, LOOKS_WITHIN_RAD = 6.0, math.radians(45.0)
"""Frames from lower than this are not looked at, nor those of a camera that looks farther off straight down: no
autopilot leans so far by itself (PX4's MPC_TILTMAX_AIR), and who falls would tell of places where nothing is."""
WHOLE = 0.75
"""Of the scan's height: from lower the network sees less of a ruin, and more of what lies loose about it, so that edges
grew outwards on the way down, and parcels followed them (`disaster-debris`, why: 41b6f4b3). The share is ours."""
LOWEST_CLIMB_M = 1.0


class Flight:
    """The flight of one vehicle; `script` is gone through once."""

    def __init__(self, onboard: Onboard, settings: Settings) -> None:
        self.onboard, self.settings = onboard, settings
        self.regions: RegionMap | None = None
        """There from arming on, when home is known: the origin of all metres here."""
        self.together: Together | None = None
        """The others; None alone, and before home is known."""
        self.home = (0.0, 0.0, 0.0)
        self.lines: list[Line] = []
        self.looking = self.delivered = False
        self._return_m = 0.0
        """RTL_RETURN_ALT, as it was set."""
        self.scanned = 0
        """Lines that were flown to their end."""
        self.aborted: Aborted | None = None
        """Why the parcel was not delivered, the last reason."""
        self.seen: Callable[[str], dict[str, float | int]] = lambda label: {}
        """The frame that showed a label last, and its box, for an event's picture."""
        self.view: View | None = None
        """The last frame."""
        self._on_line = ""
        """Which line it flies, in words."""
        self.travel = Travel(self)
        self.descent = Descent(self, self.travel)
        self._is_low = False
        """Whether it is on its way down to a place, or there."""
        self._given_back: int | None = None
        """`Onboard.given_back` when it came to stand over a place; None: it is about none."""
        self._tried: list[Place] = []
        self._lasting = Lasting()
        self._allowed: Cells | None = None
        self._choose_us = 0

    def script(self) -> Script:
        """From the first heartbeat until it has landed."""
        onboard = self.onboard
        yield from beginning.ready(onboard, self.settings)
        system = onboard.system_id
        try:
            self._lay_lines()
        except ValueError as error:  # of an area that is another one, seen from home
            raise steps.StepFailed(str(error)) from None
        onboard.enter("uploading", f"fence; {len(self.lines)} lines to fly")
        telling.plan(onboard, self.settings, self.lines, self.place_deg)
        yield from steps.upload(onboard, self._fence(), FENCE)
        self._return_m = self.settings.scan_altitude_m
        for name in ("MIS_TAKEOFF_ALT", "RTL_RETURN_ALT"):
            yield from steps.parameter(onboard, name, self.settings.scan_altitude_m)
        if self.together is not None:
            yield from self.together.gather()
        onboard.enter("taking off", f"to {self.settings.scan_altitude_m:g} m")
        if self.together is not None:
            yield from self.together.column()
        yield from steps.command(onboard, set_mode(system, "takeoff"), "take-off mode")
        yield from steps.arm(onboard)
        onboard.yielding.expect({"takeoff", "hold"})
        yield from steps.pause(onboard, 120.0, until=lambda: onboard.telemetry.mode == "hold")
        self.looking = True
        try:
            yield from self._scan()
        except Aborted as why:
            self._abort(why)
            if self.together is not None:
                self.together.leave()
        if self._lacked_a_place and self.together is not None and self.together.leaves_some:
            self._abort(Aborted(Reason.ALONE, "what was found is left to who is not heard any more"))
        elif self._lacked_a_place:
            self._abort(Aborted(Reason.NO_PLACE, "no plain dry ground at the edge of anything that was found"))
        self.looking = False
        if self.settings.altitude == "terrain":
            yield from self.clear_return()
        onboard.enter("returning", "the whole area has been seen" if self.whole else f"{self.aborted}")
        assert self.regions is not None
        telling.regions(onboard, self.regions, self.place_deg)
        self._write_terrain()
        if self.together is not None:
            yield from self.together.over_home()
        yield from steps.return_home(onboard)
        self._write_terrain()  # again: home's ground, sounded at both ends, tells how far the height has drifted
        onboard.yielding.expect(())
        onboard.enter("landed", self.outcome)

    def _abort(self, why: Aborted) -> None:
        self.aborted = why
        telling.aborted(self.onboard, why, delivered=self.delivered)

    def _write_terrain(self) -> None:
        path = self.settings.terrain_map
        if path is None:
            return
        try:
            ground_m = self.ground.write(path, self.home)
        except OSError as error:
            self.onboard.say(f"Terrain map {path}: {error.strerror}", WARNING)
            return
        ground = self.home[0], self.home[1], self.home[2] + ground_m
        telling.terrain_map(self.onboard, path.name, self.ground.survey, ground)

    @property
    def whole(self) -> bool:
        """Whether all lines were flown."""
        return self.scanned == len(self.lines) if self.together is None else self.together.whole

    @property
    def _lacked_a_place(self) -> bool:
        """Whether there is something to deliver to, and the line was never left for it."""
        assert self.regions is not None
        return self._carries and self.aborted is None and bool(self.regions.regions())

    @property
    def _carries(self) -> bool:
        """Whether it has a parcel that somebody is still to get."""
        nothing_left = self.together is not None and self.together.nothing_left
        return self.settings.parcel is not None and not self.delivered and not nothing_left

    @property
    def outcome(self) -> str:
        """In the end: "success", or why not."""
        if self._carries and self.aborted is not None:
            return f"aborted: {self.aborted}"
        return "success" if self.whole else f"scan ended early: {self.aborted}"

    def place_deg(self, place_m: Corner) -> tuple[float, float]:
        """Latitude and longitude of a place."""
        return from_metres(*place_m, *self.home[:2])

    # Before the flight

    def _lay_lines(self) -> None:
        """Lines, fence and map of the area, as soon as home is known."""
        home = self.onboard.telemetry.home
        assert home is not None  # it was, when the autopilot was ready
        self.home = home
        settings, area = self.settings, self.settings.area_m(home[0], home[1])
        bounds = Bounds(*settings.map_m(area))
        if settings.team is None:
            seen = footprint(settings.camera, settings.scan_altitude_m)
            self.lines = lawnmower(area, seen, settings.overlap, margin_m=settings.margin_m, start_m=(0.0, 0.0))
        else:
            self.together = Together(self, self.travel, settings, settings.team)
            self.lines = self.together.lines
            self.settings = settings = settings._replace(scan_altitude_m=self.together.altitude_m)
        self._within = area.union(shapely.Point(0.0, 0.0)).convex_hull.buffer(max(settings.fence_margin_m, 0.1))
        labels, confirming = settings.perception.detector.labels, settings.perception.confirming
        whole_from_m = WHOLE * settings.scan_altitude_m
        self.regions = RegionMap(
            bounds, labels, settings.camera, confirming, settings.location, SCATTERED, whole_from_m, area
        )
        placing = settings.altitude == "terrain" or settings.location == "rays"
        heights_m = settings.scan_altitude_m, settings.release_height_m
        self.ground = Relief(bounds, settings.camera, *heights_m, placing=placing)
        self._allowed = shapely.contains_xy(self._within, self.regions.north_m, self.regions.east_m)

    def _fence(self) -> list[MissionItem]:
        """The area and home, with a margin, as the autopilot's own geofence."""
        corners = list(self._within.simplify(1.0).exterior.coords)[:-1]
        deg = [self.place_deg((north, east)) for north, east in corners]
        return [
            MissionItem(FRAME_GLOBAL, FENCE_POLYGON_INCLUSION, float(len(deg)), x=round(lat * 1e7), y=round(lon * 1e7))
            for lat, lon in deg
        ]

    # In the air

    def _scan(self) -> Script:
        if self.together is not None:
            yield from self.together.scan()
            return
        for number, line in enumerate(self.lines, 1):
            yield from self.fly_line(number, line)
        yield from self._look_closer()

    def _look_closer(self) -> Script:
        """Over what may be a place and was not seen well enough from the lines, before the parcel is taken home."""
        self._on_line = "all lines flown"
        for _ in range(CLOSER_TRIES):
            place = self._nearest([self.place_of(region, closer=True) for region in self._open()])
            if place is None:
                return
            yield from self.go_aside(place)

    def fly_line(self, number: int, line: Line) -> Script:
        """From its start to its end, by way of what is found; lines count from 1."""
        self._on_line = f"line {number} of {len(self.lines)}"
        self.onboard.enter("scanning", self._on_line)
        yield from self.travel.to(line.start_m, self.settings.scan_altitude_m, ON_LINE_M, aside=True)
        yield from self.travel.to(line.end_m, self.settings.scan_altitude_m, ON_LINE_M, aside=True)
        self.scanned += 1
        self.onboard.note("line_scanned", f"line {number} of {len(self.lines)}", line=number)

    @property
    def here_m(self) -> Corner:
        """Where the vehicle is."""
        place = self.onboard.telemetry.place
        assert place is not None  # it is ready
        return to_metres(place.lat_deg, place.lon_deg, *self.home[:2])

    @property
    def altitude_m(self) -> float:
        """Above home."""
        place = self.onboard.telemetry.place
        assert place is not None
        return place.alt_amsl_m - self.home[2]

    @property
    def over_ground_m(self) -> float:
        """Above the ground: what the lidar tells of it, over a place that is gone down to; else as it is mapped here.

        Above home where nothing is mapped.
        """
        below_m = self.descent.below_m if self._is_low else self.ground.ground_m(self.here_m)
        return self.altitude_m - below_m

    def check(self) -> None:
        """Raises Aborted for what ends it all, and StepFailed where the motors are off."""
        telemetry = self.onboard.telemetry
        if not telemetry.armed:
            raise steps.StepFailed("disarmed in the air")
        if self.together is not None:
            if self.together.homeward:
                return
            self.together.check()
        if self._given_back not in (None, self.onboard.given_back):
            raise Aborted(Reason.TAKEN, "it is given back, and may be anywhere")
        aborts.check_vehicle(
            telemetry.battery_percent, telemetry.eph_m, telemetry.has_fix, telemetry.gps_glitches, telemetry.compass_ok
        )

    def clear_return(self) -> Script:
        """Lifts the autopilot's Return, and so its failsafes', over all that is mapped."""
        wanted_m = float(math.ceil(self.ground.clear_m()))
        if wanted_m > self._return_m:
            yield from steps.parameter(self.onboard, "RTL_RETURN_ALT", wanted_m)
            self._return_m = wanted_m

    def until_clear(self, to_m: Corner) -> Generator[None, None, bool]:
        """Stands aside while another aircraft's air is in the way to a place; whether it was. Raises Aborted."""
        return False if self.together is None else (yield from self.together.until_clear(to_m))

    # Aside

    def look(self, pose: CameraPose, boxes: Sequence[Detection], ground_m: Grid | float) -> None:
        """A frame of the scan, and the heights of the map's cells; nothing is decided by single ones here."""

    def due(self) -> Place | None:
        """The place that is to be served now."""
        onboard = self.onboard
        if self.together is not None:
            return self.together.due()
        if onboard.now_us < self._choose_us or len(self._tried) >= tries.LEAVES:
            return None
        self._choose_us = onboard.now_us + CHOOSE_EVERY_US
        return self._nearest([self.place_of(region) for region in self._open()])

    def _open(self) -> list[Region]:
        """The regions that a parcel is for, while one is on board."""
        assert self.regions is not None
        return [region for region in self.regions.regions() if self._may_try(region)] if self._carries else []

    def _nearest(self, found: Sequence[Place | None]) -> Place | None:
        """Of places that were not tried too often."""
        left = [place for place in found if place is not None and self.may_try_at(place)]
        return min(left, key=lambda place: math.dist(place.place_m, self.here_m), default=None)

    def place_of(self, region: Region, *, closer: bool = False) -> Place | None:
        """The place for a region, from here; None where there is none for long enough, or it was tried too often.

        `closer`: what may be one, and was not seen well enough.
        """
        place = self.choose(region, self.here_m, closer=closer) if self._may_try(region) else None
        if place is None or not self.may_try_at(place):
            return None
        return place if closer or self._lasting.lasts(self.onboard.now_us, place) else None

    def choose(
        self, region: Region, near_m: Corner, allowed: Cells | None = None, *, closer: bool = False
    ) -> Place | None:
        """The place for a region; None where there is none (yet). See `places.choose`."""
        assert self.regions is not None
        return places.choose(self.regions, region, near_m, allowed, self.ground.stands, closer=closer)

    def may_try_at(self, place: Place) -> bool:
        """Whether a place was not tried too often."""
        return tries.is_left_at(self._tried, place)

    def _may_try(self, region: Region) -> bool:
        """Whether a region was not tried too often, and the wind that ended the last try, if one did, has dropped."""
        assert self.regions is not None
        was_windy = self.aborted is not None and self.aborted.reason is Reason.WIND
        if was_windy and not aborts.has_dropped(self.onboard.telemetry.wind_m_s):
            return False
        return tries.is_left(self._tried, self.regions, region)

    def go_aside(self, place: Place, left_m: Corner | None = None) -> Script:
        """To a place, with the parcel, and back to where it left its line; None: up again."""
        onboard = self.onboard
        self._tried.append(place)
        number, sigma_m = len(self._tried), self.settings.ground_sigma_m
        # who goes for a closer look is far from what it goes to: the last frame with such an area shows another
        seen = self.seen(place.label) if left_m is not None else {}
        telling.target(onboard, place, number, self.over_ground_m, sigma_m, self.place_deg, seen)
        onboard.enter("engaging", f"{place.label}, {math.dist(self.here_m, place.place_m):.0f} m away")
        try:
            place = yield from self._over(place)
            if self.together is not None:
                yield from self.together.column(place.place_m)
            self._is_low = True
            yield from self._deliver(place)
        except Aborted as why:
            if self.together is not None:
                self.together.give_up()
            if not why.reason.of_the_place:
                raise
            self._abort(why)
        finally:
            self._is_low, self._given_back = False, None
        onboard.enter("resuming", "back to where the line was left" if left_m is not None else "up again")
        up_m = self._standing_m(self.here_m)
        if self.altitude_m < up_m - LOWEST_CLIMB_M:
            yield from self.travel.to(self.here_m, up_m, ON_LINE_M)
        if left_m is not None:
            yield from self.travel.to(left_m, self.ground.held_m, ON_LINE_M)
        onboard.enter("scanning", self._on_line)

    def _standing_m(self, place_m: Corner) -> float:
        """The height above home from which a place is looked at."""
        follows = self.settings.altitude == "terrain"
        return self.ground.standing_m(place_m) if follows else self.settings.scan_altitude_m

    def _over(self, place: Place) -> Generator[None, None, Place]:
        """Stands over a place and looks; the place as it is then. Raises Aborted where it is another each time."""
        for _ in range(tries.TRIES + 1):
            yield from self.travel.to(place.place_m, self._standing_m(place.place_m), STANDING_M)
            self._given_back = self.onboard.given_back
            yield from steps.pause(self.onboard, LOOKED_S)
            self.check()
            again = self._again(place)
            if math.dist(again.place_m, place.place_m) <= STANDING_M:
                return again
            place = again
        raise Aborted(Reason.NO_PLACE, f"each time it stood over one, there was a better at the edge of {place.label}")

    def _again(self, place: Place) -> Place:
        """A place after more looks. Raises Aborted where it is none any more, or not known well enough."""
        assert self.regions is not None
        regions = self.regions
        of = [region for region in regions.regions() if tries.is_of(place, regions, region, 2.0 * GAP_M)]
        if not of:
            raise Aborted(Reason.NOT_PERSISTING, f"{place.label} is not there from above")
        nearest = min(of, key=lambda region: tries.away_m(place, regions, region))
        free = self.choose(nearest, place.place_m)
        again = self.choose(nearest, place.place_m, self._allowed)
        if again is None:
            again = places.kept(regions, nearest, place, self._allowed, self.ground.stands)
        if again is None:
            if free is not None:
                raise Aborted(Reason.GEOFENCE, "the place lies beyond the fence")
            raise Aborted(Reason.NO_PLACE, f"no plain ground at the edge of {place.label}")
        aborts.check_location(places.sigma_m(again, self.over_ground_m, self.settings.ground_sigma_m))
        return again

    def _deliver(self, place: Place) -> Script:
        """Down, and lets the parcel go over a place."""
        onboard = self.onboard
        onboard.enter("delivering", place.where)
        place = yield from self._down(place)
        yield from self.descent.aim(place.place_m, self._is_sure)
        before = self.view
        telling.releases(onboard, place, self.here_m, self.over_ground_m, self.place_deg)
        yield from steps.command(onboard, gripper(onboard.system_id, open_it=True), "gripper", self._let_go)
        onboard.say(f"Parcel let go {place.where}")
        yield from steps.pause(onboard, FALLEN_S)
        self._see_it_lie(place.place_m, before)

    def _let_go(self) -> None:
        """The parcel is taken for gone, even if no answer tells: else another might be let go at the same place."""
        self.delivered = True
        if self.together is not None:
            self.together.served()

    def _is_sure(self) -> bool:
        """Whether the place is ours to serve."""
        return self.together is None or self.together.settled

    def _see_it_lie(self, place_m: Corner, before: View | None) -> None:
        """Tells where the parcel lies, by the frame before it was let go and the last one."""
        after = self.view
        if before is None or after is None or after.time_us == before.time_us:
            lies_m = None
        else:
            lies_m = find(before, after, self.settings.camera, place_m, -self.descent.below_m)
        telling.lies(self.onboard, lies_m, place_m, self.place_deg)

    def _down(self, place: Place) -> Generator[None, None, Place]:
        """Down over a place; it, or one beside it where it is none from low. Raises Aborted where there is none."""
        assert self.regions is not None
        first = place
        for _ in range(tries.TRIES + 1):
            yield from self.descent.down(place.place_m)
            yield from steps.pause(self.onboard, SOON_S)
            other = self._see_once_more(place)
            if other is None:
                return place
            clear = places.is_way_clear(self.regions, place.place_m, other.place_m, self.ground.stands)
            if not clear or math.dist(other.place_m, first.place_m) > ASIDE_M:
                break
            telling.goes_on(self.onboard, other, place)
            place = other
        raise Aborted(Reason.NO_PLACE, f"no plain dry ground, seen from low, at the edge of {first.label}")

    def _see_once_more(self, place: Place) -> Place | None:
        """From low: None where the place still is one, else the one to take instead. Raises Aborted."""
        assert self.regions is not None
        again = self._again(place)
        of = [region for region in self.regions.regions() if region.label == place.label]
        is_beside = any(places.is_beside(self.regions, region, place.place_m) for region in of)
        if is_beside and places.is_free(self.regions, place.place_m, self.ground.stands):
            return None
        return again
