"""Aircraft kept apart: a height for each, and a column of air for who leaves it.

On the way every aircraft keeps to its own layer, `LAYER_M` from the next: then it does not matter where the others
are. Who goes up or down, to take off, deliver or land, needs the column under and over its place, `COLUMN_M` around.
It *asks* for it, standing still, and *takes* it once every other that is there has said that it keeps clear of it. An
aircraft says so while it is outside and can stop before it; from then on it waits before the column until that is free.
Who is within goes on if it is leaving, else aside, unless that leads into another column; it comes back to ask anew. Of
two that ask for columns that meet the lower system goes first. Who stands on the ground answers where it is `PARKED_M`
away: start places must be so far apart.

As nothing is done before all have answered, loss makes it slower and not less safe. What it does not see is who is not
heard: a lost aircraft keeps its layer if its own failsafe does (RTL_RETURN_ALT, its layer's height), and its last
column is kept clear of for `COLUMN_LASTS_US`.
A state machine on the times of messages. Places are metres north and east of any origin.
"""

import math
from collections.abc import Collection
from typing import NamedTuple

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.swarm.records import Column

KEEP_M = 5.0
"""Two are never closer (issue 12)."""
LAYER_M = 8.0
"""Of it 3 m are for the heights' own errors; ours."""
COLUMN_M = 12.0
"""Of it 7 m are for the errors of two places and a stop that takes longer than reckoned; ours."""
PARKED_M = 7.0
"""Of it 2 m are for the errors of two places; ours."""
REACTION_S = 1.0
"""From deciding to stop until slowing down, and the age of what we know of ourselves; ours."""
SLOWING_M_S2 = 2.0
"""Below MPC_ACC_HOR (3 m/s²), with which PX4 slows down at waypoints."""
COLUMN_LASTS_US = 120_000_000
"""How long after its last word an aircraft may still be in its column: more than a descent and a climb; ours."""
TURNS = 16
"""Directions in which one may go aside."""
WALKING_M_S = 0.5
"""Who is slower stands still."""


class Neighbour(NamedTuple):
    """What another said of itself last, and when that was heard."""

    heard_us: int
    at: Corner
    column: Column
    clear_of: int


class Ruling(NamedTuple):
    """What an aircraft may do now."""

    go: bool
    """Whether it may go where it wants to; else it stops where it is."""
    of: int = 0
    """Whose column it waits for."""
    aside: Corner | None = None
    """Where it has to move to first, if it is in somebody's way."""


def layer_m(lowest_m: float, members: Collection[int], system: int) -> float:
    """The height of a member's layer: the lowest system has the lowest."""
    return lowest_m + LAYER_M * sorted(members).index(system)


