"""The uXRCE-DDS client: what it publishes lies in `outbox` (PX4: src/modules/uxrce_dds_client/uxrce_dds_client.cpp).

A state machine on simulated time. PX4's client speaks to an agent, which speaks DDS; ours hands it whole samples
(`sitl_emu/run/dds_agent.py`): the number of the topic, and the bytes of the message.

Times in samples are moved to the clock of DDS's side, as PX4 does with UXRCE_DDS_SYNCT 1, its default: `synchronize`
is told that clock; until it is, the date at boot stands for it.
"""

import struct
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, Final

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.logger.logged_topics import STATE_MS, LoggedTopic
from sitl_emu.autopilot.logger.rows import commander as commander_rows
from sitl_emu.autopilot.logger.rows import outside as outside_rows
from sitl_emu.autopilot.topics import CommandTold, Topics, VehicleCommand
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import PUBLICATIONS, REPLY, REQUEST, SUBSCRIPTIONS, Sample
from sitl_emu.autopilot.uxrce_dds_client.external_modes import Reply
from sitl_emu.autopilot.uxrce_dds_client.publications import NUMBERS, Publication, from_row, publications
from sitl_emu.autopilot.uxrce_dds_client.subscriptions import Subscriptions
from sitl_emu.autopilot.uxrce_dds_client.vehicle_command_srv import ASKED_BYTES, VehicleCommandSrv

JUMP_US = 100_000
"""By so much another time is a jump of the clock, and is taken as it is (Timesync.hpp, MAX_DEVIATION_SAMPLE)."""
GAIN = 0.003
"""What a smaller deviation changes the offset by (Timesync.hpp, ALPHA_GAIN_FINAL)."""
TIMESYNC_US = 1_000_000
"""How often timesync_status tells of it: PX4 asks its agent once a second."""
SOURCE_PROTOCOL_DDS = 2
"""timesync_status.source_protocol."""
WRAP = 1 << 64
STAMP = struct.Struct("<Q")
VEHICLE_COMMAND = next(number for number, topic in enumerate(SUBSCRIPTIONS) if topic.name == "vehicle_command")
TELLS_COMPLETION: Final = frozenset(
    (
        NavState.AUTO_TAKEOFF,
        NavState.AUTO_VTOL_TAKEOFF,
        NavState.AUTO_MISSION,
        NavState.AUTO_RTL,
        NavState.AUTO_LAND,
    )
)
"""Modes of the navigator that tell mode_completed when they have done their work (Navigator::mode_completed)."""
LOOK_US = 20_000
"""How often it looks whether a state has changed: commander and others write them so often."""


class _Entry:
    """A publication, and what of it went out last."""

    __slots__ = ("due_us", "interval_us", "last", "number", "pack", "repeat_us", "state", "timed", "times")

    def __init__(self, publication: Publication, record: Any) -> None:
        """`record`: the present one; where nobody has written it yet, it does not go out."""
        self.number, self.interval_us, self.state = publication.number, publication.interval_us, publication.state
        self.pack = publication.pack
        self.timed = hasattr(record, "timestamp")
        self.last: Any = record if self.timed and record.timestamp == 0 else None
        self.due_us = self.repeat_us = 0
        self.times = _times(publication.number)

    def is_new(self, now_us: int, record: Any) -> bool:
        """Whether it is to go out: another record; a state where it says something else, and at times all the same."""
        last = self.last
        if self.timed and record.timestamp == 0:
            return False
        if not self.state or last is None or now_us >= self.repeat_us:
            return True
        return record is not last and bool(record[self.timed :] != last[self.timed :])

    def went_out(self, now_us: int, record: Any) -> None:
        """Note it; it is due again when its interval is over, as uORB counts: late once, it is not late for ever."""
        self.last = record
        self.due_us = min(max(self.due_us, now_us - self.interval_us), now_us) + self.interval_us
        self.repeat_us = now_us + STATE_MS * 1000


def _times(number: int) -> struct.Struct:
    """The times that a message begins with, and which are moved."""
    stamps = cdr.stamps(PUBLICATIONS[number].type)
    assert stamps in ((0,), (0, 8))
    return struct.Struct(f"<{len(stamps)}Q")


