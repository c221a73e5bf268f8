"""Work shared over a bad radio: the whole area is scanned, every target is served once, also when a member fails."""

import math
import random
from typing import NamedTuple

import pytest

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.coverage import Footprint, Line, lawnmower, polygon
from sitl_emu.missions.companion.swarm.records import Doing, Sighting, Stage, State, parsed
from sitl_emu.missions.companion.swarm.sharing import IN_TOUCH_US, Sharing
from sitl_emu.missions.companion.swarm.targets import Target
from tests.unit.lossy_air import Air

HOME = (47.397742, 8.545594)
AREA: list[Corner] = [(0.0, 0.0), (160.0, 0.0), (160.0, 70.0), (90.0, 80.0), (80.0, 150.0), (0.0, 150.0)]
LINES = lawnmower(polygon(AREA), Footprint(16.0, 16.0), heading_deg=20.0)
STEP_US = 125_000
SPEED_M_S, SERVING_US, SIGMA_M = 10.0, 5_000_000, 0.6
SIGHT_M = 20.0
TWO_OWNERS_US = 3_000_000
"""Longest that two may own a target, by `sharing.py`: until the one that was taken for lost hears the others."""
UNHEARD_US = 2_000_000
"""Who falls silent so soon after it has served may not have been heard to have; or up to a second before."""
END_US = 1_800_000_000


class Served(NamedTuple):
    place: int
    system: int
    at_us: int


class Flyer:
    """An aircraft on rails, which scans its lines, sights places in passing, and serves what is its own."""

    def __init__(self, system: int, members: list[int], places: list[Corner], seed: int) -> None:
        self.sharing = Sharing(0, system, members, LINES)
        self.system, self._places, self._dice = system, places, random.Random(f"flyer {seed} {system}")
        self.at: Corner = (0.0, -5.0 * system)
        self.owned: Target | None = None
        self.dead = self.mute = False
        self._seen = set[int]()
        self._line, self._to = -1, list[Corner]()
        self._until_us = 0

    def step(self, now_us: int) -> list[Served]:
        sharing, before = self.sharing, self.owned
        sharing.step(now_us)
        open_targets = [one for one in sharing.targets() if sharing.claim(now_us, one).stage != Stage.SERVED]
        self.owned = sharing.want(now_us, {one.key: math.dist(self.at, place_of(one)) for one in open_targets})
        if self.owned is None:
            self._scan(now_us)
            return []
        place = place_of(self.owned)
        if before is None or self._move(place):
            self._until_us = now_us + SERVING_US
        if now_us < self._until_us or not sharing.in_touch(now_us):
            return []
        sharing.serve(now_us)
        self.owned = None
        return [Served(nearest(self._places, place), self.system, now_us)]

    def state(self) -> State:
        return State(Doing.SCANNING, *from_metres(*self.at, *HOME), 500.0, 0.0, 0.0, 0.0)

    def _scan(self, now_us: int) -> None:
        left = self.sharing.scan(now_us)
        if self._line not in left:
            if not left:
                return
            self._line = min(left, key=lambda number: math.dist(self.at, LINES[number][0]))
            self._to = list(LINES[self._line])
        if not self._move(self._to[0]):
            self._to.pop(0)
        for number, place in enumerate(self._places):
            if number not in self._seen and math.dist(self.at, place) < SIGHT_M:
                self._seen.add(number)
                self.sight(number, place)
        if not self._to:
            self.sharing.scanned(self._line)

    def sight(self, number: int, place: Corner) -> None:
        north, east = (axis + self._dice.gauss(0.0, SIGMA_M) for axis in place)
        seen = from_metres(north, east, *HOME)
        self.sharing.see(number, Sighting((0, 0), 0, 1, 0.9, *seen, 490.0, SIGMA_M, SIGMA_M, 0.0))

    def _move(self, to: Corner) -> bool:
        """Whether there is still some way to go."""
        away_m, way_m = math.dist(self.at, to), SPEED_M_S * STEP_US / 1e6
        share = min(1.0, way_m / away_m) if away_m else 1.0
        self.at = (self.at[0] + share * (to[0] - self.at[0]), self.at[1] + share * (to[1] - self.at[1]))
        return share < 1.0


def place_of(target: Target) -> Corner:
    return to_metres(target.lat_deg, target.lon_deg, *HOME)


def nearest(places: list[Corner], place: Corner) -> int:
    return min(range(len(places)), key=lambda number: math.dist(places[number], place))