class Airspace:
    """The columns of air, as one aircraft knows of them."""

    def __init__(self, system: int, members: Collection[int]) -> None:
        self.system, self._members = system, sorted(members)
        self.column = Column.NONE
        """Ours; to be told the others in each state."""
        self.clear_of = 0
        """Whose columns we keep clear of, as `State.clear_of`."""
        self._others = dict[int, Neighbour]()
        self._wanted = False

    def hear(self, now_us: int, sender: int, at: Corner, column: Column, clear_of: int) -> None:
        """A member has said where it is, and what of columns; the newest alone, not what came late."""
        self._others[sender] = Neighbour(now_us, at, column, clear_of)

    def ask(self) -> None:
        """We want to go up or down where we are."""
        self._wanted = True

    def free(self) -> None:
        """We are back at our layer's height, or on the ground."""
        self._wanted, self.column = False, Column.NONE

    def step(self, now_us: int, at: Corner, speed_m_s: float, there: Collection[int], *, parked: bool = False) -> bool:
        """Where we are now, and who is there; whether the column is ours. To be called before each broadcast.

        `parked`: we stand on the ground.
        """
        self.clear_of = 0
        for other, near in self._columns(now_us):
            apart_m = math.dist(at, near.at)
            stands_by = parked and self.column == Column.NONE and apart_m > PARKED_M
            if stands_by or apart_m - stopping_m(speed_m_s) > COLUMN_M:
                self.clear_of |= self._bit(other)
        others = [self._others.get(other) for other in there if other != self.system]
        mine = self._bit(self.system)
        if self._wanted and self.column == Column.NONE and not self._yields(now_us, at):
            # an answer to our last column is none to this one: all must have taken it back
            if all(near is not None and not near.clear_of & mine for near in others):
                self.column = Column.ASKED
        elif self.column == Column.ASKED:
            if self._yields(now_us, at):
                self.column = Column.NONE
            elif all(near is not None and near.clear_of & mine for near in others):
                self.column = Column.TAKEN
        return self.column == Column.TAKEN

    def rule(self, now_us: int, at: Corner, velocity: Corner) -> Ruling:
        """Whether we may go on with a velocity (north and east, m/s) that we wish for."""
        if self.column == Column.TAKEN:
            return Ruling(True)
        columns = self._columns(now_us)
        for other, near in columns:
            if math.dist(at, near.at) > COLUMN_M:
                if _nearest_m(at, _stop(at, velocity), near.at) <= COLUMN_M:
                    return Ruling(False, other)
            elif self._goes_first(other, near) and not _leads_out(at, velocity, near.at):
                others = [each.at for _, each in columns if math.dist(at, each.at) > COLUMN_M]
                clear = (
                    aside
                    for aside in _outside(at, near.at, self.system)
                    if all(_nearest_m(at, aside, each) > COLUMN_M for each in others)
                )
                return Ruling(False, other, next(clear, None))
        return Ruling(True)

    def _columns(self, now_us: int) -> list[tuple[int, Neighbour]]:
        return [
            (other, near)
            for other, near in sorted(self._others.items())
            if near.column != Column.NONE and now_us - near.heard_us <= COLUMN_LASTS_US
        ]

    def _goes_first(self, other: int, near: Neighbour) -> bool:
        return near.column == Column.TAKEN or self.column == Column.NONE or other < self.system

    def _yields(self, now_us: int, at: Corner) -> bool:
        """Whether a column that goes before ours, or that we have said to keep clear of, is too near to it."""
        return any(
            math.dist(at, near.at) <= COLUMN_M
            and (near.column == Column.TAKEN or other < self.system or self.clear_of & self._bit(other))
            for other, near in self._columns(now_us)
        )

    def _bit(self, system: int) -> int:
        return 1 << self._members.index(system)


def stopping_m(speed_m_s: float) -> float:
    """How far an aircraft still goes when it is to stop."""
    return speed_m_s * REACTION_S + speed_m_s * speed_m_s / (2.0 * SLOWING_M_S2)


def _stop(at: Corner, velocity: Corner) -> Corner:
    """Where an aircraft comes to stand that stops now."""
    speed = math.hypot(*velocity)
    seconds = stopping_m(speed) / speed if speed > 1e-6 else 0.0
    return at[0] + velocity[0] * seconds, at[1] + velocity[1] * seconds


def _nearest_m(at: Corner, to: Corner, place: Corner) -> float:
    """How near a straight way comes to a place."""
    north, east = to[0] - at[0], to[1] - at[1]
    squared = north * north + east * east
    along = ((place[0] - at[0]) * north + (place[1] - at[1]) * east) / squared if squared else 0.0
    along = min(max(along, 0.0), 1.0)
    return math.dist((at[0] + along * north, at[1] + along * east), place)


def _leads_out(at: Corner, velocity: Corner, place: Corner) -> bool:
    away = (at[0] - place[0]) * velocity[0] + (at[1] - place[1]) * velocity[1]
    return math.hypot(*velocity) > WALKING_M_S and away > 0.0


def _outside(at: Corner, place: Corner, system: int) -> list[Corner]:
    """Places well outside of a column, the one straight away from its middle first, then to both sides of that.

    Who stands right on the middle goes north or south.
    """
    north, east = at[0] - place[0], at[1] - place[1]
    away = math.atan2(east, north) if math.hypot(north, east) > 0.1 else math.pi * (system % 2)
    turns = sorted(range(-TURNS // 2 + 1, TURNS // 2 + 1), key=abs)
    angles = [away + turn * math.tau / TURNS for turn in turns]
    reach_m = COLUMN_M + KEEP_M
    return [(place[0] + reach_m * math.cos(angle), place[1] + reach_m * math.sin(angle)) for angle in angles]
