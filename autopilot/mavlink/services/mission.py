"""Mission protocol for mission, fence and rally points (https://mavlink.io/en/services/mission.html).

As PX4 v1.18's mavlink_mission.cpp: each link has a manager with one transfer at a time, and among all links there is
one upload at a time. An upload asks for one item after the other, again every 250 ms; a download says how many items
there are as often until the first is asked for; any transfer is given up after 5 s of silence. A plan replaces the old
one only when it is complete and another one than before; any failure leaves the old one. Partial lists are ignored.
Every answer goes out in the datagram's own moment, so that a transfer runs as fast as the other side asks.
"""

from collections.abc import Callable
from enum import Enum
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say, Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services import mission_items
from sitl_emu.autopilot.storage.dataman import FENCE, MISSION, RALLY, Dataman, MissionItem, Plan, crc32_part
from sitl_emu.autopilot.topics import Topics
from sitl_emu.autopilot.vehicle_kind import Traits
from sitl_emu.core import dialect as mavlink

ALL_TYPES: Final = 255
MAX_ITEMS = {MISSION: 10_000, FENCE: 64, RALLY: 32}
MISSION_PLANNER: Final = 190
"""A component id that PX4 takes for its own in this protocol."""
RETRY_US: Final = 250_000
"""MAVLINK_MISSION_RETRY_TIMEOUT_DEFAULT."""
TIMEOUT_US: Final = 5_000_000
"""MAVLINK_MISSION_PROTOCOL_TIMEOUT_DEFAULT."""
REACHED_EVERY_US, REACHED_REPEATS = 1_000_000, 10
"""MISSION_ITEM_REACHED is said again, as it may be lost on the way."""
ACCEPTED: int = mavlink.MAV_MISSION_ACCEPTED
ERROR: int = mavlink.MAV_MISSION_ERROR
NO_SPACE: int = mavlink.MAV_MISSION_NO_SPACE
UNSUPPORTED: int = mavlink.MAV_MISSION_UNSUPPORTED
COMPLETE: int = mavlink.MISSION_STATE_COMPLETE
CANCELLED: int = mavlink.MAV_MISSION_OPERATION_CANCELLED
WRITE_FAILURE = {FENCE: "mavlink_mission_storage_write_failure2", RALLY: "mavlink_mission_storage_write_failure3"}
NOTHING = Plan()
Partner = tuple[int, int]


class State(Enum):
    """What a manager is busy with."""

    IDLE = "idle"
    SENDS = "items go out"
    GETS = "items come in"


class Uploads:
    """What the managers of all links share: the plans, and who is uploading."""

    def __init__(
        self,
        dataman: Dataman,
        say: Say,
        traits: Traits,
        set_current: Callable[[int, int], bool] | None,
        plan_changed: Callable[[int], None] | None,
    ) -> None:
        self.dataman = dataman
        self.say = say
        self.traits = traits
        self.in_progress = False
        self.set_current, self.plan_changed = set_current, plan_changed
        self.last_reached = -1
        """The item that was reached last; -1 once a new upload has begun."""
        self.sent_current = dataman.told_seq
        """The current item that the links have sent, or that the ground has chosen itself."""

    def store(self, now_us: int, kind: int, plan: Plan, current_seq: int) -> bool:
        """Replace a plan and tell the navigator; False if it can't be written."""
        if not self.dataman.store(kind, plan, current_seq):
            return False
        if self.plan_changed is not None:
            self.plan_changed(now_us)
        return True

    def note_chosen(self, seq: int) -> None:
        """The ground has chosen the current item, so that it needs not be told of it; -1: it has chosen none."""
        self.dataman.told_seq = self.sent_current = seq

    def clear(self, now_us: int, kind: int) -> bool:
        """Make a plan empty; an unknown kind has none, which is no trouble to PX4."""
        current_seq = self.dataman.current_seq
        if kind == MISSION:
            current_seq = 0
            self.note_chosen(0)
        if kind not in MAX_ITEMS or self.store(now_us, kind, Plan(), current_seq):
            return True
        if kind in WRITE_FAILURE:
            self.say(Severity.CRITICAL, "Mission storage: Unable to write to microSD\t", WRITE_FAILURE[kind])
        return False