class UxrceDdsClient:
    """One vehicle's."""

    def __init__(
        self,
        topics: Topics,
        logged: Iterable[LoggedTopic],
        system_id: int,
        boot_unix_us: int,
        handle_command: Callable[[int, VehicleCommand], CommandResult | None],
    ) -> None:
        """`logged`: what the logger can log of this vehicle; `boot_unix_us`: the date of time 0.

        `handle_command` lets the owner of a command decide.
        """
        self._topics = topics
        self.outbox: list[Sample] = []
        self.time_offset_us = boot_unix_us
        """The clock of DDS's side less ours."""
        self._synchronized, self._timesync_due_us, self._completion_due_us = False, 0, 0
        chosen = publications(logged, topics, system_id)
        self._records = attrgetter(*(each.source for each in chosen))
        self._entries = [_Entry(each, record) for each, record in zip(chosen, self._records(topics), strict=True)]
        self._subscriptions = Subscriptions(topics, system_id, handle_command, self._reply)
        self._vehicle_command_srv = VehicleCommandSrv(topics)
        self._read_command = cdr.Reader("VehicleCommand")
        self._pack_ack = from_row("vehicle_command_ack", commander_rows.vehicle_command_ack)
        self._pack_report = from_row("transponder_report", outside_rows.transponder_report)
        self._acks_seen = max((each.number for each in topics.commands_told), default=0)
        self._reports_seen = max((each.number for each in topics.transponder_reports), default=0)

    def synchronize(self, now_us: int, clock_us: int) -> None:
        """The clock of DDS's side says `clock_us` (Unix time) now: what it is ahead is filtered, a jump is taken."""
        observed_us = clock_us - now_us
        deviation_us = observed_us - self.time_offset_us
        if abs(deviation_us) > JUMP_US or not self._synchronized:
            self._synchronized = True
            self.time_offset_us += deviation_us
        else:
            self.time_offset_us += round(GAIN * deviation_us)
        if now_us >= self._timesync_due_us:
            self._timesync_due_us = now_us + TIMESYNC_US
            fields = {
                "source_protocol": SOURCE_PROTOCOL_DDS,
                "remote_timestamp": clock_us,
                "observed_offset": -observed_us,
                "estimated_offset": -self.time_offset_us,
            }
            self._reply(now_us, Reply("timesync_status", fields))

    def on_sample(self, now_us: int, sample: Sample) -> None:
        """A message came, of a topic by its place in SUBSCRIPTIONS, or a REQUEST."""
        topic, data = sample
        if topic == REQUEST:
            topic, asked, data = VEHICLE_COMMAND, data[:ASKED_BYTES], data[ASKED_BYTES:]
            if len(data) < self._read_command.size:
                return
            self._vehicle_command_srv.on_request(asked, self._read_command.read(data)["command"])
        self._subscriptions.on_sample(now_us, topic, data, self.time_offset_us)

    def update(self, now_us: int) -> None:
        """One tick: what is new and due, as uORB's subscriptions with an interval give it out."""
        for entry, record in zip(self._entries, self._records(self._topics), strict=True):
            if now_us < entry.due_us or (record is entry.last and not entry.state):
                continue
            if entry.is_new(now_us, record):
                entry.went_out(now_us, record)
                self._publish(entry.number, entry.times, entry.pack(record), None if entry.timed else now_us)
            elif entry.state:
                entry.due_us = now_us + LOOK_US
        self._publish_queues()
        self._publish_completion(now_us)

    def _publish_completion(self, now_us: int) -> None:
        """That the mode has done its work, as soon as it has and twice a second while it stays.

        PX4's navigator tells it in each of its runs.
        """
        if not self._topics.mission_result.finished:
            self._completion_due_us = 0
        elif now_us >= self._completion_due_us:
            self._completion_due_us = now_us + STATE_MS * 1000
            mode = self._topics.navigator_status.nav_state
            if mode in TELLS_COMPLETION:
                self._reply(now_us, Reply("mode_completed", {"nav_state": mode}))

    def _publish_queues(self) -> None:
        """Answers to commands, and aircraft nearby: each that came."""
        told = self._topics.commands_told
        if told and told[-1].number != self._acks_seen:
            for each in told:
                if each.number > self._acks_seen and each.result is not None:
                    self._publish_ack(each, self._pack_ack((each.command, each.result, each.from_outside)))
            self._acks_seen = told[-1].number
        reports = self._topics.transponder_reports
        if reports and reports[-1].number != self._reports_seen:
            for report in reports:
                if report.number > self._reports_seen:
                    self._publish(NUMBERS["transponder_report"], STAMP, self._pack_report(report), None)
            self._reports_seen = reports[-1].number

    def _publish_ack(self, told: CommandTold, data: bytes) -> None:
        """To all, and to who has asked for it by the service."""
        stamped = self._stamped(STAMP, data, told.timestamp)
        self.outbox.append(Sample(NUMBERS["vehicle_command_ack"], stamped))
        asked = self._vehicle_command_srv.answered(told)
        if asked is not None:
            self.outbox.append(Sample(REPLY, asked + stamped))

    def _reply(self, now_us: int, reply: Reply) -> None:
        number = NUMBERS[reply.topic]
        data = cdr.Writer(PUBLICATIONS[number].type).write(**reply.fields)
        self._publish(number, STAMP, data, now_us)

    def _publish(self, number: int, times: struct.Struct, data: bytes, now_us: int | None) -> None:
        self.outbox.append(Sample(number, self._stamped(times, data, now_us)))

    def _stamped(self, times: struct.Struct, data: bytes, now_us: int | None) -> bytes:
        """A message with times of the other side's clock; `now_us`: its time, where its record tells none."""
        told = times.unpack_from(data) if now_us is None else (now_us,) * (times.size // STAMP.size)
        moved = times.pack(*[(time_us + self.time_offset_us) % WRAP for time_us in told])
        return moved + data[times.size :]
