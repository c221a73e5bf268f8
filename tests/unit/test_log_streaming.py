"""Log streaming: PX4's half as a transcript, and both halves over links that lose messages."""

import io
import random
from collections.abc import Callable
from typing import Any

import pytest
from pyulog import ULog

from sitl_emu.autopilot.logger.log_stream import CHUNK_BYTES, NO_MESSAGE_BEGINS, LogStream
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink.context import BOOT_UNIX_US
from sitl_emu.autopilot.mavlink.mavlink import Modules
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.log_streaming import LogStreaming
from tests.unit.mavlink_peer import GCS, ONBOARD, PAYLOAD, TICK_US, HandleCommand, Peer, command_long, only

START, STOP = 2510, 2511
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, IN_PROGRESS = 0, 1, 2, 3, 5


class LoggingPeer(Peer):
    """A ground station at an autopilot whose logger runs."""

    def __init__(self, backend: int) -> None:
        self._backend = backend
        super().__init__()

    def modules(self, handle_command: HandleCommand) -> Modules:
        self.parameters.set("SDLOG_BACKEND", self._backend)
        self.logger = Logger(self.topics, self.parameters, self.texts, None, lambda: BOOT_UNIX_US)
        return Modules(handle_command, logger=self.logger)


class Rig:
    """An autopilot's MAVLink with a logger and topics that change."""

    def __init__(self, backend: int = 3) -> None:
        self.peer = LoggingPeer(backend)
        self.logger = self.peer.logger

    def command(self, number: int, param1: float = 0.0, link: int = GCS) -> list[Any]:
        return self.peer.send(command_long(number, param1), link)

    def ack(self, sequence: int, link: int = GCS) -> list[Any]:
        return self.peer.send(mavlink.MAVLink_logging_ack_message(1, 1, sequence), link)

    def run(self, seconds: float, link: int = GCS) -> list[Any]:
        heard = []
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.peer.now_us += TICK_US
            self.peer.fly()
            self.logger.update(self.peer.now_us)
            self.peer.mavlink.update(self.peer.now_us)
            heard += self.peer.received(link)
        return heard

    def define(self, messages: list[Any], link: int = GCS) -> bytes:
        """Acknowledge whatever wants it; what came that way."""
        data = b""
        while chunks := only(messages, "LOGGING_DATA_ACKED"):
            assert len(chunks) == 1
            data += bytes(chunks[0].data[: chunks[0].length])
            messages = self.ack(chunks[0].sequence, link)
        return data


def results(messages: list[Any]) -> list[tuple[int, int]]:
    return [(ack.command, ack.result) for ack in only(messages, "COMMAND_ACK")]


# --- chunks ----------------------------------------------------------------------------------------------------


def test_chunks_are_filled_and_say_where_a_message_begins() -> None:
    stream = LogStream([bytes((n,)) * 200 for n in range(3)])
    chunks = list(stream.reliable)
    assert [(chunk.sequence, len(chunk.data), chunk.first_message_offset) for chunk in chunks] == [
        (0, 249, 0),
        (1, 249, 151),
        (2, 102, NO_MESSAGE_BEGINS),
    ]
    assert b"".join(chunk.data for chunk in chunks) == b"\0" * 200 + b"\1" * 200 + b"\2" * 200
    stream.write(b"lost while acknowledgements are waited for")
    for _ in chunks:
        stream.acknowledge()
    stream.write(b"x" * 600)
    stream.write(b"y" * 147)
    assert [(chunk.sequence, chunk.first_message_offset, chunk.reliable) for chunk in stream.ready] == [
        (3, 0, False),
        (4, NO_MESSAGE_BEGINS, False),
        (5, 102, False),
    ]
    assert all(len(chunk.data) == CHUNK_BYTES for chunk in stream.ready)


# --- commands --------------------------------------------------------------------------------------------------


def test_start_is_accepted_and_the_first_chunk_follows_at_once() -> None:
    rig = Rig()
    messages = rig.command(START)
    assert results(messages) == [(START, ACCEPTED)]
    (chunk,) = only(messages, "LOGGING_DATA_ACKED")
    assert (chunk.sequence, chunk.length, chunk.first_message_offset) == (0, 249, 0)
    assert (chunk.target_system, chunk.target_component) == (255, 190)
    assert bytes(chunk.data[:4]) == b"ULog"


def test_nobody_acknowledges_so_a_chunk_comes_50_times_and_commands_wait_2_5_s() -> None:
    rig = Rig()
    rig.command(START)
    heard = rig.run(1.0)
    assert results(rig.command(STOP)) == []
    assert results(rig.command(START)) == []
    heard += rig.run(1.4)
    assert results(heard) == []
    assert {chunk.sequence for chunk in only(heard, "LOGGING_DATA_ACKED")} == {0}
    later = rig.run(0.2)
    assert results(later) == [(STOP, ACCEPTED), (START, ACCEPTED)]
    heard += later
    assert len(only(heard, "LOGGING_DATA_ACKED")) == 49
    assert not only(rig.run(2.6), "LOGGING_DATA_ACKED"), "the second stream goes nowhere"
    assert results(rig.command(STOP)) == [(STOP, ACCEPTED)]
    assert results(rig.command(START)) == [(START, ACCEPTED)]


