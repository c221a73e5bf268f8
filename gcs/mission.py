"""The mission protocol's client half: upload, download, clear, set current; for missions, fences and rally points.

Source: https://mavlink.io/en/services/mission.html and PX4 v1.18 as measured (mission/*). In an upload the autopilot
leads: it asks for every item, again after 0.25 s, and gives up after 5 s; we answer every request and repeat only what
nobody else would: MISSION_COUNT until the first request, and the last item until the ack (PX4 acknowledges that one
again). In a download we lead: each request is repeated after 0.25 s. A transfer that the other side gave up, or that
stood still for 6 s, begins anew from the start, `tries` times: with 30 % loss each way a one-item transfer still
arrives. One that is refused since the other side is busy begins anew once that may have changed. Items travel as
MISSION_ITEM_INT only; partial lists are not supported (PX4 does not either).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink

MISSION, FENCE, RALLY = 0, 1, 2
ALL_TYPES = 255

COUNT_TIMEOUT_US = 500_000
ITEM_TIMEOUT_US = 250_000
STALLED_US = 6_000_000
TRIES = 5
CLEAR_TRIES = 24
"""So many, COUNT_TIMEOUT_US apart, that it is still asked when PX4 has forgotten a transfer that nobody ended."""
BUSY_US = (500_000, 2_000_000, STALLED_US)
"""How long after each try that found the other side busy the next one begins; the last of them stays. Somebody's
transfer takes a second or two; one that nobody ends is forgotten after 5 s, and PX4 counts those from the last
MISSION_COUNT, also from ours (mavlink_mission.cpp: handle_mission_count), so that it must hear none for longer."""

ACCEPTED = 0
RESULTS = {
    1: "error",
    2: "unsupported frame",
    3: "unsupported item",
    4: "no space",
    5: "invalid item",
    6: "invalid param1",
    7: "invalid param2",
    8: "invalid param3",
    9: "invalid param4",
    10: "invalid x or param5",
    11: "invalid y or param6",
    12: "invalid z or param7",
    13: "item out of sequence",
    14: "denied",
    15: "cancelled",
}
TRANSIENT = (1, 13, 15)
"""Results after which beginning anew may help: the autopilot was busy, lost count, or gave up waiting."""


class MissionItem(NamedTuple):
    """One item as it travels in MISSION_ITEM_INT; `x` and `y` are 1e-7 deg where the frame is a global one."""

    frame: int
    command: int
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1


class MissionOutcome(NamedTuple):
    """How a transfer ended. `result` is the MAV_MISSION_RESULT, None when nobody answered."""

    accepted: bool
    result: int | None
    text: str


def _outcome(result: int) -> MissionOutcome:
    return MissionOutcome(
        result == ACCEPTED, result, "accepted" if result == ACCEPTED else RESULTS.get(result, str(result))
    )


class _Transfer:
    """What all transfers share: the partner, the limits, the outcome."""

    def __init__(self, target_system: int, mission_type: int, target_component: int = 1, tries: int = TRIES) -> None:
        self.target = (target_system, target_component)
        self.mission_type = mission_type
        self.tries = tries
        self.tried = 0
        self.outcome: MissionOutcome | None = None
        self._due_us = 0
        self._heard_us = 0

    @property
    def done(self) -> bool:
        """True when it ended."""
        return self.outcome is not None

    def _is_mine(self, msg: mavlink.MAVLink_message) -> bool:
        return (
            self.outcome is None
            and self.tried > 0
            and (msg.get_srcSystem(), msg.get_srcComponent()) == self.target
            and getattr(msg, "mission_type", None) == self.mission_type
        )

    def _anew(self, now_us: int) -> bool:
        """Counts a try; False (and the outcome set) when there is none left."""
        if self.tried >= self.tries:
            self.outcome = MissionOutcome(False, None, f"no answer in {self.tries} tries")
            return False
        self.tried += 1
        self._heard_us = now_us
        return True

    def _is_put_off(self, now_us: int, result: int) -> bool:
        """Whether a refusal is for now: the next try begins in a while, and nothing is sent until then."""
        if result not in TRANSIENT or self.tried >= self.tries:
            return False
        self._due_us = now_us + BUSY_US[min(self.tried, len(BUSY_US)) - 1]
        self._heard_us = self._due_us - STALLED_US
        return True


class MissionUpload(_Transfer):
    """Uploads items; `outcome` when it was accepted, refused or given up, `progress` in 0..1."""

    def __init__(
        self,
        target_system: int,
        items: Sequence[MissionItem],
        mission_type: int = MISSION,
        target_component: int = 1,
        tries: int = TRIES,
    ) -> None:
        super().__init__(target_system, mission_type, target_component, tries)
        self.items = tuple(items)
        self._asked: int | None = None

    @property
    def progress(self) -> float:
        """Share of the items that were asked for."""
        if self.outcome is not None and self.outcome.accepted:
            return 1.0
        return 0.0 if self._asked is None else self._asked / max(1, len(self.items))

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Answers requests for items, hears the ack."""
        if not self._is_mine(msg):
            return []
        kind = msg.get_type()
        if kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            of_before = self._asked is None and msg.seq > 0  # in a transfer whose first items were others
            if of_before or msg.seq >= len(self.items):
                return []
            self._heard_us = now_us
            self._asked = msg.seq
            self._due_us = now_us + COUNT_TIMEOUT_US
            return [self._item(msg.seq)]
        if kind == "MISSION_ACK":
            last_asked = self._asked == len(self.items) - 1 or not self.items
            if msg.type == ACCEPTED and not last_asked:
                return []  # an ack of an earlier transfer that came late
            if self._is_put_off(now_us, msg.type):
                self._asked = None
            else:
                self.outcome = _outcome(msg.type)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends MISSION_COUNT until the first request came, and the last item until the ack came."""
        if self.outcome is not None:
            return []
        if self.tried == 0 or now_us - self._heard_us >= STALLED_US:
            if not self._anew(now_us):
                return []
            self._asked = None
            self._due_us = now_us
        if now_us < self._due_us:
            return []
        self._due_us = now_us + COUNT_TIMEOUT_US
        if self._asked is None:
            return [mavlink.MAVLink_mission_count_message(*self.target, len(self.items), self.mission_type)]
        if self._asked == len(self.items) - 1:
            return [self._item(self._asked)]
        return []

    def _item(self, seq: int) -> mavlink.MAVLink_message:
        item = self.items[seq]
        current = int(seq == 0 and self.mission_type == MISSION)
        fields: list[Any] = [*self.target, seq, item.frame, item.command, current, item.autocontinue, *item[2:9]]
        fields.append(self.mission_type)
        return mavlink.MAVLink_mission_item_int_message(*fields)


class MissionDownload(_Transfer):
    """Downloads items into `items`; `outcome` when all are there, refused or given up."""

    def __init__(
        self, target_system: int, mission_type: int = MISSION, target_component: int = 1, tries: int = TRIES
    ) -> None:
        super().__init__(target_system, mission_type, target_component, tries)
        self.items: list[MissionItem] = []
        self.count: int | None = None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes the count and the items, asks for the next one, ends with our ack."""
        if not self._is_mine(msg):
            return []
        kind = msg.get_type()
        if kind == "MISSION_COUNT" and self.count is None:
            self.count = msg.count
        elif kind == "MISSION_ITEM_INT" and self.count is not None and msg.seq == len(self.items):
            self.items.append(
                MissionItem(
                    msg.frame,
                    msg.command,
                    msg.param1,
                    msg.param2,
                    msg.param3,
                    msg.param4,
                    msg.x,
                    msg.y,
                    msg.z,
                    msg.autocontinue,
                )
            )
        elif kind == "MISSION_ACK" and msg.type != ACCEPTED:
            if not self._is_put_off(now_us, msg.type):
                self.outcome = _outcome(msg.type)
            return []
        else:
            return []
        self._heard_us = now_us
        if len(self.items) == self.count:
            self.outcome = _outcome(ACCEPTED)
            return [mavlink.MAVLink_mission_ack_message(*self.target, ACCEPTED, self.mission_type)]
        self._due_us = now_us
        return self.on_time(now_us)

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for the list or the next item, again after each time limit."""
        if self.outcome is not None:
            return []
        if self.tried == 0 or now_us - self._heard_us >= STALLED_US:
            if not self._anew(now_us):
                return []
            self.count = None
            self.items.clear()
            self._due_us = now_us
        if now_us < self._due_us:
            return []
        if self.count is None:
            self._due_us = now_us + COUNT_TIMEOUT_US
            return [mavlink.MAVLink_mission_request_list_message(*self.target, self.mission_type)]
        self._due_us = now_us + ITEM_TIMEOUT_US
        return [mavlink.MAVLink_mission_request_int_message(*self.target, len(self.items), self.mission_type)]


class MissionClear(_Transfer):
    """Clears the items of a type (or `ALL_TYPES`)."""

    def __init__(
        self, target_system: int, mission_type: int = MISSION, target_component: int = 1, tries: int = CLEAR_TRIES
    ) -> None:
        super().__init__(target_system, mission_type, target_component, tries)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the ack."""
        if self._is_mine(msg) and msg.get_type() == "MISSION_ACK":
            self.outcome = _outcome(msg.type)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends MISSION_CLEAR_ALL, again after each time limit."""
        if self.outcome is not None or (self.tried and now_us < self._due_us) or not self._anew(now_us):
            return []
        self._due_us = now_us + COUNT_TIMEOUT_US
        return [mavlink.MAVLink_mission_clear_all_message(*self.target, self.mission_type)]


class MissionSetCurrent(_Transfer):
    """Makes an item the current one, until MISSION_CURRENT says that it is."""

    def __init__(self, target_system: int, seq: int, target_component: int = 1, tries: int = 10) -> None:
        super().__init__(target_system, MISSION, target_component, tries)
        self.seq = seq

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears MISSION_CURRENT."""
        if (
            self.outcome is None
            and self.tried
            and msg.get_type() == "MISSION_CURRENT"
            and (msg.get_srcSystem(), msg.get_srcComponent()) == self.target
            and msg.seq == self.seq
        ):
            self.outcome = _outcome(ACCEPTED)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends MISSION_SET_CURRENT, again after each time limit."""
        if self.outcome is not None or (self.tried and now_us < self._due_us) or not self._anew(now_us):
            return []
        self._due_us = now_us + 1_500_000  # MISSION_CURRENT comes once a second at least
        return [mavlink.MAVLink_mission_set_current_message(*self.target, self.seq)]
