"""Mission protocol for mission, fence and rally points (https://mavlink.io/en/services/mission.html).

As PX4's mavlink_mission.cpp: one transfer at a time per link, and one upload at a time in all. An upload asks for one
item after the other, again every 250 ms, and gives up after 5 s; a plan replaces the old one only when it is complete,
any failure leaves the old one. Items are kept in GLOBAL_INT and GLOBAL_RELATIVE_ALT_INT. Partial lists are ignored, as
PX4 does. Every answer goes out in the datagram's own moment, so that a transfer runs as fast as the other side asks.
"""

from collections.abc import Callable
from typing import Any

from autopilot.constants import Severity
from autopilot.dataman import Dataman, MissionItem, Plan, plan_of
from autopilot.mavlink.link import Link
from autopilot.mavlink.services import mission_items
from autopilot.mavlink.services.service import is_for
from autopilot.texts import Texts
from autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
"""MAV_MISSION_TYPE."""
MAX_ITEMS = {MISSION: 10_000, FENCE: 64, RALLY: 32}
RETRY_US = 250_000
TIMEOUT_US = 5_000_000
REACHED_EVERY_US, REACHED_REPEATS = 1_000_000, 10
"""MISSION_ITEM_REACHED is said again, as it may be lost on the way."""
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
ERROR = mavlink.MAV_MISSION_ERROR
NO_SPACE = mavlink.MAV_MISSION_NO_SPACE
Partner = tuple[int, int]


class Transfer:
    """What one link is busy with; `items` grows in an upload, is the plan in a download."""

    def __init__(self, partner: Partner, kind: int, count: int, now_us: int) -> None:
        self.partner, self.kind, self.count = partner, kind, count
        self.items: list[MissionItem] = []
        self.last_heard_us = self.last_sent_us = now_us
        self.sequence = 0


class Upload(Transfer):
    """Items come in."""


class Download(Transfer):
    """Items go out."""

    def __init__(self, partner: Partner, kind: int, plan: Plan, now_us: int) -> None:
        super().__init__(partner, kind, len(plan.items), now_us)
        self.items = list(plan.items)


