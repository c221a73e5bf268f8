"""What the aircraft of a swarm tell each other, as bytes: records one after another, each with its kind ahead.

| kind | record | says | bytes |
| --- | --- | --- | --- |
| 1 | `State` | where its sender is and moves to, what it does, whose columns of air it avoids, whom it hears | 25 |
| 2 | `Sighting` | a target that one aircraft has located, with confidence and covariance | 25 |
| 3 | `Claim` | who is to serve it | 10 |
| 4 | `Covered` | which lines of the area have been scanned | 11 |
| 5 | `Tile` | how far a target reaches that is an area (`extents.py`) | 15 |

All but `State` may be passed on by who has heard them. Who packs loses what the wire does not carry (a centimetre, a
tenth of a second): `as_sent` gives what all others will have, so that all reckon with the same figures. The format is
that of `seal.VERSION`; a content that is not wholly understood is refused as a whole.
"""

import math
import struct
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple, TypeVar

from sitl_emu.missions.companion.swarm.seal import CONTENT_BYTES

LINES_OF_A_RECORD = 64
LARGEST_COST_S = 6553.5
Key = tuple[int, int]
"""A sighting: the system that made it, and its number there."""


class Doing(IntEnum):
    """What an aircraft does."""

    WAITING = 0
    SCANNING = 1
    ENGAGING = 2
    DELIVERING = 3
    RETURNING = 4
    OUT = 5
    """It takes no more part: aborted, or landed for good. Its work is free."""


class Column(IntEnum):
    """Whether an aircraft moves up and down through the heights of others, where it is."""

    NONE = 0
    ASKED = 1
    TAKEN = 2


class Stage(IntEnum):
    """How far a claim is; what is further counts for more."""

    FREE = 0
    BID = 1
    ENGAGED = 2
    SERVED = 3


class State(NamedTuple):
    """Of the sender itself."""

    doing: Doing
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    v_north: float
    v_east: float
    v_down: float
    column: Column = Column.NONE
    clear_of: int = 0
    """Whose columns it keeps out of: bits, the lowest is the first member's."""
    hears: int = 0
    """Whom it has heard of late, in the same way."""


class Sighting(NamedTuple):
    """A target as one aircraft has located it; a later `revision` takes the place of an earlier."""

    key: Key
    revision: int
    label: int
    """Index in the list of all labels that the detector of the mission's aircraft knows, whatever each looks for."""
    confidence: float
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    sigma_north_m: float
    sigma_east_m: float
    correlation: float
    """Between the two, in -1 to 1."""


class Claim(NamedTuple):
    """Who serves a target, at which round (`claims.py`)."""

    key: Key
    round: int
    stage: Stage
    owner: int
    cost_s: float


class Covered(NamedTuple):
    """Of `LINES_OF_A_RECORD` lines from `first` on those that have been scanned, the lowest bit the first."""

    first: int
    lines: int


class Tile(NamedTuple):
    """Of 8 by 8 cells of the ground those in which a sighting's area has something, the lowest bit the southwestern."""

    key: Key
    row: int
    column: int
    """Northwards and eastwards from the swarm's origin, in tiles."""
    cells: int


Record = State | Sighting | Claim | Covered | Tile
One = TypeVar("One", bound=Record)
_STATE, _SIGHTING, _CLAIM, _COVERED, _TILE = (
    struct.Struct(f"<B{form}") for form in ("BiiihhhBHH", "BHHBBiiieeb", "BHHBBH", "HQ", "BHbbQ")
)
_STEPS = 127


