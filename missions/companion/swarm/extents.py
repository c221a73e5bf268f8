"""How far targets reach that are areas: coarse cells of the ground, and which areas are one, or may yet turn out to be.

Cells of `CELL_M` count north and east from an origin that all aircraft of a swarm share; 8 by 8 of them are a `Tile`.
What was once seen of an area stays in its extent, so that tiles may come twice, late or in any order. Areas of one
label are one where their cells meet. Before all is scanned two parts of one area may look like two: they *may be* one
where ground that nobody has scanned yet leads from one to the other.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence

from shapely import Geometry, box
from shapely.prepared import prep

from sitl_emu.missions.companion.swarm.records import Key, Tile

CELL_M = 4.0
"""As far as parts of one region may lie apart (3 m, disaster/regions.py), and what two aircraft's places differ by. So
two areas less than 8 m apart may be taken for one: rather than one for two. Ours."""
SIDE = 8
FARTHEST = 128 * SIDE
"""Cells to each side of the origin that tiles can name: 4 km."""
Cell = tuple[int, int]


def cell_of(north_m: float, east_m: float) -> Cell:
    """The cell of a place, from the swarm's origin; the outermost beyond what tiles can name."""
    row, column = (int(metres // CELL_M) for metres in (north_m, east_m))
    return min(max(row, -FARTHEST), FARTHEST - 1), min(max(column, -FARTHEST), FARTHEST - 1)


def tiles_of(key: Key, cells: Iterable[Cell]) -> list[Tile]:
    """Cells of a sighting as tiles."""
    bits = dict[Cell, int]()
    for row, column in cells:
        place = row // SIDE, column // SIDE
        bits[place] = bits.get(place, 0) | 1 << (row % SIDE * SIDE + column % SIDE)
    return [Tile(key, *place, bits[place]) for place in sorted(bits)]


def cells_of(tile: Tile) -> list[Cell]:
    """The cells of a tile."""
    return [
        (tile.row * SIDE + bit // SIDE, tile.column * SIDE + bit % SIDE)
        for bit in range(SIDE * SIDE)
        if tile.cells >> bit & 1
    ]


def cells_in(area: Geometry) -> frozenset[Cell]:
    """The cells that an area (metres north and east of the origin) has all of."""
    south, west, north, east = (int(metres // CELL_M) for metres in area.bounds)
    within = prep(area)
    return frozenset(
        (row, column)
        for row in range(south, north + 1)
        for column in range(west, east + 1)
        if within.contains(box(row * CELL_M, column * CELL_M, (row + 1) * CELL_M, (column + 1) * CELL_M))
    )


def about(cell: Cell) -> list[Cell]:
    """A cell and the eight around it."""
    row, column = cell
    return [(row + north, column + east) for north in (-1, 0, 1) for east in (-1, 0, 1)]


def joined(extents: Mapping[Key, Collection[Cell]]) -> list[list[Key]]:
    """Which sightings of one label are one area, each group and all groups in order."""
    group = {key: key for key in extents}

    def first(key: Key) -> Key:
        while group[key] != key:
            key = group[key]
        return key

    taken = dict[Cell, Key]()
    for key in sorted(extents):
        for cell in extents[key]:
            for near in about(cell):
                if near in taken:
                    one, other = sorted((first(key), first(taken[near])))
                    group[other] = one
        taken |= dict.fromkeys(extents[key], key)
    groups = dict[Key, list[Key]]()
    for key in sorted(extents):
        groups.setdefault(first(key), []).append(key)
    return [groups[key] for key in sorted(groups)]


def reached(start: Collection[Cell], through: Collection[Cell]) -> set[Cell]:
    """The cells that one can come to from some, through others, all of which meet."""
    found, new = set(start), list(start)
    while new:
        for near in about(new.pop()):
            if near in through and near not in found:
                found.add(near)
                new.append(near)
    return found


def unknown(swaths: Sequence[Collection[Cell]], scanned: Collection[int]) -> set[Cell]:
    """The cells that only lines see which nobody has scanned. `swaths`: of each line the cells of which it sees all."""
    left = {cell for number, swath in enumerate(swaths) if number not in scanned for cell in swath}
    for number in scanned:
        left.difference_update(swaths[number])
    return left