def test_a_second_stream_is_rejected_and_an_unknown_format_is_unsupported() -> None:
    rig = Rig()
    for param1 in (1.0, -1.0, 0.5):
        assert results(rig.command(START, param1)) == [(START, UNSUPPORTED)]
    nan = float("nan")  # lroundf's LONG_MIN, cut to an int, is 0 (Logger::handle_vehicle_command_update)
    rig.define(rig.command(START, nan))
    assert results(rig.command(START, link=ONBOARD)) == [(START, REJECTED)]
    assert only(rig.run(1.0), "LOGGING_DATA"), "the first one goes on"
    assert results(rig.command(STOP)) == [(STOP, IN_PROGRESS)]
    assert results(rig.run(0.1)) == [(STOP, ACCEPTED)]
    assert not only(rig.run(1.0), "LOGGING_DATA")


def test_without_a_stream_stop_is_accepted() -> None:
    assert results(Rig().command(STOP)) == [(STOP, ACCEPTED)]


def test_a_slow_link_is_denied_and_told() -> None:
    rig = Rig()
    assert results(rig.command(START, link=PAYLOAD)) == [(START, DENIED)]
    assert [text.text for text in rig.peer.texts.recent] == ["Not enough bandwidth to enable log streaming\t"]


@pytest.mark.parametrize(("backend", "answer"), [(0, []), (1, [(START, REJECTED)]), (2, [(START, ACCEPTED)])])
def test_sdlog_backend_says_whether_there_are_streams(backend: int, answer: list[tuple[int, int]]) -> None:
    assert results(Rig(backend).command(START)) == answer


def test_wrong_acknowledgements_change_nothing() -> None:
    rig = Rig()
    assert rig.ack(0) == []
    rig.command(START)
    assert rig.ack(1) == []
    assert rig.ack(0, ONBOARD) == [] and rig.peer.received(GCS) == []
    (following,) = only(rig.ack(0), "LOGGING_DATA_ACKED")
    assert following.sequence == 1
    assert rig.ack(0) == []


def test_the_log_has_the_command_and_its_answer_and_of_a_link_that_is_too_slow_the_answer_alone() -> None:
    rig = Rig()
    rig.command(START)
    rig.command(START, link=PAYLOAD)
    told = [(each.command.command, each.result and each.result[0]) for each in rig.peer.topics.commands_told]
    assert told == [(START, None), (START, ACCEPTED), (START, DENIED)]


def test_an_acknowledgement_counts_whomever_it_is_for() -> None:
    rig = Rig()
    rig.command(START)
    (following,) = only(rig.peer.send(mavlink.MAVLink_logging_ack_message(2, 1, 0)), "LOGGING_DATA_ACKED")
    assert following.sequence == 1


def test_definitions_come_acknowledged_and_data_does_not() -> None:
    rig = Rig()
    definitions = rig.define(rig.command(START))
    log = ULog(io.BytesIO(definitions))
    assert log.initial_parameters["SYS_AUTOSTART"] == rig.peer.parameters["SYS_AUTOSTART"]
    heard = rig.run(2.0)
    assert not only(heard, "LOGGING_DATA_ACKED")
    sequences = [chunk.sequence for chunk in only(heard, "LOGGING_DATA")]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    assert len(sequences) > 100


# --- both halves -----------------------------------------------------------------------------------------------


def streamed(rig: Rig, client: LogStreaming, seconds: float, is_lost: Callable[[], bool] = lambda: False) -> None:
    """Let both ends talk for a time, or until the client is done."""
    for _ in range(round(seconds * 1e6 / TICK_US)):
        outgoing, incoming = client.on_time(rig.peer.now_us), rig.run(TICK_US * 1e-6)
        while outgoing or incoming:
            incoming += [answer for message in outgoing if not is_lost() for answer in rig.peer.send(message)]
            outgoing = [
                answer
                for message in incoming
                if not is_lost()
                for answer in client.on_message(rig.peer.now_us, message)
            ]
            incoming = []
        if client.done:
            return


def test_a_streamed_log_opens_in_pyulog() -> None:
    rig, client = Rig(), LogStreaming(1)
    streamed(rig, client, 5.0)
    client.stop()
    streamed(rig, client, 2.0)
    assert client.done
    assert rig.logger.stream is None
    log = ULog(io.BytesIO(client.log))
    assert not log.file_corruption and not log.dropouts
    imu = log.get_dataset("sensor_combined").data["timestamp"]
    assert len(imu) > 1000
    assert {int(step) for step in imu[1:] - imu[:-1]} == {TICK_US}


@pytest.mark.parametrize("loss", [0.05, 0.1, 0.3])
def test_a_stream_that_loses_chunks_has_dropouts_and_whole_messages(loss: float) -> None:
    chance = random.Random(1)
    rig, client = Rig(), LogStreaming(1)
    streamed(rig, client, 40.0, lambda: chance.random() < loss)
    log = ULog(io.BytesIO(client.log))
    assert not log.file_corruption
    assert len(log.dropouts) == client.dropouts > 10
    imu = log.get_dataset("sensor_combined").data["timestamp"]
    assert all(imu[1:] > imu[:-1])
    assert len(log.initial_parameters) == len(list(rig.peer.parameters))


def test_a_refusal_and_silence_are_told() -> None:
    rig, client = Rig(backend=3), LogStreaming(1)
    rig.define(rig.command(START, link=ONBOARD), ONBOARD)
    streamed(rig, client, 5.0)
    assert (client.done, client.refusal) == (True, "temporarily rejected")
    client = LogStreaming(1)
    streamed(rig, client, 20.0, lambda: True)
    assert (client.done, client.refusal) == (True, "no answer to 10 tries")
