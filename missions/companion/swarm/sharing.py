"""Work shared among aircraft: who is there, whose are which lines, targets and claims, and what to tell of it.

A state machine on the times of messages, the same on every aircraft: hand it what peers have said and the time, and
send what `say` returns. Each broadcast holds the sender's state, and in turn all else that it knows: what is new first,
claims that are being settled more often. So what one has missed comes again, from whomever.

**Who is there**: a member that was silent for `LOST_AFTER_US`, to us and to those whom we hear, or says that it is out,
is lost: its lines and claims go to the others. An aircraft that has heard less than half of its group for
`ALONE_AFTER_US` has lost its own radio, as far as it can tell; as the others are about to take its work over, it shares
no more of it (`alone`), and should go home. Of a pair, or of two halves, neither can tell: both go on, and each scans
all, but serves on its own side alone: nothing that reaches, or may reach, to where lines of the others see (`beyond`).
So what lies there is left to those who may be dead; without `swaths` sides are unknown, and what both see may be served
twice. A lost member that comes back takes part again.

**Areas**: where `swaths` say which cells of the ground each line sees, all that is sighted is an area, told by its
extent. While it may yet turn out to be one with another that somebody has claimed (`extents.py`), nobody begins to
serve it, and of two who have begun the lower claim gives way.

Where something is in between, two may hear each other through a third alone. Their claims then stand for `RELAYED_US`
before they count, and two may own a target until the third has told them; longer ways round are not looked for.

**Once**: what can't be taken back, a delivery, is done `in_touch` alone. While all hear each other, no target ever has
two owners. What remains: who falls silent within a second of its delivery, before anybody has heard of it, is not
believed to have delivered, and the target is served again.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from sitl_emu.missions.companion.coverage import Line
from sitl_emu.missions.companion.swarm import extents
from sitl_emu.missions.companion.swarm.claims import Claims
from sitl_emu.missions.companion.swarm.division import shares
from sitl_emu.missions.companion.swarm.records import (
    LINES_OF_A_RECORD,
    Claim,
    Covered,
    Doing,
    Key,
    Record,
    Sighting,
    Stage,
    State,
    Tile,
    as_sent,
    filled,
)
from sitl_emu.missions.companion.swarm.targets import Target, merged

UNSETTLED = (Stage.BID, Stage.ENGAGED)
SAY_EVERY_US = 250_000
"""Four broadcasts a second of at most 145 bytes (TUNNEL in MAVLink 2): 5 kbit/s an aircraft. Ours."""
SOONER_US = 2_000_000
"""Claims that are being settled are told as if they had been told so much longer ago."""
LOST_AFTER_US = 10_000_000
"""40 broadcasts: with 30 % loss chance makes that silence once in 10^21."""
ALONE_AFTER_US = 8_000_000
"""Sooner than others take us for lost."""
RELAYED_US = 3_000_000
"""In which a third passes a claim on with 30 % loss both times."""
IN_TOUCH_US = 1_000_000
"""Four broadcasts: with 30 % loss as many are missed in a row once in 120, and then it is a second later."""
GROUP_AFTER_US = 15_000_000
"""Later than that, so that a radio that fails is not taken for the others dying one by one."""


class Reach(NamedTuple):
    """How far a target reaches."""

    cells: set[extents.Cell]
    within: set[extents.Cell]
    """Where it may turn out to reach, too: through ground that nobody has scanned."""


class Sharing:
    """What one aircraft knows of the common work."""

    def __init__(
        self,
        now_us: int,
        system: int,
        members: Collection[int],
        lines: Sequence[Line] = (),
        *,
        swaths: Sequence[Collection[extents.Cell]] = (),
    ) -> None:
        """`members`: the systems of all, ours among them; each counts as there until it has been silent for long.

        `swaths`: of each line the cells of which all is seen from it, where targets are areas.
        """
        self.system, self.members = system, frozenset(members)
        self.states = dict[int, State]()
        """What each other has said of itself last."""
        self.alone = False
        self.lines = lines
        self._swaths = swaths
        self._scanned = 0
        self._sightings = dict[Key, Sighting]()
        self._claims = Claims(system)
        self._tiles = dict[tuple[Key, int, int], int]()
        self._targets: list[Target] | None = []
        self._reaches: dict[Key, Reach] | None = {}
        """How far each target reaches; None: to be worked out anew."""
        self._apart = set[int]()
        """Who fell silent when no more than as many were left: dead, or at work without us."""
        self._beyond = frozenset[extents.Cell]()
        """What is seen from the lines that were theirs then."""
        self._group = set(self.members)
        self._heard_us = dict.fromkeys(self.members - {system}, now_us)
        self._met = {system}
        """Who has been heard, and we."""
        self._stamps_us = dict[int, int]()
        self._said = dict[object, tuple[Record, int]]()
        self._say_us = now_us
        self._mine: Key | None = None

    # What comes in

    def hear(self, now_us: int, sender: int, stamp_us: int, records: Sequence[Record]) -> None:
        """What a peer has said, and its time of it; it may come late, twice and in any order."""
        if sender not in self._heard_us:
            return
        self._heard_us[sender] = now_us
        self._met.add(sender)
        for record in records:
            if isinstance(record, State):
                if stamp_us > self._stamps_us.get(sender, -1):
                    self._stamps_us[sender], self.states[sender] = stamp_us, record
            elif isinstance(record, Sighting):
                self._see(record)
            elif isinstance(record, Claim):
                self._claims.hear(now_us, sender, record)
            elif isinstance(record, Tile):
                self._reach(record)
            else:
                self._cover(record.lines << record.first)

    def see(self, number: int, sighting: Sighting, cells: Collection[extents.Cell] = ()) -> None:
        """We have located a target: our `number`th, or that one better than before. `cells`: how far it reaches."""
        for tile in extents.tiles_of((self.system, number), cells):
            self._reach(tile)
        before = self._sightings.get((self.system, number))
        revision = 0 if before is None else before.revision + 1
        self._see(as_sent(sighting._replace(key=(self.system, number), revision=revision)))

    def step(self, now_us: int) -> None:
        """Time has passed: who is lost, and what is free for it."""
        out = {other for other, state in self.states.items() if state.doing == Doing.OUT}
        group = (self._group | self._reached(now_us, LOST_AFTER_US)) - out
        heard = group & self._reached(now_us, ALONE_AFTER_US)
        self.alone = 2 * len(heard) < len(group)
        apart = self._apart | (group - heard if 2 * len(heard) == len(group) else set())
        self._part(apart - out - self._reached(now_us, ALONE_AFTER_US), group)
        self._group = group if self.alone else group & self._reached(now_us, GROUP_AFTER_US)
        if self.alone:
            self.give_up(now_us)
        for other in self.members - self.there(now_us):
            self._claims.release(now_us, other)
        self._claims.expire(now_us)

    # What is to be done

    @property
    def missing(self) -> set[int]:
        """The members that were never heard yet, neither by us nor by those whom we hear."""
        return set(self.members) - self._met - self._said_to_hear(self._met)

    def there(self, now_us: int) -> set[int]:
        """The members that are not lost, ourselves among them."""
        out = {other for other, state in self.states.items() if state.doing == Doing.OUT}
        return self._reached(now_us, LOST_AFTER_US) - out | {self.system}

    def audible(self, now_us: int) -> set[int]:
        """Those that we hear ourselves, also those who take no more part, and ourselves."""
        return self._heard(now_us, LOST_AFTER_US)

    def heard(self, now_us: int) -> set[int]:
        """Those of them that we hear ourselves, and ourselves."""
        return self._heard(now_us, LOST_AFTER_US) & self.there(now_us)

    def in_touch(self, now_us: int) -> bool:
        """Whether we hear most of those who are there: else wait with what can't be taken back."""
        there = self.there(now_us)
        return 2 * len(there & self._reached(now_us, IN_TOUCH_US)) > len(there) and not self.alone

    def scan(self, now_us: int) -> list[int]:
        """The numbers of the lines that are ours and that nobody has scanned yet."""
        if self.alone:
            return []
        ours = shares(self.lines, self.members, self.there(now_us))[self.system]
        return [number for number in ours if not self.is_scanned(number)]

    def scanned(self, number: int) -> None:
        """We have scanned a line."""
        self._cover(1 << number)

    def is_scanned(self, number: int) -> bool:
        """Whether anybody has, as far as we know."""
        return bool(self._scanned >> number & 1)

    def targets(self) -> list[Target]:
        """All that were sighted by anybody."""
        if self._targets is None:
            reach = dict[Key, list[extents.Cell]]()
            for (key, row, column), cells in self._tiles.items():
                reach.setdefault(key, []).extend(extents.cells_of(Tile(key, row, column, cells)))
            told = [one for key, one in self._sightings.items() if key in reach or not self._swaths]
            self._targets = merged(told, {one.key: reach[one.key] for one in told if one.key in reach})
        return self._targets

    def sighting(self, key: Key) -> Sighting:
        """One of a target's. Raises KeyError."""
        return self._sightings[key]

    def claim(self, now_us: int, target: Target) -> Claim:
        """What is claimed of a target; `Stage.FREE` by nobody where nothing is."""
        return self._claims.join(now_us, target.keys)

    def want(self, now_us: int, costs_s: Mapping[Key, float]) -> Target | None:
        """Bids for the target that costs us least, of those that can be ours; the one that is ours to serve now.

        `costs_s` by the names of the targets that we would serve. To be called at each step while we can serve one;
        nobody has two at a time.
        """
        targets = {key: target for target in self.targets() for key in target.keys}
        if self.alone:
            return None
        mine = targets.get(self._mine) if self._mine is not None else None
        if mine is not None:
            claim = self._claims.join(now_us, mine.keys)
            if self._gives_way(now_us, mine):
                self.give_up(now_us)
                return None
            if claim.owner == self.system and claim.stage in UNSETTLED:
                heard = self.heard(now_us)
                if heard != self.there(now_us) and self._claims.stands_us(now_us, mine.key) < RELAYED_US:
                    return None
                return mine if self._claims.engage(now_us, mine.keys, heard - {self.system}) else None
        self._mine = None
        for key, cost_s in sorted(costs_s.items(), key=lambda one: (one[1], one[0])):
            if key not in targets or self._gives_way(now_us, targets[key]):
                continue
            if self._claims.may_bid(self.claim(now_us, targets[key]), cost_s):
                self._claims.bid(now_us, targets[key].keys, cost_s)
                self._mine = key
                break
        return None

    def serving(self, now_us: int) -> Target | None:
        """The target that is ours to serve; None also once it is another's."""
        for target in self.targets() if self._mine is not None and not self.alone else ():
            if self._mine in target.keys and not self._gives_way(now_us, target):
                claim = self._claims.join(now_us, target.keys)
                return target if claim.owner == self.system and claim.stage == Stage.ENGAGED else None
        return None

    def serve(self, now_us: int) -> None:
        """The target that was ours has been served."""
        for target in self.targets():
            if self._mine in target.keys:
                self._claims.serve(now_us, target.keys)
        self.give_up(now_us)

    def give_up(self, now_us: int) -> None:
        """We serve nothing of what we have claimed and not served."""
        self._mine = None
        self._claims.release(now_us, self.system)

    # What goes out

    def say(self, now_us: int, own: State) -> bytes | None:
        """The content of our next broadcast, where one is due."""
        if now_us < self._say_us:
            return None
        self._say_us = now_us + SAY_EVERY_US
        known = self._known(now_us)

        def turn(name: object) -> tuple[int, bool]:
            record, (said, said_us) = known[name], self._said.get(name, (None, 0))
            unsettled = isinstance(record, Claim) and record.stage in UNSETTLED
            return said_us - SOONER_US * unsettled if record == said else -SOONER_US, not unsettled

        hears = self._heard(now_us, LOST_AFTER_US) & self._met
        own = own._replace(hears=sum(1 << place for place, one in enumerate(sorted(self.members)) if one in hears))
        content, taken = filled([own, *(known[name] for name in sorted(known, key=turn))])
        told = set(taken)
        self._said |= {name: (record, now_us) for name, record in known.items() if record in told}
        return content

    def _heard(self, now_us: int, within_us: int) -> set[int]:
        """Ourselves, and who said something of late."""
        return {self.system} | {other for other, at_us in self._heard_us.items() if now_us - at_us <= within_us}

    def _reached(self, now_us: int, within_us: int) -> set[int]:
        """Those, and whom they say that they hear."""
        heard = self._heard(now_us, within_us)
        return heard | self._said_to_hear(heard)

    def _said_to_hear(self, heard: Collection[int]) -> set[int]:
        """Whom some say that they hear."""
        said = [self.states[other].hears for other in heard if other in self.states]
        return {one for place, one in enumerate(sorted(self.members)) for bits in said if bits >> place & 1}

    def _known(self, now_us: int) -> dict[object, Record]:
        """All there is to tell, by what it is about.

        A claim is told by its target's name, that it was served of each of its sightings.
        """
        known = dict[object, Record]()
        for first in range(0, len(self.lines), LINES_OF_A_RECORD):
            if bits := self._scanned >> first & ((1 << LINES_OF_A_RECORD) - 1):
                known["lines", first] = Covered(first, bits)
        for key, sighting in self._sightings.items():
            known["sighting", key] = sighting
        for (key, row, column), cells in self._tiles.items():
            known["tile", key, row, column] = Tile(key, row, column, cells)
        for target in self.targets():
            claim = self._claims.join(now_us, target.keys)
            if claim.round or claim.stage != Stage.FREE:
                for key in target.keys if claim.stage == Stage.SERVED else target.keys[:1]:
                    known["claim", key] = self._claims.known[key]
        return known

    def _see(self, sighting: Sighting) -> None:
        known = self._sightings.get(sighting.key)
        if known is None or sighting.revision > known.revision:
            self._sightings[sighting.key] = sighting
            self._targets = self._reaches = None

    def _reach(self, tile: Tile) -> None:
        name = tile.key, tile.row, tile.column
        known = self._tiles.get(name, 0)
        if tile.cells & ~known:
            self._tiles[name] = known | tile.cells
            self._targets = self._reaches = None

    def _cover(self, lines: int) -> None:
        if lines & ~self._scanned:
            self._scanned |= lines
            self._reaches = None

    def _part(self, apart: set[int], group: set[int]) -> None:
        """Take note of who is apart from us; `group`: of all who were there before."""
        if apart != self._apart:
            divided = shares(self.lines, self.members, group | apart)
            theirs = [number for one in apart for number in divided[one] if number < len(self._swaths)]
            self._apart, self._beyond = apart, frozenset(cell for number in theirs for cell in self._swaths[number])

    def beyond(self, target: Target) -> bool:
        """Whether a target reaches to where lines of those see who are apart from us: theirs, if they live."""
        return not self._beyond.isdisjoint(self._reach_of()[target.key].cells)

    def _gives_way(self, now_us: int, target: Target) -> bool:
        """Whether a target may turn out to be beyond, or one with another, whose claim counts for more."""
        reach = self._reach_of()
        within = reach[target.key].within
        if not self._beyond.isdisjoint(within):
            return True
        claim = self._claims.join(now_us, target.keys)
        others = [one for one in self.targets() if one.label == target.label and one.key != target.key]
        perhaps = (one for one in others if not within.isdisjoint(reach[one.key].cells))
        claims = (self._claims.join(now_us, one.keys) for one in perhaps)
        return any(other.stage != Stage.FREE and _counts(other) > _counts(claim) for other in claims)

    def _reach_of(self) -> dict[Key, Reach]:
        if self._reaches is None:
            scanned = [number for number in range(len(self._swaths)) if self.is_scanned(number)]
            unknown = extents.unknown(self._swaths, scanned)
            cells = {target.key: self._cells(target) for target in self.targets()}
            self._reaches = {}
            for target in self.targets():
                others = [cells[one.key] for one in self.targets() if one.label == target.label and one is not target]
                within = extents.reached(cells[target.key], unknown.union(*others)) if unknown else cells[target.key]
                self._reaches[target.key] = Reach(cells[target.key], within)
        return self._reaches

    def _cells(self, target: Target) -> set[extents.Cell]:
        tiles = [Tile(*name, cells) for name, cells in self._tiles.items() if name[0] in target.keys]
        return {cell for tile in tiles for cell in extents.cells_of(tile)}


def _counts(claim: Claim) -> tuple[bool, Stage, float, int]:
    """Of claims on two targets the greater counts; their rounds say nothing of each other."""
    return claim.stage == Stage.SERVED, claim.stage, -claim.cost_s, -claim.owner