class Work:
    """All of them at work until everything is done, or time is up. `known`: most targets are known from the start."""

    def __init__(
        self,
        count: int,
        loss: float,
        seed: int,
        fails: str = "",
        *,
        known: bool = False,
        hidden: tuple[int, int] = (0, 0),
        end_us: int = END_US,
    ) -> None:
        dice = random.Random(f"work {seed}")
        places = list[Corner]()
        while len(places) < 7:
            line = dice.choice(LINES)
            share = dice.random()
            place = (line[0][0] + share * (line[1][0] - line[0][0]), line[0][1] + share * (line[1][1] - line[0][1]))
            if all(math.dist(place, other) > 12.0 for other in places):
                places.append(place)
        self.members = list(range(1, count + 1))
        self.flyers = [Flyer(system, self.members, places, seed) for system in self.members]
        self.air, self.served = Air[bytes](loss, seed), list[Served]()
        self.failed, self.fails = self.flyers[dice.randrange(count)], fails
        self.fail_us = dice.randrange(1_000_000, 30_000_000)
        """When it may fail; it does as soon as it owns a target then, or half a minute later."""
        self.failed_us = 0
        self.two_owners_us, self._hidden = 0, set(hidden)
        if known:
            for flyer in self.flyers:
                for number in range(5):
                    flyer.sight(number, places[number])
        self.places, self.now_us = places, 0
        shared_us = [0] * len(places)
        while self.now_us < end_us and not self.done:
            self.now_us += STEP_US
            self._step()
            owned = [nearest(places, place_of(one.owned)) for one in self.flyers if one.owned and not one.dead]
            shared_us = [us + STEP_US if owned.count(n) > 1 else 0 for n, us in enumerate(shared_us)]
            self.two_owners_us = max(self.two_owners_us, *shared_us)

    @property
    def living(self) -> list[Flyer]:
        return [one for one in self.flyers if not one.dead and not one.mute]

    @property
    def done(self) -> bool:
        """As the survivors know it."""
        return all(
            all(map(one.sharing.is_scanned, range(len(LINES))))
            and len(one.sharing.targets()) >= len(self.places)
            and all(one.sharing.claim(self.now_us, each).stage == Stage.SERVED for each in one.sharing.targets())
            for one in self.living
        )

    def _step(self) -> None:
        now_us = self.now_us
        engaged = now_us >= self.fail_us and self.failed.owned is not None
        if self.fails and not self.failed_us and (engaged or now_us >= self.fail_us + 30_000_000):
            self.failed.dead, self.failed.mute, self.failed_us = self.fails == "companion", True, now_us
        for receiver, sender, stamp_us, content in self.air.due(now_us):
            flyer = self.flyers[receiver - 1]
            if not flyer.mute:
                records = parsed(content)
                assert records is not None
                flyer.sharing.hear(now_us, sender, stamp_us, records)
        for flyer in self.flyers:
            if not flyer.dead:
                self.served += flyer.step(now_us)
                said = flyer.sharing.say(now_us, flyer.state())
                if said is not None and not flyer.mute:
                    others = [
                        one for one in self.members if one != flyer.system and {one, flyer.system} != self._hidden
                    ]
                    self.air.send(now_us, flyer.system, others, said)


def twice(work: Work) -> list[Served]:
    """The services of places that were served before, but for what its first server died on before it was heard."""
    first, again = dict[int, Served](), list[Served]()
    for one in work.served:
        before = first.setdefault(one.place, one)
        cut_off = before.system == work.failed.system or len(work.members) == 2
        unheard = cut_off and -IN_TOUCH_US <= work.failed_us - before.at_us <= UNHEARD_US
        if before is not one and not (unheard and one.system != before.system):
            again.append(one)
    return again


ONE_SERVED_BY_ONE = [(1, ""), (2, ""), (4, ""), (2, "companion"), (4, "companion"), (4, "radio")]


@pytest.mark.parametrize(("seed", "known"), [(1, False), (2, True)])
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(("count", "fails"), ONE_SERVED_BY_ONE)
def test_all_is_scanned_and_every_target_is_served_once(
    count: int, fails: str, loss: float, seed: int, known: bool
) -> None:
    work = Work(count, loss, seed, fails, known=known)
    assert work.done, f"not done in {END_US / 6e7:.0f} minutes"
    assert bool(work.failed_us) == bool(fails)
    assert {one.place for one in work.served} == set(range(len(work.places)))
    assert twice(work) == []
    assert work.two_owners_us <= (TWO_OWNERS_US if fails else 0)


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize(("count", "fails"), [(3, ""), (4, ""), (4, "companion")])
def test_two_that_hear_each_other_through_others_alone_share_as_well(
    count: int, fails: str, loss: float, known: bool
) -> None:
    work = Work(count, loss, 4, fails, known=known, hidden=(1, 2))
    assert work.done and {one.place for one in work.served} == set(range(len(work.places)))
    assert twice(work) == [] and work.two_owners_us <= TWO_OWNERS_US


