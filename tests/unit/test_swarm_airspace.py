"""Aircraft kept apart by layers and columns: never closer than 5 m, and all get done, whatever the radio loses."""

import math
import random
from collections.abc import Generator
from typing import NamedTuple

import pytest

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.swarm.airspace import COLUMN_M, KEEP_M, LAYER_M, Airspace, layer_m, stopping_m
from sitl_emu.missions.companion.swarm.records import Column
from tests.typed import now
from tests.unit.lossy_air import Air

STEP_S = 0.1
SAY_STEPS = 2
SLOWING_M_S2 = 3.0
FASTEST_M_S, CLIMBING_M_S = 8.0, 2.0
LOWEST_M, DELIVERY_M = 12.0, 2.0
END_S = 1800.0


class Said(NamedTuple):
    at: Corner
    column: Column
    clear_of: int


class Flyer:
    """A mass point, which takes off, flies over its targets, goes down and up at each, returns and lands.

    It believes to be up to a metre from where it is.
    """

    def __init__(self, system: int, members: list[int], targets: list[Corner], seed: int) -> None:
        dice = random.Random(f"flyer {seed} {system}")
        self.error: Corner = (dice.uniform(-0.7, 0.7), dice.uniform(-0.7, 0.7))
        self.airspace = Airspace(system, members)
        self.layer_m = layer_m(LOWEST_M, members, system)
        self.pad: Corner = (0.0, 9.0 * system)
        self.at, self.height_m, self.velocity = self.pad, 0.0, (0.0, 0.0)
        self.targets, self.members, self.done, self.waits_s = targets, members, False, 0.0
        self._flight: Generator[None, None, None] | None = self._fly()

    @property
    def known(self) -> Corner:
        return self.at[0] + self.error[0], self.at[1] + self.error[1]

    def step(self, now_us: int) -> None:
        self.now_us = now_us
        parked = self.height_m <= 0.0
        self.airspace.step(now_us, self.known, math.hypot(*self.velocity), self.members, parked=parked)
        if self._flight is not None and next(self._flight, self) is self:
            self._flight, self.done = None, True
            self.airspace.free()

    def _fly(self) -> Generator[None, None, None]:
        yield from self._column(self.layer_m)
        for target in self.targets:
            yield from self._go(target)
            yield from self._column(DELIVERY_M, self.layer_m)
        yield from self._go(self.pad)
        yield from self._column(0.0)

    def _column(self, *heights_m: float) -> Generator[None, None, None]:
        place, home_m = self.at, self.height_m
        while self.airspace.column != Column.TAKEN:
            if home_m > 0.0 and math.dist(self.at, place) > 0.5:
                self.airspace.free()
                yield from self._go(place)
            self.airspace.ask()
            yield from self._wait()
        for height_m in heights_m:
            while self.height_m != height_m:
                most = CLIMBING_M_S * STEP_S
                self.height_m += min(max(height_m - self.height_m, -most), most)
                self._accelerate((0.0, 0.0))
                yield
        self.airspace.free()

    def _wait(self) -> Generator[None, None, None]:
        """Stands, or goes aside where it is in the way."""
        ruling = self.airspace.rule(self.now_us, self.known, (0.0, 0.0))
        aside = ruling.aside if self.height_m > 0.0 else None
        self._accelerate(self._towards(aside) if aside is not None else (0.0, 0.0))
        self.waits_s += STEP_S
        yield

    def _go(self, to: Corner) -> Generator[None, None, None]:
        while math.dist(self.at, to) > 0.3 or math.hypot(*self.velocity) > 0.3:
            wished = self._towards(to)
            ruling = self.airspace.rule(self.now_us, self.known, wished)
            if ruling.go:
                self._accelerate(wished)
                yield
            else:
                yield from self._wait()

    def _towards(self, to: Corner) -> Corner:
        away = math.dist(self.at, to)
        speed = min(FASTEST_M_S, 0.6 * math.sqrt(2.0 * SLOWING_M_S2 * away))
        return (0.0, 0.0) if away < 1e-3 else ((to[0] - self.at[0]) / away * speed, (to[1] - self.at[1]) / away * speed)

    def _accelerate(self, wished: Corner) -> None:
        north, east = wished[0] - self.velocity[0], wished[1] - self.velocity[1]
        more = math.hypot(north, east)
        share = min(1.0, SLOWING_M_S2 * STEP_S / more) if more else 1.0
        self.velocity = (self.velocity[0] + share * north, self.velocity[1] + share * east)
        self.at = (self.at[0] + self.velocity[0] * STEP_S, self.at[1] + self.velocity[1] * STEP_S)


class Flown(NamedTuple):
    done: bool
    nearest_m: float
    seconds: float
    waits_s: float