class Manager:
    """The protocol on one link."""

    def __init__(self, link: Link, uploads: Uploads) -> None:
        self._link = link
        self._uploads = uploads
        self._dataman = uploads.dataman
        self.state = State.IDLE
        self._partner: Partner = (0, 0)
        self._kind = MISSION
        self._integer = True
        self._count = 0
        self._sequence = 0
        self._items: list[MissionItem] = []
        self._crc = 0
        self._current_seq = -1
        self._heard_us = self._sent_us = 0

    def on_time(self, now_us: int) -> None:
        """Ask again, give up."""
        if now_us - self._heard_us > TIMEOUT_US:
            self._say("Mission sync timeout\t", "mavlink_mission_sync_timeout")
            self._uploads.in_progress = False
            self.state = State.IDLE
        elif now_us - self._sent_us > RETRY_US:
            if self.state is State.GETS:
                self._request(now_us)
            elif self._sequence == 0:
                self._tell_count(now_us)

    # --- upload ------------------------------------------------------------------------------------------

    def on_count(self, now_us: int, message: Any) -> None:
        """MISSION_COUNT: an upload begins, or a plan is cleared."""
        partner = _partner(message)
        if self.state is State.SENDS:
            # Not heard, as to the download: one that waits for the last MISSION_ACK ends though uploads are tried.
            self._say("WPM: IGN MISSION_COUNT: Busy\t", "mavlink_mission_ignore_mis_count")
            self._ack(partner, ERROR)
            return
        self._heard_us = now_us
        if self.state is State.GETS:
            if partner != self._partner:
                self._ack(partner, ERROR)
            elif self._sequence:
                self._say("WPM: REJ. CMD: Busy\t", "mavlink_mission_getlist_busy")
                self._ack(partner, ERROR)
            else:
                self._request(now_us)
        elif self._uploads.in_progress:
            self._ack(partner, ERROR)
        else:
            self._begin_upload(now_us, partner, message.mission_type, message.count)

    def _begin_upload(self, now_us: int, partner: Partner, kind: int, count: int) -> None:
        self._partner, self._kind = partner, kind
        self._crc = 0
        self._uploads.last_reached = -1
        if count > MAX_ITEMS.get(kind, 0):
            self._ack(partner, NO_SPACE)
        elif count == 0:
            self._uploads.clear(now_us, kind)
            self._ack(partner, ACCEPTED)
        else:
            self._uploads.in_progress = True
            self.state = State.GETS
            self._count, self._sequence, self._current_seq = count, 0, -1
            self._items = []
            self._request(now_us)

    def _request(self, now_us: int) -> None:
        self._sent_us = now_us
        self._link.send_fields(
            mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT if self._integer else mavlink.MAVLINK_MSG_ID_MISSION_REQUEST,
            self._sequence,
            *self._partner,
            self._kind,
        )

    def on_item(self, now_us: int, message: Any) -> None:
        """MISSION_ITEM, MISSION_ITEM_INT: the next item of an upload, or one that nobody asked for."""
        if _partner(message) != self._partner:
            self._say("REJ. MIS ITEM: partner id mismatch\t", "mavlink_mission_item_partner_id_mismatch")
        elif message.mission_type != self._kind:
            self._ack(self._partner, ERROR)
        elif self.state is State.SENDS:
            self._say("IGN MISSION_ITEM: Busy\t", "mavlink_mission_mis_item_busy")
            self._ack(self._partner, ERROR)
        elif self.state is State.IDLE:
            if self._sequence == message.seq + 1:
                self._ack(self._partner, ACCEPTED, self._crc)
            else:
                self._say("IGN MISSION_ITEM: No transfer\t", "mavlink_mission_no_transfer")
                self._ack(self._partner, ERROR)
        else:
            self._heard_us = now_us
            if message.seq == self._sequence:
                self._take_item(now_us, message)

    def _take_item(self, now_us: int, message: Any) -> None:
        item, error = mission_items.parse(message, self._kind, self._uploads.traits)
        if error in (ACCEPTED, ERROR):
            self._crc = crc32_part(mission_items.crc_bytes(message), self._crc)
        else:
            self._say("IGN MISSION_ITEM: Invalid item\t", "mavlink_mission_mis_item_invalid")
        if item is None:
            self._end_upload(error)
            return
        self._items.append(item)
        if message.current:
            self._current_seq = message.seq
        self._sequence += 1
        if self._sequence < self._count:
            self._request(now_us)
        elif self._crc == self._plan().opaque_id or self._store(now_us):
            self._end_upload(ACCEPTED, self._crc)
        else:
            self._end_upload(ERROR)
            self._say("Unable to write on micro SD\t", "mavlink_mission_storage_failure")

    def _store(self, now_us: int) -> bool:
        """Replace the plan. The mission goes on at its item, as far as the new one has it, unless one is marked."""
        current_seq = self._dataman.current_seq
        if self._kind == MISSION:
            self._uploads.note_chosen(self._current_seq)
            current_seq = self._current_seq if self._current_seq >= 0 else min(current_seq, self._count - 1)
        return self._uploads.store(now_us, self._kind, Plan(tuple(self._items), self._crc), current_seq)

    def _end_upload(self, result: int, opaque_id: int = 0) -> None:
        self.state = State.IDLE
        self._uploads.in_progress = False
        self._items = []
        self._ack(self._partner, result, opaque_id)

    # --- download ----------------------------------------------------------------------------------------

    def on_request_list(self, now_us: int, message: Any) -> None:
        """MISSION_REQUEST_LIST: a download begins, also where the last one was never acknowledged."""
        partner, kind = _partner(message), message.mission_type
        if self.state is State.SENDS and self._sequence == len(self._plan().items):
            self.state = State.IDLE
        same = self.state is State.SENDS and kind == self._kind and partner == self._partner
        if self.state is not State.IDLE and not same:
            text = "Mission download request ignored, already active\t"
            self._uploads.say(Severity.INFO, text, "mavlink_mission_req_ignored")
            return
        self._heard_us = now_us
        self.state = State.SENDS
        self._partner, self._kind = partner, kind
        self._sequence, self._count = 0, len(self._plan().items)
        self._tell_count(now_us)

    def _tell_count(self, now_us: int) -> None:
        self._sent_us = now_us
        fields = (self._count, *self._partner, self._kind, self._plan().opaque_id)
        self._link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_COUNT, *fields)

    def on_request(self, now_us: int, message: Any) -> None:
        """MISSION_REQUEST, MISSION_REQUEST_INT: the next item goes out, or the last one again."""
        if _partner(message) != self._partner:
            self._say("WPM: REJ. CMD: partner id mismatch\t", "mavlink_mission_partner_id_mismatch2")
            return
        if self.state is not State.SENDS:
            if self.state is State.GETS:
                self._say("WPM: REJ. CMD: Busy\t", "mavlink_mission_mis_req_ignored_busy")
            return
        if message.mission_type != self._kind:
            return
        self._heard_us = now_us
        sequence, items = message.seq, self._plan().items
        if sequence == self._sequence < self._count:
            self._sequence += 1
        elif sequence != self._sequence - 1:
            self._refuse_request("mavlink_mission_wp_unexpected")
            return
        if sequence < len(items):
            self._send_item(items[sequence])
        else:
            self._refuse_request("mavlink_mission_wp_unexpected2")

    def _refuse_request(self, event: str) -> None:
        self.state = State.IDLE
        self._ack(self._partner, ERROR)
        self._say("WPM: REJ. CMD: Req. WP was unexpected\t", event)

    def _send_item(self, item: MissionItem) -> None:
        seq = item.seq
        current = seq == self._dataman.told_seq
        if self._integer:
            frame = item.frame
            message_id = mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
            position: tuple[float, ...] = item[8:]
        else:
            frame = mission_items.FLOAT_FRAME.get(item.frame, item.frame)
            message_id = mavlink.MAVLINK_MSG_ID_MISSION_ITEM
            position = mission_items.float_position(item)
        tail = (seq, item.command, *self._partner, frame, current, item.autocontinue, self._kind)
        self._link.send_fields(message_id, *mission_items.sent_params(item), *position, *tail)

    # --- the rest ----------------------------------------------------------------------------------------

    def on_ack(self, now_us: int, message: Any) -> None:
        """MISSION_ACK: ends a download, cancels an upload, or asks for the other kind of item messages."""
        if _partner(message) != self._partner:
            self._say("REJ. WP CMD: partner id mismatch\t", "mavlink_mission_partner_id_mismatch")
        elif self.state is State.SENDS:
            if message.mission_type == self._kind:
                self.state = State.IDLE
        elif self.state is State.GETS:
            if message.type == UNSUPPORTED:
                self._integer = not self._integer
                self._request(now_us)
            elif message.type == CANCELLED:
                self.state = State.IDLE
                self._uploads.in_progress = False

    def on_clear_all(self, now_us: int, message: Any) -> None:
        """MISSION_CLEAR_ALL, of one kind or all."""
        if self.state is not State.IDLE:
            self._say("WPM: IGN CLEAR CMD: Busy\t", "mavlink_mission_ignore_clear")
            return
        self._kind = message.mission_type
        kinds = tuple(MAX_ITEMS) if self._kind == ALL_TYPES else (self._kind,)
        cleared = [self._uploads.clear(now_us, kind) for kind in kinds]
        self._ack(_partner(message), ACCEPTED if all(cleared) else ERROR)

    def on_set_current(self, now_us: int, message: Any) -> None:
        """MISSION_SET_CURRENT: fly this item next."""
        sequence = message.seq
        if self.state is not State.IDLE:
            self._say("WPM: IGN WP CURR CMD: Busy\t", "mavlink_mission_state_busy")
        elif sequence >= len(self._dataman.mission.items):
            self._say("WPM: WP CURR CMD: Not in list\t", "mavlink_mission_seq_out_of_bounds")
        else:
            self._uploads.note_chosen(sequence)
            if self._uploads.set_current is not None:
                self._uploads.set_current(now_us, sequence)
            else:
                self._dataman.current_seq = sequence

    def tell_jump(self, seq: int) -> None:
        """A DO_JUMP item was followed: it is sent to the last partner, whoever that was, unless there is a transfer."""
        if self.state is State.IDLE:
            self._kind = MISSION
            self._send_item(self._dataman.mission.items[seq])

    def choose_messages(self, integer: bool) -> None:
        """The partner speaks MISSION_ITEM_INT (or MISSION_ITEM), and so do we from now on."""
        self._integer = integer

    def _plan(self) -> Plan:
        return self._dataman.plans.get(self._kind, NOTHING)

    def _ack(self, partner: Partner, result: int, opaque_id: int = 0) -> None:
        self._link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_ACK, *partner, result, self._kind, opaque_id)

    def _say(self, text: str, event: str) -> None:
        self._uploads.say(Severity.CRITICAL, text, event)


