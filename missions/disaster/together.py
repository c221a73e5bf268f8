"""Several aircraft in one disaster: the use of `companion/swarm` by one of them. Nobody leads.

**Before take-off** it waits until all others were heard, who may be switched on later, and on the ground as long as it
hears less than half of them: in the air it would come home at once.

**Lines**: all lay the same lines over the area, from its first corner on, and divide them (`division.py`). Who has
flown its own waits over the last of them until all are flown: the lines of who falls silent are its then.

**Heights**: each flies at its own layer, the first `scan_altitude_m` above `datum_amsl_m`, the next `airspace.LAYER_M`
higher. Take-off, delivery and landing go through the layers of others, in a column of air that all others have said to
keep clear of; who meets one on its way stops before it. Who is away from its layer without such a column, as a failsafe
brings it down, says that it has it.

**Targets** are regions: each tells its own, with how far they reach and where it would serve them at their edge, and
bids for the nearest of them that is nobody's yet; once it has no line left, also for what only those see who are lost
or have delivered. Whose a region is serves it; it breaks off with `Reason.PEER` when the region turns out to be
another's, and lets go only while it hears most of the others. When all lines are flown, it bids as well for what may
have a place and was not seen well enough from the lines.

What is one region is told by cells of 4 m, so two regions less than 8 m apart may be served as one. A place at the edge
of another's region is looked at from above before anything is done there, as any place.
"""

import math
from collections.abc import Collection, Generator, Mapping
from typing import TYPE_CHECKING

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.gcs.statustext import WARNING
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.companion import PEER_LINK, Outgoing
from sitl_emu.missions.companion.coverage import Line, footprint, lawnmower, ordered, swept
from sitl_emu.missions.companion.onboard import Script
from sitl_emu.missions.companion.steps import Motion
from sitl_emu.missions.companion.swarm.airspace import SLOWING_M_S2, Ruling, layer_m, stopping_m
from sitl_emu.missions.companion.swarm.extents import CELL_M, Cell, cell_of, cells_in
from sitl_emu.missions.companion.swarm.records import Column, Doing, Key, Sighting, Stage, State
from sitl_emu.missions.companion.swarm.swarm import Swarm
from sitl_emu.missions.companion.swarm.targets import Target
from sitl_emu.missions.disaster import places
from sitl_emu.missions.disaster.aborts import Aborted, Reason
from sitl_emu.missions.disaster.flying import STANDING_M, Flying
from sitl_emu.missions.disaster.places import Place
from sitl_emu.missions.disaster.regions import Region
from sitl_emu.missions.disaster.settings import Settings, Team
from sitl_emu.missions.disaster.travel import Travel

if TYPE_CHECKING:
    from sitl_emu.core import dialect as mavlink

MOVED_M, STEADY_M_S = 1.0, 0.1
"""What makes a new place of an old one, and what stands; ours."""
OFF_LAYER_M = 3.0
"""As much as `airspace.LAYER_M` leaves to the heights' errors."""
LOOK_EVERY_US = 500_000
SESSIONS = 1 << 15
"""Sightings count from another number after each start of a companion: what it told before is not revised by what it
sees now. Half of the numbers of a `records.Key`, so that none comes round; ours."""
DOING = {
    "scanning": Doing.SCANNING,
    "resuming": Doing.SCANNING,
    "waiting": Doing.SCANNING,
    "engaging": Doing.ENGAGING,
    "delivering": Doing.DELIVERING,
    "returning": Doing.RETURNING,
    "failed": Doing.OUT,
    "landed": Doing.OUT,
}


