"""The logger: when a log begins and ends, and what goes into it (PX4: src/modules/logger/logger.cpp).

SDLOG_MODE says when a file is written: 0 from arming to disarming, 1 from boot to the first disarming and from then on
as 0, 2 from boot to shutdown, 3 while the first auxiliary stick is up, 4 from the first arming to shutdown. `on` and
`off` are the shell's `logger on|off`: on is as good as armed, off takes that back and ends nothing that was begun
otherwise.
SDLOG_BACKEND allows files (1) and streaming over MAVLink (2), which a client starts whenever it likes. What is logged
says logged_topics.py. While nothing is logged, a tick costs a comparison.

Left out: the mission log, a second file beside the full one (SDLOG_MISSION), clean-up by the disk's fullness
(SDLOG_ROTATE), performance counters.
"""

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.logger import definitions, log_files, logged_topics, ulog
from sitl_emu.autopilot.logger.log_files import LogFile
from sitl_emu.autopilot.logger.log_stream import LogStream
from sitl_emu.autopilot.logger.logged_topics import LoggedTopic
from sitl_emu.autopilot.logger.rows import commander as commander_rows
from sitl_emu.autopilot.logger.rows import outside as outside_rows
from sitl_emu.autopilot.logger.said import Said
from sitl_emu.autopilot.logger.subscription import Group, Subscription
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import LoggerStatus, ParameterUpdate, Topics

FROM_BOOT: Final = 1
FROM_BOOT_TO_SHUTDOWN: Final = 2
BY_AUX1: Final = 3
FROM_ARMING_TO_SHUTDOWN: Final = 4
"""SDLOG_MODE."""
FILES: Final = 1
MAVLINK: Final = 2
"""SDLOG_BACKEND."""
AUX1_WANTS_A_LOG: Final = 0.3
"""Above it, SDLOG_MODE 3 logs (Logger::start_stop_logging)."""
STOP_DELAY_US: Final = 1_000_000
"""A log goes on for so long after disarming."""
STATUS_EVERY_US: Final = 1_000_000
SYNC_US: Final = 500_000
"""A sync mark so often; with it goes the buffer to the file."""
STREAM_US: Final = 100_000
"""A stream is fed so often."""
LOOK_US: Final = 8_000
"""How often it looks whether a log is to begin or end, and for new records of what does not come in every tick: as
often as the estimator has some."""
FAST = frozenset(
    {
        "ekf2_timestamps",
        "sensor_combined",
        "vehicle_acceleration",
        "vehicle_angular_velocity",
        "vehicle_attitude",
        "vehicle_attitude_setpoint",
        "vehicle_rates_setpoint",
        "vehicle_thrust_setpoint",
        "actuator_outputs",
    }
)
"""What may come in every tick."""
STATE_CHECK_US: Final = 100_000
RECENT_US: Final = 100_000
"""Commands of so short a time before a log begins are in it: the one that armed."""
OUTPUTS: Final = 16
BUFFER_BYTES: Final = 1_024_000
"""Of PX4's, which `logger status` names: LOGGER_BUF of init.d-posix/rcS, in thousands; nothing drops out of ours."""