SPEAKS_INT = {
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM: False,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST: False,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT: True,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT: True,
}
"""Which of the two item messages a partner speaks: PX4 answers in the same."""
HANDLERS: dict[int, Callable[[Manager, int, Any], None]] = {
    mavlink.MAVLINK_MSG_ID_MISSION_COUNT: Manager.on_count,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM: Manager.on_item,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT: Manager.on_item,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST: Manager.on_request,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT: Manager.on_request,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: Manager.on_request_list,
    mavlink.MAVLINK_MSG_ID_MISSION_ACK: Manager.on_ack,
    mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: Manager.on_clear_all,
    mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT: Manager.on_set_current,
}


class Mission:
    """The plans' service: the managers of all links, and what the navigator has to tell."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(HANDLERS)
    HAS_TIMER = True

    def __init__(
        self,
        links: tuple[Link, ...],
        topics: Topics,
        dataman: Dataman,
        texts: Texts,
        system_id: int,
        traits: Traits,
        set_current: Callable[[int, int], bool] | None,
        plan_changed: Callable[[int], None] | None,
    ) -> None:
        """Writes plans into `dataman`, and tells the navigator: (now_us, seq) -> done and (now_us)."""
        self._links = links
        self._topics = topics
        self._dataman = dataman
        self._system_id = system_id
        self._uploads = Uploads(dataman, texts.of("mavlink"), traits, set_current, plan_changed)
        self._managers = {link: Manager(link, self._uploads) for link in links}
        self._result = topics.mission_result
        self._reached_repeats = 0
        self._repeat_due_us = 0

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Only what is for us; broadcasts are not."""
        manager, message_id = self._managers.get(link), message.get_msgId()
        if manager is None:  # a device that was plugged in after the start
            manager = self._managers[link] = Manager(link, self._uploads)
        speaks_int = SPEAKS_INT.get(message_id)
        if speaks_int is not None:
            manager.choose_messages(speaks_int)
        if message.target_system == self._system_id and message.target_component in (0, 1, MISSION_PLANNER):
            HANDLERS[message_id](manager, now_us, message)

    def on_time(self, now_us: int) -> None:
        """Go on with transfers, and tell what the navigator reached."""
        for manager in self._managers.values():
            if manager.state is not State.IDLE:
                manager.on_time(now_us)
        result, uploads = self._topics.mission_result, self._uploads
        due = now_us >= self._repeat_due_us
        if due:
            self._repeat_due_us = now_us + REACHED_EVERY_US
        if result is not self._result and result.seq_reached != uploads.last_reached:
            uploads.last_reached = result.seq_reached
            self._reached_repeats = REACHED_REPEATS
            self._tell_reached(result.seq_reached)
        elif due and self._reached_repeats and self._dataman.mission.items:
            self._reached_repeats -= 1
            self._tell_reached(uploads.last_reached)
        if result is not self._result and result.item_do_jump_changed:
            for manager in self._managers.values():
                manager.tell_jump(result.item_changed_index)
        completes = (result.mission_state == COMPLETE) is not (self._result.mission_state == COMPLETE)
        self._result = result
        if self._dataman.told_seq != uploads.sent_current or completes:
            uploads.sent_current = self._dataman.told_seq
            for link in self._links:
                link.hurry(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def _tell_reached(self, seq: int) -> None:
        if seq >= 0:
            for link in self._links:
                link.send_fields(mavlink.MAVLINK_MSG_ID_MISSION_ITEM_REACHED, seq)


def _partner(message: Any) -> Partner:
    return message.get_srcSystem(), message.get_srcComponent()
