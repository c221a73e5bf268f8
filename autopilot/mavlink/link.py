"""One MAVLink link: what goes out on it, what came in, and when its streams are due.

Behaves as PX4's mavlink_main.cpp and mavlink_receiver.cpp: streams keep their average rate (a late message does not
shift the next), frames may be split over datagrams or several be in one, MAVLink 1 and 2 are understood and
MAVLink 2 is answered, the sequence number counts per link. The frames of one moment travel in one datagram.
"""

from collections.abc import Iterable, Iterator
from typing import Any, Final

from sitl_emu.autopilot.constants import HEARTBEAT_TIMEOUT_US
from sitl_emu.autopilot.mavlink import rates
from sitl_emu.autopilot.mavlink.decoder import Message, decode
from sitl_emu.autopilot.mavlink.encoder import Codec, Encoder
from sitl_emu.autopilot.mavlink.message_statistics import MessageStatistics
from sitl_emu.autopilot.mavlink.signature import LinkSigning
from sitl_emu.autopilot.topics import RadioStatus
from sitl_emu.core import framing
from sitl_emu.core.ports import LinkPorts

DATAGRAM_BYTES: Final = 1400
"""A datagram is closed before it would grow longer: it must fit an Ethernet frame."""
RETRY_US: Final = 8_000
"""A stream that had nothing to say is asked again after this long."""
RESTS_AFTER_US: Final = 1_000_000
RESTING_US: Final = 100_000
"""One that has had nothing to say for so long is asked less often: most of those never have, on this vehicle."""
NEVER_RESTS_US: Final = 40_000
"""Interval of a stream that is asked often all the same: who wants 25 a second wants the first at once, too."""
WINDOW_US: Final = 40_000
"""Streams are looked through this often for those that are due before the next time; the others wait unseen."""
NEVER_US: Final = 1 << 62
SHORTEST_INTERVAL_US: Final = 450
"""What is below it and above 0 is never due: the slack that PX4 takes off an interval, three tenths of the main loop's
1.5 ms, makes an unsigned number of it, which wraps (MavlinkStream::update)."""
SHORTEST_WHERE_LIMITED_US: Final = 38
"""The same on a link with a limit: the loop takes 2.5 ms there, and such intervals become twenty times as long."""
RESCALE_US: Final = 1_000_000
"""How often a link looks at what it sends, and a limited one adapts to it."""
MAX_REMOTE_COMPONENTS: Final = 16
"""So many senders are told apart on a link; PX4 takes no note of a further one, which it obeys and acknowledges not."""


class Schedulable:
    """What the schedule needs of a stream (stream.Stream): a class, as compiled code goes straight to its methods."""

    name: str
    codec: Codec
    has_sequel: bool
    """Whether it has more to send after its message."""

    def payloads(self, now_us: int, link: "Link") -> tuple[bytes, ...]:
        """Payloads to send now; empty when there is nothing to say."""
        raise NotImplementedError

    def sent(self, now_us: int, link: "Link") -> None:
        """Its message was sent."""
        raise NotImplementedError

    def forget(self, link: "Link") -> None:
        """The stream was stopped on a link; started again, it says at once what it has."""
        raise NotImplementedError


class ScheduledStream:
    """A stream on a link: its interval, when it should go out, and when it is looked at next."""

    __slots__ = ("due_us", "interval_us", "nominal_us", "parts", "requested_us", "stream")

    def __init__(self, stream: Schedulable, interval_us: int, due_us: int) -> None:
        self.stream, self.requested_us, self.interval_us = stream, interval_us, max(0, interval_us)
        self.nominal_us = self.due_us = due_us
        self.parts = 1
        """Messages that it sent the last time; 0 if it had nothing to say."""


class RemoteComponent:
    """Somebody who speaks on a link."""

    __slots__ = ("last_sequence", "lost", "received")

    def __init__(self) -> None:
        self.received = self.lost = self.last_sequence = 0