def test_a_lost_member_that_is_heard_again_takes_part_again() -> None:
    one, two = (Sharing(0, system, [1, 2], LINES) for system in (1, 2))
    state = State(Doing.SCANNING, *HOME, 500.0, 0.0, 0.0, 0.0)
    before = one.scan(0)
    one.step(11_000_000)
    assert one.scan(11_000_000) == list(range(len(LINES))) and one.there(11_000_000) == {1}
    content = two.say(11_000_000, state)
    assert content is not None
    one.hear(11_500_000, 2, 11_000_000, parsed(content) or [])
    one.step(11_500_000)
    assert one.scan(11_500_000) == before and one.states[2].lat_deg == pytest.approx(HOME[0])


def test_of_two_that_hear_each_other_no_more_each_serves_on_its_own_side_until_they_do() -> None:
    """Two lines of cells side by side, the middle column seen from both; areas on either side, and one across."""
    lines = [((0.0, 10.0), (20.0, 10.0)), ((20.0, 22.0), (0.0, 22.0))]
    swaths = [{(row, column) for row in range(5) for column in columns} for columns in (range(5), range(4, 9))]
    one, two = (Sharing(0, system, [1, 2], [Line(*line) for line in lines], swaths=swaths) for system in (1, 2))
    for number, column in enumerate((1, 4, 7)):
        for sharing in (one, two):
            seen = Sighting((0, 0), 0, 1, 0.9, *from_metres(0.0, 4.0 * column, *HOME), 490.0, 1.0, 1.0, 0.0)
            sharing.see(number, seen, {(2, column)})
    for number in range(2):
        one.scanned(number)
        two.scanned(number)

    def beyond(sharing: Sharing) -> list[bool]:
        return [sharing.beyond(target) for target in sharing.targets()]

    for sharing in (one, two):
        sharing.step(7_000_000)
    assert beyond(one) == beyond(two) == [False, False, False]
    for sharing in (one, two):
        sharing.step(12_000_000)
    assert (beyond(one), beyond(two)) == ([False, True, True], [True, True, False])
    costs_s = {target.key: 1.0 for target in one.targets()[1:]}
    assert one.want(12_000_000, costs_s) is None and all(
        one.claim(12_000_000, target).stage == Stage.FREE for target in one.targets()
    )
    one.hear(13_000_000, 2, 1, [State(Doing.SCANNING, *HOME, 500.0, 0.0, 0.0, 0.0)])
    one.step(13_000_000)
    assert beyond(one) == [False, False, False]


def test_who_says_that_it_is_out_leaves_its_work_at_once() -> None:
    one = Sharing(0, 1, [1, 2], LINES)
    one.hear(100_000, 2, 1, [State(Doing.OUT, *HOME, 500.0, 0.0, 0.0, 0.0)])
    one.step(100_000)
    assert one.scan(100_000) == list(range(len(LINES))) and not one.alone


def test_an_older_state_that_comes_late_counts_no_more() -> None:
    one = Sharing(0, 1, [1, 2], LINES)
    for stamp_us, doing in ((5, Doing.RETURNING), (3, Doing.SCANNING)):
        one.hear(100_000, 2, stamp_us, [State(doing, *HOME, 500.0, 0.0, 0.0, 0.0)])
    assert one.states[2].doing == Doing.RETURNING


def test_who_is_missing_was_never_heard_by_us_nor_by_those_whom_we_hear() -> None:
    one, state = Sharing(0, 1, [1, 2, 3, 4], LINES), State(Doing.WAITING, *HOME, 500.0, 0.0, 0.0, 0.0)
    assert one.missing == {2, 3, 4}
    one.hear(100_000, 2, 1, [state._replace(hears=0b0110)])
    assert one.missing == {4}, "the second hears the third"


def test_who_has_just_been_switched_on_says_that_it_hears_nobody() -> None:
    one, state = Sharing(0, 1, [1, 2, 3], LINES), State(Doing.WAITING, *HOME, 500.0, 0.0, 0.0, 0.0)
    for now_us, hears in ((0, 0b001), (300_000, 0b011)):
        content = one.say(now_us, state)
        assert content is not None and (records := parsed(content)) is not None
        assert isinstance(records[0], State) and records[0].hears == hears
        one.hear(100_000, 2, 1, [state])