class Logger:
    """Writer of log files and of the log stream."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        texts: Texts,
        root: Path | None,
        unix_us_of_boot: Callable[[], int],
        event_definitions: Callable[[], bytes] = bytes,
    ) -> None:
        """Files go under `root` (None: there is no storage); `unix_us_of_boot` gives the date of time 0.

        `event_definitions` is the compressed metadata of events, by which a reader of the log puts them into words.
        """
        self._event_definitions = event_definitions
        self._topics, self._parameters, self._texts = topics, parameters, texts
        self._root, self._unix_us_of_boot = root, unix_us_of_boot
        self._mode = int(parameters["SDLOG_MODE"])
        self._backend = int(parameters["SDLOG_BACKEND"])
        self._profile = int(parameters["SDLOG_PROFILE"])
        """Asked at the start of PX4, not at a log's (Logger::initialize_topics, logger.cpp:609)."""
        self.file: LogFile | None = None
        """The log that is being written."""
        self.stream: LogStream | None = None
        """The log that is being streamed; services/log_streaming.py sends it."""
        self.files: list[str] = []
        """Names of all logs since boot, under log/."""
        self._now_us = 0
        self._wanted = False
        self._boot = self._mode in (FROM_BOOT, FROM_BOOT_TO_SHUTDOWN)
        self._override = False
        self._sticks = topics.manual_control_setpoint
        self._stop_us = 0
        self._started_us = 0
        self._refused = False
        self._subscriptions: list[Subscription] = []
        self._groups: tuple[Group, ...] = ()
        self._every_tick: tuple[tuple[Callable[[Any], None], str], ...] = ()
        """Of each topic that comes in every tick, where its records gather, and our topic's name."""
        self._look_us = self._flush_us = self._sync_us = 0
        self._buffer: list[bytes] = []
        self._most_used_bytes = 0
        """Gathered between two writings, since somebody asked."""
        self._told_seen = self._reports_seen = self._requests_seen = 0
        self._said = Said(texts)
        self._notifications = parameters.notifications
        self._updates = -1
        """Of parameters, as they were told last."""

    # --- when ----------------------------------------------------------------------------------------------

    def update(self, now_us: int) -> None:
        """One tick: begin, go on, end."""
        if now_us >= self._look_us:
            self._look_us = now_us + LOOK_US
            self._now_us = now_us
            self._said.hear(now_us)
            self._begin_or_end(now_us)
            if self._backend and now_us - self._topics.logger_status.timestamp >= STATUS_EVERY_US:
                self._topics.logger_status = self._own_status(now_us)
            if self._parameters.notifications != self._updates:
                self._updates = self._parameters.notifications
                self._topics.parameter_update = _parameter_update(now_us, self._parameters)
            if self.is_logging:
                self._look(now_us)
            else:
                self._every_tick = ()
        for append, source in self._every_tick:
            append(getattr(self._topics, source))

    def _own_status(self, now_us: int) -> LoggerStatus:
        """Logger::publish_logger_status."""
        kb, count = 0.0, len(self._subscriptions)
        if self.file is not None:
            kb = self.file.written_bytes / 1024.0
        kb_s = kb / max((now_us - self._started_us) * 1e-6, 1e-3)
        return LoggerStatus(now_us, self.is_logging, kb, kb_s, count, self._backend)

    def on(self) -> None:
        """The shell's `logger on`: log now, armed or not."""
        self._override = True

    def off(self) -> None:
        """The shell's `logger off`: no longer because of `on`."""
        self._override = False

    def shut_down(self) -> None:
        """The autopilot ends: write what is left."""
        self._end_file()
        self.stream = None

    def _begin_or_end(self, now_us: int) -> None:
        if self._boot:
            self._boot = False
            battery = self._topics.battery_status
            if not self._parameters["SDLOG_BOOT_BAT"] or not battery.timestamp or battery.connected:
                self._begin_file(now_us)
        if self._mode == FROM_BOOT_TO_SHUTDOWN:
            return
        wanted = self._is_wanted()
        if wanted != self._wanted:
            self._wanted = wanted
            if wanted:
                if self._stop_us:
                    self._end_file()
                self._begin_file(now_us)
            else:  # PX4 measures its load for a second from a beginning or an end on, one at a time, and then ends
                measured_us = self._started_us + STOP_DELAY_US
                self._stop_us = measured_us if now_us < measured_us else now_us + STOP_DELAY_US
        if self._stop_us and now_us >= self._stop_us:
            self._end_file()

    def _is_wanted(self) -> bool:
        """Whether there is to be a log; by a stick of which nothing new has come it stays as it is, `on` or not."""
        if self._mode == BY_AUX1:
            before, self._sticks = self._sticks, self._topics.manual_control_setpoint
            if self._sticks is before:
                return self._wanted
            return self._sticks.aux[0] > AUX1_WANTS_A_LOG or self._override
        stays = self._mode == FROM_ARMING_TO_SHUTDOWN and self._wanted
        return self._topics.actuator_armed.armed or self._override or stays

    def _begin_file(self, now_us: int) -> None:
        if self.file is not None or not self._backend & FILES or self._root is None or not self._has_room(self._root):
            return
        unix_us = self._unix_us_of_boot() + now_us
        file = LogFile(self._root, unix_us, int(self._parameters["SDLOG_UTC_OFFSET"]))
        if not file.trouble:
            self._print_beginning(file.name)
            self._said.hear(now_us)
            self.files.append(file.name)
        self.file, self._started_us = file, now_us
        self._stop_us = 0
        self._prepare(now_us)
        file.write(b"".join(self._definitions(now_us)), unix_us)
        self._end_if_troubled()

    def _print_beginning(self, name: str) -> None:
        """Lines of which a log begins with the last four (`said.LINES_QUEUED`): not with who armed, as PX4's do not."""
        if (limit_mib := int(self._parameters["SDLOG_MAX_SIZE"])) > 0:
            self._texts.note(Severity.INFO, f"[logger] Max log file size: {limit_mib} MiB")
        self._texts.note(Severity.INFO, "[logger] Start file log (type: full)")
        date_and_time = map(int, re.findall(r"\d+", name))
        self._say(Severity.INFO, f"[logger] ./log/{name}\t", "logger_open_file_time", *date_and_time)
        self._texts.note(Severity.INFO, f"[logger] Opened full log file: ./log/{name}")

    def _has_room(self, root: Path) -> bool:
        try:
            log_files.keep_newest_folders(root, int(self._parameters["SDLOG_DIRS_MAX"]))
            free = log_files.free_bytes(root)
        except OSError as error:
            self._refuse(f"[logger] Not logging; {error.strerror}\t")
            return False
        if free < log_files.LEAST_FREE_BYTES:
            free_mib = free // log_files.MEBIBYTE
            text = f"[logger] Storage full: {free_mib} MiB free\t"
            self._say(Severity.CRITICAL, text, "logger_storage_full", free_mib)
            return False
        return True

    def _refuse(self, text: str) -> None:
        """Said once, not at every arming."""
        if not self._refused:
            self._refused = True
            self._say(Severity.CRITICAL, text)

    def _end_file(self) -> None:
        self._stop_us = 0
        if self.file is not None:
            self._flush(self._now_us)
        self.file = None

    def _end_if_troubled(self) -> None:
        file = self.file
        if file is None:
            return
        if file.trouble:
            self._refuse(f"[logger] Not logging to ./log/{file.name}: {file.trouble}\t")
        if file.trouble or file.gone:
            self.file = None

    def _say(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        self._texts.say(severity, text, event, *arguments, module="logger")

    @property
    def is_logging(self) -> bool:
        """Whether anything is written or streamed."""
        return self.file is not None or self.stream is not None

    # --- streaming -----------------------------------------------------------------------------------------

    @property
    def can_stream(self) -> bool:
        """Whether a stream may begin."""
        return self.stream is None and bool(self._backend & MAVLINK)

    @property
    def runs(self) -> bool:
        """Whether PX4 would have started its logger at all."""
        return bool(self._backend)

    def begin_stream(self, now_us: int) -> LogStream:
        """Begin to log to MAVLink."""
        if self.file is None:
            self._prepare(now_us)
        self.stream = stream = LogStream(self._definitions(now_us))
        return stream

    def end_stream(self) -> None:
        """Log to MAVLink no more."""
        self.stream = None

    def topics(self, profile: int = 0) -> list[LoggedTopic]:
        """What can be logged of this vehicle, by a value of SDLOG_PROFILE."""
        parameters = self._parameters
        vehicle = logged_topics.Vehicle(
            self._topics.vehicle_status.vehicle_kind.traits.modules,
            [int(parameters[f"PWM_MAIN_FUNC{n}"]) for n in range(1, OUTPUTS + 1)],
            int(parameters["MAV_SYS_ID"]),
            float(parameters["THR_MDL_FAC"]),
            int(parameters["CA_R_REV"]),
        )
        return logged_topics.logged_topics(profile, vehicle)

    # --- the beginning of a log ----------------------------------------------------------------------------

    def _prepare(self, now_us: int) -> None:
        """Subscribe anew. What was logged before and is not told again since is not in the new log, as in PX4's, whose
        subscriptions outlive a log; a state that it publishes again and again is.
        """
        logged = {(each.name, each.instance): each.last for each in self._subscriptions}
        topics = self.topics(self._profile)
        groups: dict[tuple[int, bool, bool], dict[Subscription, LoggedTopic]] = {}
        self._subscriptions, every_tick = [], []
        for topic in topics:
            record = topic.record(self._topics)
            timed = hasattr(record, "timestamp")
            each = Subscription(
                len(self._subscriptions), topic.name, topic.row, timed, topic.interval_ms * 1000, topic.instance
            )
            if not topic.state and record.timestamp == 0:
                each.last = record  # nobody has written it yet
            elif not (topic.state and topic.interval_ms):
                each.last = logged.get((topic.name, topic.instance))
            self._subscriptions.append(each)
            if topic.interval_ms == 0 and topic.source in FAST:  # none of which has several in a slot
                each.every_tick = True
                every_tick.append((each.pending.append, topic.source))
                continue
            interval_us = STATE_CHECK_US if topic.state else max(topic.interval_ms * 1000, LOOK_US)
            groups.setdefault((interval_us, topic.state, topic.find is not None), {})[each] = topic
        self._groups = tuple(Group(*key[:2], groups[key]) for key in sorted(groups))
        self._every_tick = tuple(every_tick)
        self._flush_us = self._sync_us = now_us + SYNC_US
        self._buffer = []
        count = len(self._subscriptions)
        self._command = Subscription(count, "vehicle_command", commander_rows.vehicle_command, timed=False)
        self._command_ack = Subscription(
            count + 1, "vehicle_command_ack", commander_rows.vehicle_command_ack, timed=False
        )
        self._event = Subscription(count + 2, "event", commander_rows.event, timed=False)
        self._report = Subscription(count + 3, "transponder_report", outside_rows.transponder_report)
        self._request = Subscription(count + 4, "action_request", outside_rows.action_request)
        recently_us = now_us - RECENT_US
        older = [each.number for each in self._topics.commands_told if each.timestamp < recently_us]
        self._told_seen = max(older, default=0)

    def _definitions(self, now_us: int) -> list[bytes]:
        """Everything up to the first data."""
        others = (self._command, self._command_ack, self._event, self._report, self._request)
        subscriptions = [(each.message_id, each.name, each.instance) for each in (*self._subscriptions, *others)]
        boot_unix_us = self._unix_us_of_boot()
        return definitions.messages(now_us, boot_unix_us, self._parameters, subscriptions, self._event_definitions())

    # --- what ----------------------------------------------------------------------------------------------

    def _look(self, now_us: int) -> None:
        """Take what is due, write what has gathered."""
        self._gather_rare(now_us)
        for group in self._groups:
            if now_us < group.due_us:
                continue
            group.due_us = max(group.due_us + group.interval_us, now_us)
            pairs = zip(group.subscriptions, group.records(self._topics), strict=False)
            if group.states:
                self._look_at_states(now_us, pairs)
                continue
            for each, record in pairs:
                if record is not each.last:
                    each.last = record
                    if record.timestamp:  # else nobody has written it yet
                        each.pending.append(record)
        if now_us >= self._flush_us:
            self._now_us = now_us
            self._flush_us = now_us + (SYNC_US if self.stream is None else STREAM_US)
            self._flush(now_us)

    def _look_at_states(self, now_us: int, pairs: Iterable[tuple[Subscription, Any]]) -> None:
        for each, record in pairs:
            if each.timed and not record.timestamp:
                continue  # nobody has written it yet
            last, said = each.last, int(each.timed)
            same = record is last or (last is not None and record[said:] == last[said:])
            if same and (not each.repeat_us or now_us < each.due_us):
                continue
            # looks come up to so late: else every second one would be missed by that
            each.last, each.due_us = record, now_us + each.repeat_us - LOOK_US
            self._buffer.append(each.message(now_us, record))

    def _flush(self, now_us: int) -> None:
        """Pack what has gathered, and write and stream it."""
        buffer, self._buffer = self._buffer, []
        for each in self._subscriptions:
            if each.pending:
                buffer += each.messages()
        if now_us >= self._sync_us:
            self._sync_us = now_us + SYNC_US
            buffer.append(ulog.SYNC)
        if self.stream is not None:
            for message in buffer:
                self.stream.write(message)
        if self.file is not None:
            data = b"".join(buffer)
            self._most_used_bytes = max(self._most_used_bytes, len(data))
            self.file.write(data, self._unix_us_of_boot() + now_us)
            self._end_if_troubled()
        limit_mib = int(self._parameters["SDLOG_MAX_SIZE"])
        if self.file is not None and 0 < limit_mib <= self.file.written_bytes // log_files.MEBIBYTE:
            self.file = None
            self._begin_file(now_us)

    def _gather_rare(self, now_us: int) -> None:
        """Texts, events and changed parameters: all that are not saved whenever one changes, none after disarming."""
        buffer = self._buffer
        buffer += self._said.take_lines()
        parameters = self._parameters
        if parameters.notifications != self._notifications and not self._stop_us:
            self._notifications = parameters.notifications
            for name in sorted(name for name in parameters.unsaved if name in parameters.index):
                buffer.append(ulog.parameter(name, parameters.told(name), parameters.is_float(name)))
        self._gather_queues(buffer)
        buffer += [self._event.message(heard_us, event) for heard_us, event in self._said.take_events()]

    def _gather_queues(self, buffer: list[bytes]) -> None:
        """Commands and their answers, aircraft nearby: each that came."""
        told = self._topics.commands_told
        if told and told[-1].number != self._told_seen:
            for each in told:
                if each.number > self._told_seen and each.result is None:
                    buffer.append(self._command.message(each.timestamp, each.command))
                elif each.number > self._told_seen:
                    answer = each.command, each.result, each.from_outside
                    buffer.append(self._command_ack.message(each.timestamp, answer))
            self._told_seen = told[-1].number
        reports = self._topics.transponder_reports
        if reports and reports[-1].number != self._reports_seen:
            buffer += [self._report.message(0, report) for report in reports if report.number > self._reports_seen]
            self._reports_seen = reports[-1].number
        requests = self._topics.action_requests
        if requests and requests[-1].number != self._requests_seen:
            buffer += [self._request.message(0, each) for each in requests if each.number > self._requests_seen]
            self._requests_seen = requests[-1].number

    # --- for people ----------------------------------------------------------------------------------------

    def status(self) -> list[str]:
        """What the shell's `logger status` prints, line by line, without the prefix."""
        size = sum(each.size for each in self._subscriptions)
        backend = {FILES: "file", MAVLINK: "mavlink", FILES | MAVLINK: "all"}.get(self._backend, "none")
        lines = [
            f"Running in mode: {backend}",
            f"Number of subscriptions: {len(self._subscriptions)} ({size} bytes)",
        ]
        if self.file is not None:
            kib = self.file.written_bytes / 1024.0
            per_s = kib / max((self._now_us - self._started_us) * 1e-6, 1e-3)
            written = f"{kib:4.2f} KiB" if kib < 102.4 else f"{kib / 1024.0:4.2f} MiB"
            lines += [
                "Full File Logging Running:",
                f"Log file: ./log/{self.file.name}",
                f"Wrote {written} (avg {per_s:5.2f} KiB/s)",
                "Since last status: dropouts: 0 (max len: 0.000 s), "
                f"max used buffer: {self._most_used_bytes} / {BUFFER_BYTES} B",
            ]
            self._most_used_bytes = 0
        if self.stream is not None:
            lines.append("Mavlink Logging Running (Full log)")
        if self.file is None and self.stream is None:
            lines.append("Not logging")
        return lines


def _parameter_update(now_us: int, parameters: Parameters) -> ParameterUpdate:
    """How many there are, and how many differ (param_notify_changes)."""
    of_px4 = {name: parameters.typed(name, parameters.row(name)["default"]) for name in parameters}
    others = sum(parameters.default(name) != default for name, default in of_px4.items())
    counts = (len(parameters.announced), len(parameters.changed()), others)
    return ParameterUpdate(now_us, parameters.notifications, *counts)
