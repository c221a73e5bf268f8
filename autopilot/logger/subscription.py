"""A logged topic: which records wait to be packed, and how they become data messages of a ULog."""

import itertools
import struct
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from sitl_emu.autopilot.logger import packing, ulog
from sitl_emu.autopilot.logger.logged_topics import LoggedTopic
from sitl_emu.autopilot.logger.packing import Row
from sitl_emu.autopilot.topics import Topics

TIMESTAMP = struct.Struct("<Q")
"""The first field of every topic."""


class Subscription:
    """A logged topic in a running log."""

    __slots__ = (
        "due_us", "every_tick", "header", "instance", "last", "message_id", "name", "pending", "repeat_us", "row",
        "size", "timed",
    )  # fmt: skip

    def __init__(
        self, message_id: int, name: str, row: Row, timed: bool = True, repeat_us: int = 0, instance: int = 0
    ) -> None:
        self.message_id, self.name, self.row, self.instance = message_id, name, row, instance
        self.repeat_us = repeat_us
        """After what time a state that has not changed is logged again; 0: never."""
        self.size = packing.size_of(name)
        self.header = ulog.data_header(self.size, message_id)
        self.timed = timed
        """Whether our record says when it was made."""
        self.last: Any = None
        """The record that was logged last."""
        self.due_us = 0
        """Then it is."""
        self.every_tick = False
        """Whether `pending` has the record of each tick, new or not."""
        self.pending: list[Any] = []
        """Records that are yet to be packed: many together cost a third of what each costs alone, in a tick."""

    def messages(self) -> list[bytes]:
        """The data messages of what is pending."""
        header, row, pending = self.header, self.row, self.pending
        if self.every_tick:
            found, self.last = (self.last, *pending), pending[-1]
            pending = [record for before, record in itertools.pairwise(found) if record is not before]
        packed = [header + row(record) for record in pending]
        self.pending.clear()
        return packed

    def message(self, now_us: int, record: Any) -> bytes:
        """The data message of one record; one that does not say when it was made gets the present time."""
        data = self.row(record)
        if not self.timed:
            data = TIMESTAMP.pack(now_us) + data[TIMESTAMP.size :]
        return self.header + data


class Group:
    """Subscriptions that are looked at together."""

    __slots__ = ("due_us", "interval_us", "records", "states", "subscriptions")

    def __init__(self, interval_us: int, states: bool, subscriptions: dict[Subscription, LoggedTopic]) -> None:
        """`subscriptions` with what they are of."""
        self.interval_us, self.states, self.subscriptions = interval_us, states, tuple(subscriptions)
        self.due_us = 0
        topics = tuple(subscriptions.values())
        if any(topic.find for topic in topics):
            self.records: Callable[[Topics], tuple[Any, ...]] = lambda all_: tuple(each.record(all_) for each in topics)
            return
        # attrgetter of one name returns the value, of several a tuple; the first one twice makes it always a tuple
        sources = [topic.source for topic in topics]
        self.records = attrgetter(*sources, sources[0])
