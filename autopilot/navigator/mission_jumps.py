"""A mission's DO_JUMP items: what is flown instead of one, and which places lie ahead.

PX4's MissionBase (getNonJumpItem, findNextPositionIndex; src/modules/navigator/mission_base.cpp, v1.18). A jump that is
used up leads to the item behind it. Where that would be behind the last one PX4 finds nothing to read and says so each
time that it looks there: once for each look ahead, and when the mission ends.
"""

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.navigator.mission_block import WITH_POSITION
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.core import dialect as mavlink

DO_JUMP = mavlink.MAV_CMD_DO_JUMP
MAX_JUMP_ITERATION = 10
"""So many jumps in a row are followed."""


class Jumps:
    """Knows how often each jump was followed."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._done: dict[int, int] = {}
        self.followed = -1
        """The DO_JUMP item that was followed last, until it is told; else -1."""

    def forget(self) -> None:
        """All jumps are to be followed as often as they say."""
        self._done.clear()

    def behind(self, seq: int, *, follow: bool = False) -> int | None:
        """The item that is flown instead of `seq`; None where the mission ends. Jumps that are followed count."""
        items = self._state.dataman.mission.items
        if not 0 <= seq < len(items):
            return None
        for _ in range(MAX_JUMP_ITERATION):
            if seq == len(items):
                self._state.say(Severity.CRITICAL, "Waypoint could not be read.\t", "mission_failed_to_read_wp", seq)
                return None
            jump = items[seq]
            if jump.command != DO_JUMP:
                return seq
            target, done = int(jump.param1), self._done.get(seq, 0)
            if not 0 <= target < len(items):
                return None
            if done >= jump.param2:
                seq += 1
                continue
            if follow:
                self._done[seq] = done + 1
                self.followed = seq
            seq = target
        return None

    def places(self, seq: int, count: int) -> list[int]:
        """The first items with a position from `seq` on, behind jumps and what is carried out on the way."""
        items, found = self._state.dataman.mission.items, list[int]()
        for _ in range(count * len(items)):
            place = self.behind(seq)
            if place is None:
                break
            if items[place].command in WITH_POSITION:
                found.append(place)
                if len(found) == count:
                    break
            seq = place + 1
        return found