def packed(record: Record) -> bytes:
    """As it goes over the air; figures beyond what the wire holds end there."""
    if isinstance(record, State):
        velocity = (_whole(v * 100.0, 16) for v in (record.v_north, record.v_east, record.v_down))
        place = _place(record.lat_deg, record.lon_deg, record.alt_amsl_m)
        return _STATE.pack(1, record.doing, *place, *velocity, record.column, record.clear_of, record.hears)
    if isinstance(record, Sighting):
        sigmas = (min(max(sigma_m, 0.01), 60000.0) for sigma_m in (record.sigma_north_m, record.sigma_east_m))
        confidence = min(max(round(record.confidence * 255.0), 0), 255)
        place = _place(record.lat_deg, record.lon_deg, record.alt_amsl_m)
        shared = min(max(round(record.correlation * _STEPS), 1 - _STEPS), _STEPS - 1)
        return _SIGHTING.pack(2, *record.key, record.revision, record.label, confidence, *place, *sigmas, shared)
    if isinstance(record, Claim):
        cost = round(min(max(record.cost_s, 0.0), LARGEST_COST_S) * 10.0)
        return _CLAIM.pack(3, *record.key, record.round, record.stage, record.owner, cost)
    if isinstance(record, Covered):
        return _COVERED.pack(4, *record)
    return _TILE.pack(5, *record.key, record.row, record.column, record.cells)


def as_sent(record: One) -> One:
    """A record as its receivers have it."""
    sent, _ = _unpacked(packed(record), 0)
    assert isinstance(sent, type(record))
    return sent


def parsed(content: bytes) -> list[Record] | None:
    """The records of a content; None where it has no sense."""
    records, at = list[Record](), 0
    while at < len(content):
        try:
            record, at = _unpacked(content, at)
        except (ValueError, KeyError, struct.error):
            return None
        records.append(record)
    return records


def filled(records: Iterable[Record], most_bytes: int = CONTENT_BYTES) -> tuple[bytes, list[Record]]:
    """As many records as one broadcast holds, in their order, those left out that do not fit; and which they are."""
    content, taken = b"", list[Record]()
    for record in records:
        more = packed(record)
        if len(content) + len(more) <= most_bytes:
            content += more
            taken.append(record)
    return content, taken


def _unpacked(content: bytes, at: int) -> tuple[Record, int]:
    """The record that begins at a byte, and where it ends. Raises ValueError, KeyError and struct.error."""
    form = {1: _STATE, 2: _SIGHTING, 3: _CLAIM, 4: _COVERED, 5: _TILE}[content[at]]
    _, *fields = form.unpack_from(content, at)
    record: Record
    if form is _STATE:
        doing, lat, lon, alt, north, east, down, column, clear_of, hears = fields
        moves = (north / 100.0, east / 100.0, down / 100.0)
        record = State(Doing(doing), *_degrees(lat, lon), alt / 100.0, *moves, Column(column), clear_of, hears)
    elif form is _SIGHTING:
        system, number, revision, label, confidence, lat, lon, alt, north, east, shared = fields
        if not (math.isfinite(north) and math.isfinite(east) and north > 0.0 < east and abs(shared) < _STEPS):
            raise ValueError("no covariance")
        place = (*_degrees(lat, lon), alt / 100.0)
        key = (system, number)
        record = Sighting(key, revision, label, confidence / 255.0, *place, north, east, shared / _STEPS)
    elif form is _CLAIM:
        system, number, turn, stage, owner, cost = fields
        record = Claim((system, number), turn, Stage(stage), owner, cost / 10.0)
    elif form is _COVERED:
        record = Covered(*fields)
    else:
        system, number, row, column, cells = fields
        record = Tile((system, number), row, column, cells)
    return record, at + form.size


def _place(lat_deg: float, lon_deg: float, alt_m: float) -> tuple[int, int, int]:
    return _whole(lat_deg * 1e7, 32), _whole(lon_deg * 1e7, 32), _whole(alt_m * 100.0, 32)


def _degrees(lat: int, lon: int) -> tuple[float, float]:
    """Raises ValueError for what is not on Earth."""
    if abs(lat) > 900_000_000 or abs(lon) > 1_800_000_000:
        raise ValueError("no place")
    return lat * 1e-7, lon * 1e-7


def _whole(value: float, bits: int) -> int:
    most = (1 << (bits - 1)) - 1
    return min(max(round(value), -most), most)
