"""What the autopilot keeps of plans, from flight to flight: mission, fence and rally points (PX4's dataman).

Writers: mavlink/services/mission.py (uploads, clears) and the navigator (current item). Readers: both. The file
`dataman` in the instance's folder is ours, not PX4's: three plans and the current item, with a checksum. Without a
folder all is kept in memory, as by PX4 without a card.
"""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.storage import storage

MISSION, FENCE, RALLY = 0, 1, 2
"""MAV_MISSION_TYPE."""
ALL_ZERO = 0xFFFFFFFF
"""PX4's CRC-32 begins at zero and is not inverted; zlib's is inverted at both ends."""
MAGIC = b"sitl-emu dataman 1\n"
HEAD = struct.Struct("<i")
PLAN_HEAD = struct.Struct("<IH")
STORED_ITEM = struct.Struct("<HBHB4fiif")
CHECKSUM = struct.Struct("<I")


class MissionItem(NamedTuple):
    """One MISSION_ITEM_INT as it was uploaded; `x` and `y` are 1e-7 deg in global frames."""

    seq: int
    frame: int
    command: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

    @property
    def lat_deg(self) -> float:
        """Latitude of an item in a global frame."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude of an item in a global frame."""
        return self.y * 1e-7


class Plan(NamedTuple):
    """The items of one MAV_MISSION_TYPE and their opaque id: a CRC-32 of the upload, 0 of an empty plan."""

    items: tuple[MissionItem, ...] = ()
    opaque_id: int = 0


def crc32_part(data: bytes, crc: int = 0) -> int:
    """PX4's crc32part: goes on from `crc`, which is 0 at the start."""
    return zlib.crc32(data, crc ^ ALL_ZERO) ^ ALL_ZERO


class Dataman:
    """The three plans and the mission's current item."""

    def __init__(
        self, root: Path | None = None, say: Callable[[Severity, str], None] = lambda severity, text: None
    ) -> None:
        """Reads what the instance's folder `root` holds; `say` tells the ground of trouble."""
        self.plans: dict[int, Plan] = dict.fromkeys((MISSION, FENCE, RALLY), Plan())
        self.current_seq = 0
        self.told_seq = 0
        """The item that the ground takes for the current one: what it has chosen itself, or was told last."""
        self._path = None if root is None else root / storage.DATAMAN
        self._say = say
        self._packed = {kind: pack_plan(plan) for kind, plan in self.plans.items()}
        self._read()
        self.told_seq = self._saved_seq = self.current_seq

    @property
    def mission(self) -> Plan:
        """What AUTO_MISSION flies."""
        return self.plans[MISSION]

    @property
    def fence(self) -> Plan:
        """Where to fly, and where not."""
        return self.plans[FENCE]

    @property
    def rally(self) -> Plan:
        """Where a return may end."""
        return self.plans[RALLY]

    def store(self, kind: int, plan: Plan, current_seq: int) -> bool:
        """Replace a plan; False, and nothing is changed, if it can't be written."""
        packed = {**self._packed, kind: pack_plan(plan)}
        if not self._write(packed, current_seq):
            return False
        self._packed = packed
        self.plans[kind] = plan
        self.current_seq = self._saved_seq = current_seq
        return True

    def save_progress(self) -> None:
        """Write down the current item if it is another one than before."""
        if self.current_seq != self._saved_seq:
            self._saved_seq = self.current_seq
            self._write(self._packed, self.current_seq)

    def _write(self, packed: dict[int, bytes], current_seq: int) -> bool:
        if self._path is None:
            return True
        content = b"".join((MAGIC, HEAD.pack(current_seq), *packed.values()))
        try:
            storage.write(self._path, content + CHECKSUM.pack(zlib.crc32(content)))
        except OSError:
            return False
        return True

    def _read(self) -> None:
        if self._path is None:
            return
        try:
            content = self._path.read_bytes()
        except FileNotFoundError:
            self._write(self._packed, self.current_seq)  # as PX4 does, so that the file is there from the start
            return
        except OSError as error:
            self._say(Severity.CRITICAL, f"Missions not loaded: {self._path.name}: {error.strerror}")
            return
        body, checksum = content[: -CHECKSUM.size], content[-CHECKSUM.size :]
        if not body.startswith(MAGIC) or CHECKSUM.pack(zlib.crc32(body)) != checksum:
            self._say(Severity.CRITICAL, f"Missions not loaded: {self._path.name} is damaged")
            return
        (self.current_seq,) = HEAD.unpack_from(body, len(MAGIC))
        place = len(MAGIC) + HEAD.size
        for kind in self.plans:
            start = place
            opaque_id, count = PLAN_HEAD.unpack_from(body, place)
            place += PLAN_HEAD.size + count * STORED_ITEM.size
            items = STORED_ITEM.iter_unpack(body[start + PLAN_HEAD.size : place])
            self.plans[kind] = Plan(tuple(MissionItem(*fields) for fields in items), opaque_id)
            self._packed[kind] = body[start:place]


def pack_plan(plan: Plan) -> bytes:
    """A plan as the file has it."""
    return PLAN_HEAD.pack(plan.opaque_id, len(plan.items)) + b"".join(STORED_ITEM.pack(*item) for item in plan.items)