class Mission:
    """The plans' service; `set_current` and `plan_changed` are wired to the navigator."""

    MESSAGES = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_MISSION_COUNT,
            mavlink.MAVLINK_MSG_ID_MISSION_ITEM,
            mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
            mavlink.MAVLINK_MSG_ID_MISSION_ACK,
            mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
            mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT,
        }
    )
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], topics: Topics, dataman: Dataman, texts: Texts, system_id: int) -> None:
        """Writes plans into `dataman`."""
        self.set_current: Callable[[int, int], bool] | None = None
        """Navigator's (now_us, seq) -> done, for MISSION_SET_CURRENT; without it dataman.current_seq is written."""
        self.plan_changed: Callable[[int], None] | None = None
        """Navigator's (now_us): so that a mission can be started in the moment in which its upload is acknowledged."""
        self._links = links
        self._topics = topics
        self._dataman = dataman
        self._texts = texts
        self._system_id = system_id
        self._transfers: dict[Link, Transfer] = {}
        self._integer: dict[Link, bool] = {}
        self._last_count: dict[Link, int] = {}
        self._reached_us = 0
        self._reached_repeats = 0
        self._repeat_due_us = 0
        self._current = (0, 0, 0)
        self._handlers = {
            mavlink.MAVLINK_MSG_ID_MISSION_COUNT: self._on_count,
            mavlink.MAVLINK_MSG_ID_MISSION_ITEM: self._on_item,
            mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT: self._on_item,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST: self._on_request,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT: self._on_request,
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: self._on_request_list,
            mavlink.MAVLINK_MSG_ID_MISSION_ACK: self._on_ack,
            mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: self._on_clear_all,
            mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT: self._on_set_current,
        }

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Only what is for us."""
        if is_for(message, self._system_id, broadcast=True):
            self._handlers[message.get_msgId()](now_us, message, link)

    def on_time(self, now_us: int) -> None:
        """Ask again, give up, and tell what the navigator reached."""
        for link, transfer in list(self._transfers.items()):
            if now_us - transfer.last_heard_us >= TIMEOUT_US:
                del self._transfers[link]
                if isinstance(transfer, Upload):
                    self._say("Operation timeout\t")
            elif isinstance(transfer, Upload) and now_us - transfer.last_sent_us >= RETRY_US:
                self._request(now_us, transfer, link)
        result = self._topics.mission_result
        due = now_us >= self._repeat_due_us
        if due:
            self._repeat_due_us = now_us + REACHED_EVERY_US
        if result.seq_reached_timestamp != self._reached_us:
            self._reached_us = result.seq_reached_timestamp
            self._reached_repeats = REACHED_REPEATS
            self._tell_reached(result.seq_reached)
        elif due and self._reached_repeats:
            self._reached_repeats -= 1
            self._tell_reached(result.seq_reached)
        current = (self._dataman.current_seq, self._dataman.mission.opaque_id, result.mission_state)
        if current != self._current:
            self._current = current
            for link in self._links:
                link.hurry(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def _tell_reached(self, seq: int) -> None:
        if seq >= 0:
            for link in self._links:
                link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_ITEM_REACHED, seq)

    # --- upload ------------------------------------------------------------------------------------------

    def _on_count(self, now_us: int, message: Any, link: Link) -> None:
        partner, kind, count = _partner(message), message.mission_type, message.count
        transfer = self._transfers.get(link)
        if transfer is not None and not self._may_restart(transfer, partner, kind, count):
            self._say("WPM: REJ. CMD: Busy\t")
            self._ack(link, partner, ERROR, kind)
            return
        if any(isinstance(other, Upload) for busy, other in self._transfers.items() if busy is not link):
            self._ack(link, partner, ERROR, kind)
            return
        if kind not in MAX_ITEMS or count > MAX_ITEMS[kind]:
            self._ack(link, partner, NO_SPACE, kind)
            return
        if count == 0:
            self._transfers.pop(link, None)
            self._store(now_us, kind, ())
            self._ack(link, partner, ACCEPTED, kind)
            return
        upload = self._transfers[link] = Upload(partner, kind, count, now_us)
        self._request(now_us, upload, link)

    @staticmethod
    def _may_restart(transfer: Transfer, partner: Partner, kind: int, count: int) -> bool:
        if transfer.partner != partner or transfer.kind != kind:
            return False
        return isinstance(transfer, Download) or (not transfer.items and transfer.count == count)

    def _request(self, now_us: int, upload: Transfer, link: Link) -> None:
        upload.last_sent_us = now_us
        link.send_fields(
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT
            if self._integer.get(link, True)
            else mavlink.MAVLINK_MSG_ID_MISSION_REQUEST,
            len(upload.items),
            *upload.partner,
            upload.kind,
        )

    def _on_item(self, now_us: int, message: Any, link: Link) -> None:
        self._integer[link] = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
        upload = self._transfers.get(link)
        partner = _partner(message)
        if not isinstance(upload, Upload):
            if upload is None and message.seq + 1 == self._last_count.get(link):
                self._ack(link, partner, ACCEPTED, message.mission_type)
            else:
                self._say("IGN MISSION_ITEM: No transfer\t")
                self._ack(link, partner, ERROR, message.mission_type)
            return
        if partner != upload.partner or message.mission_type != upload.kind:
            return
        upload.last_heard_us = now_us
        if message.seq != len(upload.items):
            return
        item, error = mission_items.parse(message, upload.kind)
        if item is None:
            del self._transfers[link]
            self._say("IGN MISSION_ITEM: Invalid item\t")
            self._ack(link, partner, error, upload.kind)
            return
        upload.items.append(item)
        if len(upload.items) < upload.count:
            self._request(now_us, upload, link)
            return
        del self._transfers[link]
        self._last_count[link] = upload.count
        items = tuple(upload.items)
        self._store(now_us, upload.kind, items)
        self._ack(link, partner, ACCEPTED, upload.kind)

    def _store(self, now_us: int, kind: int, items: tuple[MissionItem, ...]) -> None:
        plan = plan_of(items)
        if kind == MISSION:
            self._dataman.mission = plan
            self._dataman.current_seq = 0
        elif kind == FENCE:
            self._dataman.fence = plan
        else:
            self._dataman.rally = plan
        if self.plan_changed is not None:
            self.plan_changed(now_us)

    # --- download ----------------------------------------------------------------------------------------

    def _on_request_list(self, now_us: int, message: Any, link: Link) -> None:
        partner, kind = _partner(message), message.mission_type
        transfer = self._transfers.get(link)
        if isinstance(transfer, Upload) or (transfer is not None and transfer.partner != partner):
            self._say("WPM: REJ. CMD: Busy\t")
            self._ack(link, partner, ERROR, kind)
            return
        if kind not in MAX_ITEMS:
            self._ack(link, partner, mavlink.MAV_MISSION_UNSUPPORTED, kind)
            return
        plan = self._plan(kind)
        if plan.items:
            self._transfers[link] = Download(partner, kind, plan, now_us)
        fields = (len(plan.items), *partner, kind, plan.opaque_id)
        link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_COUNT, *fields)

    def _on_request(self, now_us: int, message: Any, link: Link) -> None:
        self._integer[link] = integer = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT
        download = self._transfers.get(link)
        partner = _partner(message)
        if not isinstance(download, Download) or download.partner != partner:
            return
        if message.mission_type != download.kind:
            return
        download.last_heard_us = now_us
        if message.seq not in (download.sequence, download.sequence - 1) or message.seq >= download.count:
            del self._transfers[link]
            self._say("WPM: REJ. CMD: Req. WP was unexpected\t")
            self._ack(link, partner, ERROR, download.kind)
            return
        download.sequence = message.seq + 1
        self._send_item(link, partner, download.items[message.seq], download.kind, integer)

    def _send_item(self, link: Link, partner: Partner, item: MissionItem, kind: int, integer: bool) -> None:
        current = 1 if item.seq == (self._dataman.current_seq if kind == MISSION else 0) else 0
        params = (item.param1, item.param2, item.param3, item.param4)
        tail = (item.seq, item.command, *partner)
        if integer:
            frame = item.frame
            message_id = mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
            position: tuple[float, ...] = (item.x, item.y, item.z)
        else:
            frame = mission_items.FLOAT_FRAME.get(item.frame, item.frame)
            message_id = mavlink.MAVLINK_MSG_ID_MISSION_ITEM
            position = mission_items.float_position(item)
        link.send_fields(message_id, *params, *position, *tail, frame, current, item.autocontinue, kind)

    # --- the rest ----------------------------------------------------------------------------------------

    def _on_ack(self, now_us: int, message: Any, link: Link) -> None:
        transfer = self._transfers.get(link)
        if transfer is None or transfer.partner != _partner(message):
            return
        if isinstance(transfer, Download) or message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            del self._transfers[link]
        elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:
            self._integer[link] = True
            self._request(now_us, transfer, link)

    def _on_clear_all(self, now_us: int, message: Any, link: Link) -> None:
        partner, kind = _partner(message), message.mission_type
        if link in self._transfers:
            self._say("WPM: CLEAR CMD: Busy\t")
            return
        for each in MAX_ITEMS if kind == ALL else (kind,):
            if each in MAX_ITEMS:
                self._store(now_us, each, ())
        self._ack(link, partner, ACCEPTED, kind)

    def _on_set_current(self, now_us: int, message: Any, link: Link) -> None:
        sequence = message.seq
        if sequence >= len(self._dataman.mission.items):
            self._say("WPM: WP CURR CMD: Not in list\t")
        elif self.set_current is not None:
            self.set_current(now_us, sequence)
        else:
            self._dataman.current_seq = sequence

    def _plan(self, kind: int) -> Plan:
        if kind == MISSION:
            return self._dataman.mission
        return self._dataman.fence if kind == FENCE else self._dataman.rally

    def _ack(self, link: Link, partner: Partner, result: int, kind: int) -> None:
        opaque_id = self._plan(kind).opaque_id if kind in MAX_ITEMS and result == ACCEPTED else 0
        link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_ACK, *partner, result, kind, opaque_id)

    def _say(self, text: str) -> None:
        self._texts.say(Severity.CRITICAL, text, "mavlink")


def _partner(message: Any) -> Partner:
    return message.get_srcSystem(), message.get_srcComponent()
