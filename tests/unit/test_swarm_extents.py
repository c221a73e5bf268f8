"""Areas of several aircraft: told in tiles, one where they meet, and in doubt where nobody has looked between them."""

from hypothesis import given
from hypothesis import strategies as st
from shapely import box

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.coverage import Line
from sitl_emu.missions.companion.swarm import extents
from sitl_emu.missions.companion.swarm.extents import Cell
from sitl_emu.missions.companion.swarm.records import Doing, Sighting, Stage, State, as_sent, parsed
from sitl_emu.missions.companion.swarm.sharing import Sharing
from sitl_emu.missions.companion.swarm.targets import merged

HOME = (47.397742, 8.545594)
CELLS = st.sets(st.tuples(st.integers(-1024, 1023), st.integers(-1024, 1023)), max_size=30)
PARTS = st.dictionaries(
    st.tuples(st.integers(1, 3), st.integers(0, 4)),
    st.sets(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=1, max_size=8),
    max_size=8,
)
STEP_US = 250_000


@given(CELLS)
def test_tiles_carry_cells(cells: set[Cell]) -> None:
    tiles = [as_sent(tile) for tile in extents.tiles_of((2, 7), cells)]
    assert {cell for tile in tiles for cell in extents.cells_of(tile)} == cells
    assert sum(len(extents.cells_of(tile)) for tile in tiles) == len(cells) and {tile.key for tile in tiles} <= {(2, 7)}


@given(PARTS)
def test_areas_that_meet_are_one_and_no_others(parts: dict[tuple[int, int], set[Cell]]) -> None:
    groups = extents.joined(parts)
    assert sorted(key for keys in groups for key in keys) == sorted(parts)
    for keys in groups:
        ours = set().union(*(parts[key] for key in keys))
        theirs = set().union(*(parts[key] for key in parts if key not in keys))
        assert theirs.isdisjoint(near for cell in ours for near in extents.about(cell))
        assert set(keys) == linked(keys[0], parts)
    assert extents.joined(dict(reversed(list(parts.items())))) == groups


def linked(start: tuple[int, int], parts: dict[tuple[int, int], set[Cell]]) -> set[tuple[int, int]]:
    """By another way: all that a part leads to, part by part."""
    found = {start}
    while True:
        near = {near for key in found for cell in parts[key] for near in extents.about(cell)}
        more = {key for key in parts if not near.isdisjoint(parts[key])}
        if more <= found:
            return found
        found |= more


def test_cells_of_an_area_are_those_that_it_has_all_of() -> None:
    assert extents.cells_in(box(-4.5, 0.0, 4.5, 11.9)) == {(-1, 0), (-1, 1), (0, 0), (0, 1)}
    assert extents.cell_of(-0.1, 4.0) == (-1, 1) and extents.cell_of(1e9, -1e9) == (1023, -1024)


def test_what_a_scanned_line_sees_is_known_whatever_others_would_see() -> None:
    assert extents.unknown([{(0, 0), (0, 1)}, {(0, 1), (0, 2)}], [0]) == {(0, 2)}


def sighting(system: int, number: int, north: float, confidence: float = 0.9) -> Sighting:
    return Sighting((system, number), 0, 0, confidence, *from_metres(north, 0.0, *HOME), 490.0, 0.5, 0.5, 0.0)


def test_an_area_is_placed_by_the_sighting_that_has_a_place() -> None:
    one, other = sighting(1, 0, 0.0, 0.0), sighting(2, 0, 90.0)
    (target,) = merged([one, other], {one.key: [(0, 0), (1, 1)], other.key: [(2, 1)]})
    assert target.keys == ((1, 0), (2, 0)) and (target.lat_deg, target.confidence) == (other.lat_deg, 0.9)


class Pair:
    """Two aircraft with three lines, of which one sees cells (0, 0), the next (1, 0) and the last (2, 0)."""

    def __init__(self) -> None:
        lines = [Line((10.0 * number, 0.0), (10.0 * number, 50.0)) for number in range(3)]
        swaths = [{(number, 0)} for number in range(3)]
        self.now_us = 0
        self.both = [Sharing(0, system, (1, 2), lines, swaths=swaths) for system in (1, 2)]

    def talk(self, seconds: float = 3.0) -> None:
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            for one, other in (self.both, self.both[::-1]):
                content = one.say(self.now_us, State(Doing.SCANNING, *HOME, 500.0, 0.0, 0.0, 0.0))
                other.hear(self.now_us, one.system, self.now_us, parsed(content or b"") or [])
            for one in self.both:
                one.step(self.now_us)

    def want(self, system: int) -> bool:
        """Whether it comes to serve the target that it has sighted."""
        one = self.both[system - 1]
        for _ in range(8):
            mine = next(target for target in one.targets() if any(key[0] == system for key in target.keys))
            target = one.want(self.now_us, {mine.key: 10.0})
            if target is not None:
                return True
            self.talk(0.5)
        return False


def two_parts() -> Pair:
    """Each has seen a part, on the first line and the last; the first has served it."""
    pair = Pair()
    for number, one in enumerate(pair.both):
        one.see(0, sighting(one.system, 0, 8.0 * number), {(2 * number, 0)})
        one.scanned(2 * number)
    pair.talk()
    assert pair.want(1)
    pair.both[0].serve(pair.now_us)
    pair.talk()
    return pair


def test_while_nobody_has_looked_between_two_parts_the_second_is_not_served() -> None:
    pair = two_parts()
    assert not pair.want(2)
    pair.both[1].scanned(1)
    assert pair.want(2), "dry ground lies between them: they are two"


def test_parts_that_turn_out_to_be_one_are_served_once() -> None:
    pair = two_parts()
    pair.both[1].see(0, sighting(2, 0, 8.0), {(1, 0), (2, 0)})
    pair.both[1].scanned(1)
    pair.talk()
    (target,) = pair.both[1].targets()
    assert pair.both[1].claim(pair.now_us, target).stage == Stage.SERVED and not pair.want(2)


def test_of_two_that_bid_for_parts_that_may_be_one_the_nearer_serves() -> None:
    pair = Pair()
    costs = {1: {(1, 0): 10.0}, 2: {(2, 0): 5.0}}
    for number, one in enumerate(pair.both):
        one.see(0, sighting(one.system, 0, 8.0 * number), {(2 * number, 0)})
        assert one.want(pair.now_us, costs[one.system]) is None, "a bid, that the other has not heard of"
    serving = list[int]()
    for _ in range(20):
        pair.talk(0.5)
        serving += [one.system for one in pair.both if one.want(pair.now_us, costs[one.system]) is not None]
    assert set(serving) == {2} and pair.both[1].serving(pair.now_us) is not None
    assert pair.both[0].serving(pair.now_us) is None