def fly(count: int, loss: float, seed: int, size_m: float = 60.0) -> Flown:
    dice, members = random.Random(f"fly {seed}"), list(range(1, count + 1))
    flyers = [
        Flyer(system, members, [(dice.uniform(10.0, size_m), dice.uniform(0.0, size_m)) for _ in range(4)], seed)
        for system in members
    ]
    air, newest, nearest_m, steps = Air[Said](loss, seed), dict[tuple[int, int], int](), math.inf, 0
    while not all(one.done for one in flyers) and steps * STEP_S < END_S:
        steps += 1
        now_us = round(steps * STEP_S * 1e6)
        for receiver, sender, stamp_us, said in air.due(now_us):
            if stamp_us > newest.get((receiver, sender), -1):
                newest[receiver, sender] = stamp_us
                flyers[receiver - 1].airspace.hear(now_us, sender, *said)
        for one in flyers:
            one.step(now_us)
            if (steps + one.airspace.system) % SAY_STEPS == 0:
                said = Said(one.known, one.airspace.column, one.airspace.clear_of)
                air.send(
                    now_us, one.airspace.system, [other for other in members if other != one.airspace.system], said
                )
        for number, one in enumerate(flyers):
            for other in flyers[:number]:
                if one.height_m > 0.0 or other.height_m > 0.0:
                    nearest_m = min(nearest_m, math.dist((*one.at, one.height_m), (*other.at, other.height_m)))
    return Flown(all(one.done for one in flyers), nearest_m, steps * STEP_S, sum(one.waits_s for one in flyers))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_two_are_never_closer_than_5_m_and_all_come_home(count: int, loss: float, seed: int) -> None:
    flown = fly(count, loss, seed)
    assert flown.done, f"still waiting after {END_S / 60:.0f} minutes"
    assert flown.nearest_m >= KEEP_M


def test_without_columns_they_would_come_closer(monkeypatch: pytest.MonkeyPatch) -> None:
    """That the flights above need them."""

    def take(self: Airspace, *_: object, **__: object) -> None:
        self.column = Column.TAKEN

    monkeypatch.setattr(Airspace, "step", take)
    assert min(fly(4, 0.0, seed).nearest_m for seed in (1, 2, 3)) < KEEP_M


def heard(airspace: Airspace, other: int, at: Corner, column: Column, clear_of: int = 0) -> None:
    airspace.hear(0, other, at, column, clear_of)


def test_layers_are_in_the_order_of_systems() -> None:
    assert [layer_m(20.0, [7, 2, 5], system) for system in (2, 5, 7)] == [20.0, 20.0 + LAYER_M, 20.0 + 2 * LAYER_M]


def test_a_column_is_taken_once_all_that_are_there_keep_clear_of_it() -> None:
    us = Airspace(1, [1, 2, 3])
    us.ask()
    assert not us.step(0, (0.0, 0.0), 0.0, {1, 2, 3}) and now(us.column) == Column.NONE, "3 was not heard yet"
    for other in (2, 3):
        heard(us, other, (50.0, 0.0), Column.NONE)
    assert not us.step(0, (0.0, 0.0), 0.0, {1, 2, 3}) and now(us.column) == Column.ASKED
    heard(us, 2, (50.0, 0.0), Column.NONE, 1)
    assert not us.step(0, (0.0, 0.0), 0.0, {1, 2, 3})
    assert us.step(0, (0.0, 0.0), 0.0, {1, 2}), "3 is lost"


def test_an_answer_to_the_last_column_is_none_to_the_next() -> None:
    us = Airspace(1, [1, 2])
    heard(us, 2, (50.0, 0.0), Column.NONE, 1)
    us.ask()
    assert not us.step(0, (0.0, 0.0), 0.0, {1, 2}) and now(us.column) == Column.NONE
    heard(us, 2, (50.0, 0.0), Column.NONE, 0)
    us.step(0, (0.0, 0.0), 0.0, {1, 2})
    assert now(us.column) == Column.ASKED


def test_who_can_not_stop_before_a_column_does_not_say_that_it_keeps_clear() -> None:
    us = Airspace(2, [1, 2])
    heard(us, 1, (0.0, 0.0), Column.ASKED)
    near_m = COLUMN_M + stopping_m(8.0)
    us.step(0, (near_m - 0.1, 0.0), 8.0, {1, 2})
    assert us.clear_of == 0
    us.step(0, (near_m + 0.1, 0.0), 8.0, {1, 2})
    assert us.clear_of == 1


def test_before_a_column_one_waits_and_out_of_it_one_goes_on_or_aside() -> None:
    us = Airspace(2, [1, 2, 3])
    heard(us, 1, (0.0, 0.0), Column.TAKEN)
    assert us.rule(0, (20.0, 0.0), (-5.0, 0.0)) == (False, 1, None)
    assert us.rule(0, (20.0, 0.0), (0.0, 5.0)).go and us.rule(0, (20.0, 0.0), (5.0, 0.0)).go
    assert us.rule(0, (6.0, 0.0), (5.0, 0.0)).go
    assert us.rule(0, (6.0, 0.0), (-5.0, 0.0)).aside == pytest.approx((COLUMN_M + KEEP_M, 0.0))
    heard(us, 3, (25.0, 0.0), Column.TAKEN)
    aside = us.rule(0, (6.0, 0.0), (-5.0, 0.0)).aside
    assert aside is not None and math.dist(aside, (25.0, 0.0)) > COLUMN_M, "straight on is the column of 3"
    assert math.hypot(*aside) == pytest.approx(COLUMN_M + KEEP_M)


def test_of_two_that_ask_for_one_column_the_lower_system_goes_first() -> None:
    low, high = Airspace(1, [1, 2]), Airspace(2, [1, 2])
    for one, other in ((low, 2), (high, 1)):
        heard(one, other, (5.0, 0.0), Column.NONE)
        one.ask()
        one.step(0, (0.0, 0.0), 0.0, {1, 2})
        assert one.column == Column.ASKED
        heard(one, other, (5.0, 0.0), Column.ASKED)
        one.step(0, (0.0, 0.0), 0.0, {1, 2})
    assert (low.column, high.column) == (Column.ASKED, Column.NONE)
    assert low.rule(0, (0.0, 0.0), (0.0, 0.0)).go and high.rule(0, (0.0, 0.0), (0.0, 0.0)).aside is not None