class Together:
    """What one aircraft knows of the others, and does about them. There from arming on, when home is known."""

    def __init__(self, flight: Flying, travel: Travel, settings: Settings, team: Team) -> None:
        """`settings`: with the lowest layer's altitude. Raises CoverageError as `coverage.lawnmower` does."""
        self._flight, self._travel, self._onboard = flight, travel, flight.onboard
        self.origin = settings.middle_deg
        """Of what is told in metres: alike for all, whose homes differ."""
        north_m, east_m = to_metres(*flight.home[:2], *self.origin)
        self._offset_m = north_m, east_m
        area = settings.area_m(*self.origin)
        seen = footprint(settings.camera, settings.scan_altitude_m)
        start_m = area.exterior.coords[0]
        lines = lawnmower(area, seen, settings.overlap, margin_m=settings.margin_m, start_m=start_m)
        self.lines = [Line(self._from_common(line.start_m), self._from_common(line.end_m)) for line in lines]
        system, members = self._onboard.system_id, team.members
        self._gathers_until_us = self._onboard.now_us + round(team.gather_timeout_s * 1e6)
        self.altitude_m = layer_m(settings.scan_altitude_m, members, system) + team.datum_amsl_m - flight.home[2]
        """Of our layer, above home."""
        self.swarm = Swarm(
            self._onboard.now_us, team.key, system, members, flight.home[:2], lines,
            swaths=[cells_in(swept(line, seen)) for line in lines],
        )  # fmt: skip
        self._first = team.key.session % SESSIONS
        self._labels = settings.perception.known
        self._seen = list[tuple[set[Cell], Sighting]]()
        """Our own sightings from number `_first` on: their cells, and as told last."""
        self._costs = dict[Key, float]()
        self._places = dict[Key, Place]()
        self._look_us = 0
        self._out = self._engaged = self._off_layer = self.homeward = False
        self._motion = Motion()
        self._onboard.say(team.key.said)

    @property
    def counts(self) -> Mapping[str, int]:
        """What was taken and refused of others' broadcasts, and what these tell of that our detector does not know."""
        sharing = self.swarm.sharing
        told = [sharing.sighting(key) for target in sharing.targets() for key in target.keys]
        unknown = sum(one.label >= len(self._labels) for one in told)
        return {**self.swarm.counts, **({"sightings of unknown labels": unknown} if unknown else {})}

    # Messages and time

    def on_message(self, now_us: int, msg: "mavlink.MAVLink_message") -> None:
        """A message of the peer link."""
        self.swarm.on_message(now_us, self._onboard.telemetry.unix_us(now_us), msg)

    def on_time(self, now_us: int, *, over: bool) -> Outgoing:
        """Goes on with what is shared; what to broadcast.

        `over`: our mission is. Who moves no more then, armed or not, has fallen and lies: it needs no column.
        """
        telemetry, airspace = self._onboard.telemetry, self.swarm.airspace
        place = telemetry.place
        if place is None:
            return []
        lies = self._motion.is_stuck(now_us, (*self._flight.here_m, self._flight.altitude_m)) and over
        flies = telemetry.armed and not lies
        if flies and abs(self._flight.altitude_m - self.altitude_m) > OFF_LAYER_M:
            airspace.column, self._off_layer = Column.TAKEN, True
        elif self._off_layer:
            airspace.free()
            self._off_layer = False
        doing = DOING.get(self._onboard.phase, Doing.WAITING)
        if self._out or self._onboard.yielding.yielded_to is not None:
            doing = Doing.OUT
        velocity = place.v_north, place.v_east, place.v_down
        own = State(doing, place.lat_deg, place.lon_deg, place.alt_amsl_m, *velocity)
        said = self.swarm.on_time(now_us, telemetry.unix_us(now_us), own, parked=not flies)
        return [(PEER_LINK, msg) for msg in said]

    # Lines

    def scan(self) -> Script:
        """Flies the lines that are ours, and waits for what may fall to us: lines of who is lost, or a target."""
        flight = self._flight
        while True:
            mine = self._next_line()
            if mine is not None:
                number, line = mine
                yield from flight.fly_line(number + 1, line)
                self.swarm.sharing.scanned(number)
                continue
            self._look()
            if not self._waits:
                return
            yield from self._stand_by()

    def over_home(self) -> Script:
        """To where it may come down: over home, when the air there is ours."""
        flight, self.homeward = self._flight, True
        if abs(flight.altitude_m - self.altitude_m) > STANDING_M:
            yield from self._travel.to(flight.here_m, self.altitude_m, STANDING_M)
        yield from self._travel.to((0.0, 0.0), self.altitude_m, STANDING_M)
        yield from self.column((0.0, 0.0))

    def _stand_by(self) -> Script:
        """Where it is, until there is something to do."""
        flight = self._flight
        stand_m = flight.here_m
        self._onboard.enter("waiting", "for what the others do not do")
        while self._waits and self._next_line() is None:
            flight.check()
            place = self.due()
            if place is not None:
                yield from flight.go_aside(place, stand_m)
                self._onboard.enter("waiting", "for what the others do not do")
            elif (yield from self.until_clear(stand_m)):
                yield from self._travel.to(stand_m, self.altitude_m, STANDING_M)
            yield

    def _next_line(self) -> tuple[int, Line] | None:
        """The number and the line to be flown next, from its nearer end; None while none is left to us."""
        ours = self.swarm.sharing.scan(self._onboard.now_us)
        if not ours:
            return None
        first = ordered([self.lines[number] for number in ours], self._flight.here_m)[0]
        number = next(number for number in ours if self.lines[number] in (first, first.turned()))
        return number, first

    @property
    def whole(self) -> bool:
        """Whether all lines have been flown, by whomever."""
        return all(self.swarm.sharing.is_scanned(number) for number in range(len(self.lines)))

    @property
    def nothing_left(self) -> bool:
        """Whether all lines are flown, somebody has delivered, and nothing is known that we could serve as well."""
        now_us, sharing = self._onboard.now_us, self.swarm.sharing
        served = any(sharing.claim(now_us, target).stage == Stage.SERVED for target in sharing.targets())
        return self.whole and served and not self._costs

    @property
    def _waits(self) -> bool:
        """Whether there may still be something to do: lines of others, or targets that are not settled."""
        if not self.whole:
            return True
        now_us, sharing = self._onboard.now_us, self.swarm.sharing
        ours = (target for target in sharing.targets() if not sharing.beyond(target))
        stages = [(target, sharing.claim(now_us, target).stage) for target in ours]
        theirs = (stage == Stage.FREE and self._can_serve(target) for target, stage in stages)
        unsettled = any(stage in (Stage.BID, Stage.ENGAGED) for _, stage in stages) or any(theirs)
        return self._carries and (unsettled or bool(self._costs))

    # Before take-off

    def gather(self) -> Script:
        """On the ground, until all others were heard; after `gather_timeout_s` without those who were not.

        Who hears less than half of the others stays.
        """
        onboard, sharing, told = self._onboard, self.swarm.sharing, ""
        while sharing.alone or (sharing.missing and onboard.now_us < self._gathers_until_us):
            waits_for = _systems(sharing.missing) if sharing.missing else "half of the others"
            if waits_for != told:
                told = waits_for
                onboard.enter("waiting for peers", f"not heard: {waits_for}")
            yield
        if sharing.missing:
            onboard.say(f"Goes on without {_systems(sharing.missing)}, not heard yet", WARNING)

    # Others' air

    def column(self, stand_m: Corner | None = None) -> Script:
        """Until the column of air here is ours. `stand_m`: over which place; None: on the ground. Raises Aborted."""
        flight, airspace = self._flight, self.swarm.airspace
        while True:
            stands = stand_m is None or math.dist(flight.here_m, stand_m) <= STANDING_M
            if stands and airspace.column == Column.TAKEN:
                return
            if stand_m is not None:
                flight.check()
            if stand_m is None and self.swarm.sharing.alone:
                airspace.free()
                yield from self.gather()
                self._onboard.enter("taking off", "the others are heard again")
            elif stand_m is not None and (not stands or self._rule((0.0, 0.0)).aside is not None):
                airspace.free()
                yield from self.until_clear(stand_m)
                yield from self._travel.to(stand_m, self.altitude_m, STANDING_M / 2.0)
            airspace.ask()
            yield

    def until_clear(self, to_m: Corner) -> Generator[None, None, bool]:
        """Stands, or goes aside, while another's column is in the way to a place; whether one was. Raises Aborted."""
        flight, ruling, sent_m = self._flight, self._rule(self._wish(to_m)), None
        if ruling.go:
            return False
        while not ruling.go:
            flight.check()
            if sent_m is None or (ruling.aside is not None and math.dist(ruling.aside, sent_m) > MOVED_M):
                sent_m = ruling.aside if ruling.aside is not None else self._stop_m()
                yield from self._travel.send(sent_m, self.altitude_m)
            yield
            ruling = self._rule(self._wish(to_m))
        return True

    def _rule(self, velocity: Corner) -> Ruling:
        return self.swarm.airspace.rule(self._onboard.now_us, self._flight.here_m, velocity)

    def _wish(self, to_m: Corner) -> Corner:
        """The velocity with which we would go to a place: no slower than we are, as fast as we can stop from there."""
        here_m = self._flight.here_m
        away_m = math.dist(here_m, to_m)
        if away_m <= STANDING_M:
            return 0.0, 0.0
        fastest = min(self._flight.settings.scan_speed_m_s, math.sqrt(2.0 * SLOWING_M_S2 * away_m))
        speed = max(fastest, self._onboard.telemetry.speed_m_s)
        return (to_m[0] - here_m[0]) / away_m * speed, (to_m[1] - here_m[1]) / away_m * speed

    def _stop_m(self) -> Corner:
        """Where we come to stand when we stop now."""
        here_m, place = self._flight.here_m, self._onboard.telemetry.place
        assert place is not None
        speed = math.hypot(place.v_north, place.v_east)
        seconds = stopping_m(speed) / speed if speed > STEADY_M_S else 0.0
        return here_m[0] + place.v_north * seconds, here_m[1] + place.v_east * seconds

    # Targets

    def due(self) -> Place | None:
        """The place that is ours to serve now, at which we are engaged then; tells of the regions that we see."""
        now_us, sharing = self._onboard.now_us, self.swarm.sharing
        if now_us >= self._look_us:
            self._look_us = now_us + LOOK_EVERY_US
            self._look()
        target = sharing.want(now_us, self._costs) if self._carries else None
        if target is None:
            return None
        place = next((self._places[key] for key in target.keys if key in self._places), None)
        if place is None:  # it is none for us any more
            sharing.give_up(now_us)
        self._engaged = place is not None
        return place

    def served(self) -> None:
        """The parcel has been let go there."""
        self._engaged = False
        self.swarm.sharing.serve(self._onboard.now_us)

    def give_up(self) -> None:
        """We do not serve it, if we have not; nor do we need the air over it, unless we are down in it."""
        self._engaged = False
        if not self._off_layer:
            self.swarm.airspace.free()
        self.swarm.sharing.give_up(self._onboard.now_us)

    def leave(self) -> None:
        """We take no more part: what is ours is the others'."""
        self._out = True
        self.give_up()

    def check(self) -> None:
        """Raises Aborted where the target that we are about is another's, and where nobody is heard any more."""
        sharing = self.swarm.sharing
        if sharing.alone:
            raise Aborted(Reason.ALONE, "less than half of the others are heard")
        if self._engaged and sharing.serving(self._onboard.now_us) is None:
            raise Aborted(Reason.PEER, "another aircraft serves the same area, has, or may")

    @property
    def leaves_some(self) -> bool:
        """Whether a target is left to those of whom we have lost touch."""
        return any(map(self.swarm.sharing.beyond, self.swarm.sharing.targets()))

    @property
    def settled(self) -> bool:
        """Whether the target is ours, and most of the others would have told us if it were not."""
        now_us, sharing = self._onboard.now_us, self.swarm.sharing
        return sharing.in_touch(now_us) and sharing.serving(now_us) is not None

    @property
    def _carries(self) -> bool:
        return self._flight.settings.parcel is not None and not self._flight.delivered

    def _look(self) -> None:
        """Tells of the regions that we see, and reckons what it would cost us to serve which target."""
        flight = self._flight
        assert flight.regions is not None
        ours = dict[Key, Place]()
        for region in flight.regions.regions():
            place = flight.place_of(region, closer=self.whole)
            key = self._tell(region, place)
            if place is not None:
                ours[key] = min((place, ours.get(key, place)), key=self._cost_s)
        self._withdraw(ours)
        self._places, scans = {}, self._next_line() is not None
        for target in self.swarm.sharing.targets():
            if self.swarm.sharing.beyond(target):
                continue
            found = [ours[key] for key in target.keys if key in ours]
            found = found if found or scans else self._of_others(target)
            if found and self.swarm.sharing.claim(self._onboard.now_us, target).stage != Stage.SERVED:
                self._places |= dict.fromkeys(target.keys, min(found, key=self._cost_s))
        targets = self.swarm.sharing.targets()
        self._costs = {one.key: self._cost_s(self._places[one.key]) for one in targets if one.key in self._places}

    def _cost_s(self, place: Place) -> float:
        return math.dist(self._flight.here_m, place.place_m) / self._flight.settings.scan_speed_m_s

    def _of_others(self, target: Target) -> list[Place]:
        """Places that others have told of a target, none of whom can serve it, if we have not tried them too often."""
        found = list[Place]()
        for one in self._told(target) if not self._can_serve(target) else ():
            edge_m = to_metres(one.lat_deg, one.lon_deg, *self._flight.home[:2])
            place = Place(self._labels[one.label], one.confidence, edge_m, edge_m, 0.0, 0.0)
            if self._flight.may_try_at(place):
                found.append(place)
        return found

    def _told(self, target: Target) -> list[Sighting]:
        """Sightings of a target with a place at which somebody would serve it, of what our detector knows."""
        told = map(self.swarm.sharing.sighting, target.keys)
        return [one for one in told if one.confidence > 0.0 and one.label < len(self._labels)]

    def _can_serve(self, target: Target) -> bool:
        """Whether somebody has sighted it who is there and has a parcel."""
        now_us, sharing = self._onboard.now_us, self.swarm.sharing
        claims = [sharing.claim(now_us, each) for each in sharing.targets()]
        able = sharing.there(now_us) - {claim.owner for claim in claims if claim.stage == Stage.SERVED}
        return any(one.key[0] in able and not self._is_of_before(one.key) for one in self._told(target))

    def _is_of_before(self, key: Key) -> bool:
        """Whether it is ours, told before this companion was started, which knows no more of it than others do."""
        return key[0] == self.swarm.system and not 0 <= key[1] - self._first < len(self._seen)

    def _tell(self, region: Region, place: Place | None) -> Key:
        """Tells of a region, where there is something new; the key of our sighting of it."""
        cells = self._cells(region)
        label = self._labels.index(region.label)
        known_as = (
            n for n, (known, one) in enumerate(self._seen) if one.label == label and not cells.isdisjoint(known)
        )
        number = next(known_as, len(self._seen))
        key = self._key(number)
        told = self._sighting(key, region, place)
        if number == len(self._seen):
            self._seen.append((set(), told._replace(confidence=math.nan)))
        known, last = self._seen[number]
        moved_m = math.dist(*(to_metres(one.lat_deg, one.lon_deg, *self.origin) for one in (told, last)))
        if not cells <= known or (told.confidence > 0.0) != (last.confidence > 0.0) or moved_m > 2.0 * MOVED_M:
            self._seen[number] = known | cells, told
            self.swarm.sharing.see(key[1], told, known | cells)
        return key

    def _withdraw(self, places_of: Mapping[Key, Place]) -> None:
        """Tells of what we told before that it is no region any more, or none that we would try."""
        for number, (cells, last) in enumerate(self._seen):
            key = self._key(number)
            if key not in places_of and last.confidence > 0.0:
                self._seen[number] = cells, last._replace(confidence=0.0)
                self.swarm.sharing.see(key[1], self._seen[number][1])

    def _key(self, number: int) -> Key:
        """Of a sighting of `_seen`."""
        return self.swarm.system, self._first + number

    def _sighting(self, key: Key, region: Region, place: Place | None) -> Sighting:
        """Confidence 0: no place for a parcel is known there."""
        flight, sigma_m = self._flight, 2.0 * CELL_M
        if place is not None:
            eph_m = self._onboard.telemetry.eph_m or 0.0
            sigma_m = places.sigma_m(place, flight.over_ground_m, flight.settings.ground_sigma_m, eph_m) / math.sqrt(
                2.0
            )
        at_deg = flight.place_deg(place.edge_m if place is not None else region.middle_m)
        confidence = region.score if place is not None else 0.0
        label = self._labels.index(region.label)
        return Sighting(key, 0, label, confidence, *at_deg, flight.home[2], sigma_m, sigma_m, 0.0)

    def _cells(self, region: Region) -> set[Cell]:
        """The swarm's cells that a region has something of."""
        regions = self._flight.regions
        assert regions is not None
        north_m = regions.north_m[region.cells] + self._offset_m[0]
        east_m = regions.east_m[region.cells] + self._offset_m[1]
        return {cell_of(north, east) for north, east in zip(north_m.tolist(), east_m.tolist(), strict=True)}

    def _from_common(self, place_m: Corner) -> Corner:
        """From metres of the swarm's origin to metres of our home."""
        return place_m[0] - self._offset_m[0], place_m[1] - self._offset_m[1]


def _systems(systems: Collection[int]) -> str:
    return f"system{'s' if len(systems) > 1 else ''} {', '.join(map(str, sorted(systems)))}"