class PingStatistics:
    """How long answers to our pings take (PX4: MavlinkReceiver::handle_message_ping)."""

    __slots__ = ("answers", "dropped", "last_ms", "last_sequence", "max_ms", "mean_ms", "min_ms")

    def __init__(self) -> None:
        self.answers = self.dropped = self.last_sequence = 0
        self.last_ms = self.mean_ms = self.max_ms = self.min_ms = 0.0

    def answered(self, took_ms: float, sequence: int) -> None:
        """An answer came; pings before the first one are not counted as lost, and the mean forgets quickly."""
        if self.last_sequence == 0 and sequence > 0:
            self.last_sequence = sequence - 1
        if sequence > self.last_sequence:
            self.dropped += sequence - self.last_sequence - 1
        self.last_sequence = sequence
        self.answers += 1
        self.last_ms, self.mean_ms = took_ms, (took_ms + self.mean_ms) / 2.0
        self.max_ms = max(took_ms, self.max_ms)
        self.min_ms = min(took_ms, self.min_ms) if self.min_ms > 0.0 else took_ms


class Link:
    """One of PX4's MAVLink instances."""

    def __init__(
        self, name: str, mode: str, ports: LinkPorts, encoder: Encoder, signing: LinkSigning | None = None
    ) -> None:
        """`mode` is PX4's: normal, onboard, onboard_low_bandwidth, gimbal, custom.

        Without `signing` nothing is signed.
        """
        self.name = name
        self.mode = mode
        self.forwarding = mode != "custom"
        """Whether messages pass between it and the other links (-f of px4-rc.mavlink)."""
        self.ports = ports
        self.signing = LinkSigning(0, {}) if signing is None else signing
        self.outbox: list[bytes] = []
        """Datagrams ready to be sent; the owner of the socket empties it."""
        self.components: dict[tuple[int, int], RemoteComponent] = {}
        """By (system, component), whoever spoke on this link."""
        self.gcs_heard_us: int | None = None
        """When a ground station's HEARTBEAT was heard on this link."""
        self.gcs_intervals_us = (0, 0)
        """How long after the one before the last two came; 0: nobody knows."""
        self.heartbeats: dict[str, int] = {}
        """When one of a kind was heard, by telemetry_status' field."""
        self.messages_sent = 0
        self.messages_received = 0
        self.bytes_sent = 0
        self.bytes_received = 0
        self.bytes_per_s = (0.0, 0.0)
        """Sent and received, averaged over the last second that was counted."""
        self.messages_lost = 0
        self.parse_errors = 0
        self.statistics: MessageStatistics | None = None
        """None: nobody has asked for them."""
        self.radio: RadioStatus | None = None
        """What its radio told last, while it tells."""
        self.ping_sequence = 0
        self.pings = PingStatistics()
        self.statustext_interval_us = 50_000
        """Interval of STATUSTEXT as it was asked for; -1 is off."""
        self.silent_intervals_us: dict[int, int] = {}
        """Intervals of running streams that never have anything to say (silent_streams.py)."""
        self.requested_once: set[int] = set()
        """Messages that are off but were requested: GET_MESSAGE_INTERVAL says 0 of them."""
        self._encoder = encoder
        self._sequence = 0
        self._pending: list[bytes] = []
        self._pending_bytes = 0
        self._schedule: dict[int, ScheduledStream] = {}
        self._due_us = NEVER_US
        self._in_window: list[ScheduledStream] = []
        self._window_end_us = 0
        self._limit_bytes_per_s = 0.0
        self.rate_multiplier = 1.0
        """What a limited link's rates are multiplied with."""
        self._rescale_us = 0
        self._counted_us = 0
        self._counted_bytes = (0, 0)
        self._splitter = framing.Splitter()

    # --- out ---------------------------------------------------------------------------------------------

    def send_payload(self, codec: Codec, payload: bytes) -> None:
        """Queue one message, as packed by its codec."""
        sequence = self._sequence
        self._sequence = (sequence + 1) & 255
        if self.signing.active:
            self.send_frame(self.signing.signed(codec.frame(payload, sequence, framing.SIGNED)))
        else:
            self.send_frame(codec.frame(payload, sequence))

    def codec(self, message_id: int) -> Codec:
        """Packer of a message, for who packs payloads itself."""
        return self._encoder.codec(message_id)

    def send_fields(self, message_id: int, *fields: Any) -> None:
        """Queue one message given by its fields in wire order, arrays flattened."""
        codec = self._encoder.codec(message_id)
        self.send_payload(codec, codec.pack(*fields))

    def send_frame(self, frame: bytes) -> None:
        """Queue a finished frame (a forwarded one, for instance)."""
        size = len(frame)
        self.messages_sent += 1
        self.bytes_sent += size
        if self._pending_bytes + size > DATAGRAM_BYTES:
            self.flush()
        self._pending.append(frame)
        self._pending_bytes += size

    def flush(self) -> None:
        """Close the datagram that is being filled."""
        pending = self._pending
        if pending:
            self.outbox.append(pending[0] if len(pending) == 1 else b"".join(pending))
            self._pending = []
            self._pending_bytes = 0

    # --- streams -----------------------------------------------------------------------------------------

    def schedule(self, now_us: int, stream: Schedulable, interval_us: int) -> None:
        """Send a stream every `interval_us` (0: as often as it has something new), counted from its last message.

        One that did not run yet counts from now on. A negative interval, too, is none; too short ones are accepted and
        send nothing, as in PX4.
        """
        running = self._schedule.get(stream.codec.id)
        is_new = running is None or running.nominal_us == NEVER_US
        last_us = now_us if running is None or is_new else running.nominal_us - running.interval_us
        shortest_us = SHORTEST_WHERE_LIMITED_US if self._limit_bytes_per_s else SHORTEST_INTERVAL_US
        first_us = NEVER_US if 0 < interval_us < shortest_us else last_us + max(0, interval_us)
        self._schedule[stream.codec.id] = ScheduledStream(stream, interval_us, first_us)
        self._look_again()

    def unschedule(self, message_id: int) -> None:
        """Stop a stream; not an error if it was not running."""
        stopped = self._schedule.pop(message_id, None)
        if stopped is not None:
            stopped.stream.forget(self)
            self._look_again()

    def update_streams(self, now_us: int) -> None:
        """Send every stream that is due; costs next to nothing when none is."""
        if now_us < self._due_us:
            return
        if now_us >= self._window_end_us:
            self._window_end_us = now_us + WINDOW_US
            self._in_window = [item for item in self._schedule.values() if item.due_us < self._window_end_us]
        if now_us >= self._rescale_us:
            self._count_rates(now_us)
            self._rescale_us = now_us + RESCALE_US
            if self._limit_bytes_per_s:
                self._rescale()
        next_due_us = self._window_end_us
        for item in self._in_window:
            if now_us >= item.due_us:
                stream = item.stream
                payloads = stream.payloads(now_us, self)
                if payloads:
                    item.parts = len(payloads)
                    for payload in payloads:
                        self.send_payload(stream.codec, payload)
                    if stream.has_sequel:
                        stream.sent(now_us, self)
                    interval_us = item.interval_us
                    nominal_us = item.nominal_us + interval_us
                    # Late by half an interval it counts anew from now on (MavlinkStream::update)
                    if 2 * (now_us - item.nominal_us) >= interval_us or item.nominal_us > now_us:
                        nominal_us = now_us + interval_us
                    item.nominal_us = item.due_us = nominal_us
                else:
                    silent_us = now_us - item.nominal_us
                    if silent_us > item.interval_us:
                        item.parts = 0
                    rests = silent_us > RESTS_AFTER_US and not 0 < item.interval_us <= NEVER_RESTS_US
                    item.due_us = now_us + (RESTING_US if rests else RETRY_US)
            if item.due_us < next_due_us:
                next_due_us = item.due_us
        self._due_us = next_due_us

    def streams(self) -> Iterable[ScheduledStream]:
        """The streams that run."""
        return self._schedule.values()

    def hurry(self, message_id: int) -> None:
        """Send a running stream's message in this tick, whatever its interval."""
        item = self._schedule.get(message_id)
        if item is not None:
            item.due_us = 0
            self._look_again()

    def _look_again(self) -> None:
        self._due_us = self._window_end_us = 0

    def limit_rate(self, bytes_per_s: float) -> None:
        """Keep the streams within a data rate by scaling them all."""
        self._limit_bytes_per_s = bytes_per_s

    def interval_us(self, message_id: int) -> int | None:
        """Interval that was asked for a stream; None if it is not running."""
        item = self._schedule.get(message_id)
        return self.silent_intervals_us.get(message_id) if item is None else item.requested_us

    def _count_rates(self, now_us: int) -> None:
        elapsed_s = (now_us - self._counted_us) * 1e-6
        if elapsed_s > 0.0:
            sent, received = self._counted_bytes
            self.bytes_per_s = (self.bytes_sent - sent) / elapsed_s, (self.bytes_received - received) / elapsed_s
        self._counted_us, self._counted_bytes = now_us, (self.bytes_sent, self.bytes_received)

    def _rescale(self) -> None:
        running = [
            (item.stream.name, item.stream.codec.size, item.parts * 1e6 / item.requested_us)
            for item in self._schedule.values()
            if item.parts and item.requested_us > 0
        ]
        self.rate_multiplier = multiplier = rates.multiplier(self._limit_bytes_per_s, running)
        for item in self._schedule.values():
            if item.stream.name not in rates.CONSTANT:
                item.interval_us = round(max(0, item.requested_us) / multiplier)

    # --- in ----------------------------------------------------------------------------------------------

    def parse(self, data: bytes) -> Iterator[Message]:
        """The messages that a datagram completes; garbage and what is not signed is skipped."""
        self.bytes_received += len(data)
        for frame in self._splitter.feed(data):
            message = decode(frame)
            if message is None or not self.signing.believes(frame):
                self.parse_errors += 1
                continue
            self._count(message)
            yield message

    def hear_gcs(self, now_us: int, *, was_lost: bool) -> None:
        """A ground station's HEARTBEAT has come; `was_lost`: after a time in which it counted as lost."""
        last_us, self.gcs_heard_us = self.gcs_heard_us, now_us
        if was_lost or last_us is None:
            self.gcs_intervals_us = (0, 0)
        else:
            self.gcs_intervals_us = (self.gcs_intervals_us[1], now_us - last_us)

    def has_gcs(self, now_us: int) -> bool:
        """Whether a ground station is on this link (PX4: is_gcs_connected).

        PX4 counts a heartbeat for 2.5 s. A simulation may be faster than its ground station's clock, whose heartbeats
        are seconds apart then: there one counts for two and a half of its intervals.
        """
        if self.gcs_heard_us is None:
            return False
        counts_us = max(HEARTBEAT_TIMEOUT_US, max(self.gcs_intervals_us) * 5 // 2)
        return now_us - self.gcs_heard_us <= counts_us

    def heard(self, system: int, component: int) -> bool:
        """Whether a component (0: any of the system; system 0: anybody) has spoken on this link."""
        if system == 0:
            return bool(self.components)
        if component == 0:
            return any(heard == system for heard, _ in self.components)
        return (system, component) in self.components

    def _count(self, message: Message) -> None:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        sequence = message.get_seq()
        component = self.components.get(sender)
        if component is None:
            if len(self.components) >= MAX_REMOTE_COMPONENTS:
                return
            component = self.components[sender] = RemoteComponent()
        else:
            # PX4 counts modulo 255 when the number starts anew (MavlinkReceiver::update_rx_stats).
            expected = (component.last_sequence + 1) & 255
            lost = sequence - expected + (255 if sequence < expected else 0)
            component.lost += lost
            self.messages_lost += lost
        component.received += 1
        component.last_sequence = sequence
        self.messages_received += 1
