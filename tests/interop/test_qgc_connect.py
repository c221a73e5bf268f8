"""QGroundControl connects, flies and comes back: its recorded side, replayed against our autopilot on simulated time.

qgc_connect.json holds, in the order of the recording, what QGroundControl sent and what a PX4 answered; file transfers
are made as QGroundControl makes them (its sequence numbers depend on the sizes of the files). Every question that
PX4 answered must be answered, in kind, and in the order in which QGroundControl waits for the answers.
"""

import json
import lzma
import math
import struct
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from tests.hostile import TICK_US, Victim

RECORDING: dict[str, Any] = json.loads(Path(__file__).with_name("qgc_connect.json").read_text())
ANSWER_LIMIT_S = 1.0
"""QGroundControl waits 1.5 s for a plan's count, 3 s for an acknowledgement, 1 s for a requested message."""
FLIGHT_LIMIT_S = 180.0
PING_LIMIT_S = 11.0
PARAMETERS_LIMIT_S = 2.0
BURST_BYTES = 239
ACK, NAK, EOF = 128, 129, 6
OPEN_FILE_RO, BURST_READ_FILE, RESET_SESSIONS = 4, 15, 2
NO_INDEX = 65535
SLOW_ANSWERS = {"HEARTBEAT": FLIGHT_LIMIT_S, "STATUSTEXT": FLIGHT_LIMIT_S, "PING": PING_LIMIT_S}
UNASKED = ("EVENT", "STATUSTEXT", "HEARTBEAT")
"""No answers in a row with others: they only have to come after what caused them."""
NOTED = {mavlink.MAVLINK_MSG_ID_PARAM_VALUE, mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL} | {
    getattr(mavlink, f"MAVLINK_MSG_ID_{step[1]}")
    for part in ("connect", "reconnect", "actions")
    for step in RECORDING[part]
    if step[0] == "vehicle"
}
"""Messages that are decoded; telemetry is not."""
REQUEST_CAMERA_INFORMATION = 521


class QGroundControl:
    """255/190 on the first link: sends what it is told to, beats once a second, and remembers what it hears."""

    def __init__(self, folder: Path) -> None:
        storage.prepare(folder)
        self._victim = Victim("sihsim_hex", folder)
        self._link = self._victim.autopilot.mavlink.links[0]
        self._ear: Any = mavlink.MAVLink(None)
        self._beats = False
        self._ftp_sequence = 1
        self.heard: list[Any] = []
        self.position = 0
        """Where in `heard` the last answer was found."""
        self.asked = 0
        """How much was heard when the last question was sent."""
        self.hash_value = 0.0

    @property
    def now_s(self) -> float:
        return self._victim.autopilot.now_us * 1e-6

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.tick()

    def tick(self) -> None:
        if self._beats and self._victim.ticks % 250 == 0:
            self._victim.say(mavlink.MAVLink_heartbeat_message(6, 8, 192, 0, 4, 3))
        self._victim._step()
        self._listen()

    def send(self, message: Any) -> None:
        self._beats = True
        self.asked = len(self.heard)
        self._victim.say(message)
        self._listen()

    def _listen(self) -> None:
        data = b"".join(self._link.outbox)
        for link in self._victim.autopilot.mavlink.links:
            link.outbox.clear()
        for frame in framing.split(data):
            if framing.message_id(frame) in NOTED:
                self.heard.append(self._ear.decode(bytearray(frame)))

    def wait(self, name: str, fields: dict[str, Any], since: int, limit_s: float) -> int:
        """The place in `heard`, from `since` on, of a message with these fields; AssertionError if none comes."""
        end_s, place = self.now_s + limit_s, since
        while True:
            for found in range(place, len(self.heard)):
                if matches(self.heard[found], name, fields):
                    return found
            place = len(self.heard)
            if self.now_s >= end_s:
                seen = sorted({m.get_type() for m in self.heard[since:]})
                raise AssertionError(f"no {name} {fields} within {limit_s} s; heard {seen}")
            self.tick()

    def replay(self, steps: list[Any]) -> None:
        """Send QGroundControl's part; AssertionError where an answer is missing or in another order."""
        self.position = len(self.heard)
        for number, (side, *step) in enumerate(steps):
            if side == "qgc":
                self.send(self._message(*step))
            elif side == "download":
                assert self.download(step[0]), f"step {number}: {step[0]} is empty"
            else:
                name, fields = step
                since = self.asked if name in UNASKED else self.position
                place = self.wait(name, fields, since, SLOW_ANSWERS.get(name, ANSWER_LIMIT_S))
                if name not in UNASKED:
                    self.position = place + 1
                if fields.get("param_id") == "_HASH_CHECK":
                    self.hash_value = self.heard[place].param_value

    def _message(self, name: str, fields: dict[str, Any]) -> Any:
        given = dict(fields)
        for number, value in enumerate(given.pop("params", ()), 1):
            given[f"param{number}"] = value
        if name == "PING":
            asked = next(m for m in reversed(self.heard) if m.get_type() == "PING")
            given = {"time_usec": asked.time_usec, "seq": asked.seq, "target_system": 1, "target_component": 1}
        if given.get("param_id") == "_HASH_CHECK":
            given["param_value"] = self.hash_value
        kind: Any = getattr(mavlink, f"MAVLink_{name.lower()}_message")
        return kind(*(number_of(given.get(field, 0)) for field in kind.fieldnames))

    # --- MAVLink FTP as QGroundControl uses it -----------------------------------------------------------------

    def download(self, path: str) -> bytes:
        """A file by OpenFileRO, BurstReadFile until EOF and ResetSessions, with QGroundControl's checks."""
        (opened,) = self._ask(OPEN_FILE_RO, path.encode())
        assert (opened.opcode, len(opened.data)) == (ACK, 4), path
        (size,) = struct.unpack("<I", opened.data)
        content = b""
        while True:
            replies = self._ask(BURST_READ_FILE, b"", len(content))
            ended = [reply for reply in replies if reply.opcode == NAK]
            for reply in replies:
                if reply.opcode == ACK:
                    assert reply.offset == len(content)
                    content += reply.data
            if ended:
                assert ended[0].data == bytes((EOF,))
                break
        assert len(content) == size
        (reset,) = self._ask(RESET_SESSIONS)
        assert reset.opcode == ACK
        return content

    def _ask(self, opcode: int, data: bytes = b"", offset: int = 0) -> list["FtpReply"]:
        request, size = self._ftp_sequence, len(data) if opcode != BURST_READ_FILE else BURST_BYTES
        payload = struct.pack("<HBBBBBBI", request, 0, opcode, size, 0, 0, 0, offset) + data
        since = len(self.heard)
        self.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [*payload.ljust(251, b"\0")]))
        replies: list[FtpReply] = []
        end_s = self.now_s + ANSWER_LIMIT_S
        while not (replies and replies[-1].last):
            assert self.now_s < end_s, f"FTP opcode {opcode}: no answer within {ANSWER_LIMIT_S} s"
            for message in self.heard[since:]:
                if message.get_type() == "FILE_TRANSFER_PROTOCOL":
                    replies.append(FtpReply(bytes(message.payload), opcode))
                    assert replies[-1].sequence == request + len(replies)
                    end_s = self.now_s + ANSWER_LIMIT_S
            since = len(self.heard)
            if not (replies and replies[-1].last):
                self.tick()
        self._ftp_sequence = replies[-1].sequence + 1
        return replies


class FtpReply:
    """What a FILE_TRANSFER_PROTOCOL of the vehicle says."""

    def __init__(self, payload: bytes, request: int) -> None:
        head = struct.unpack_from("<HBBBBBBI", payload)
        self.sequence, _, self.opcode, size, req_opcode, complete, _, self.offset = head
        assert req_opcode == request
        self.data = payload[12 : 12 + size]
        self.last = request != BURST_READ_FILE or bool(complete) or self.opcode == NAK


def number_of(value: Any) -> Any:
    """A field of the recording as pymavlink wants it."""
    if value == "NaN":
        return math.nan
    if isinstance(value, str):
        return getattr(mavlink, value) if value.startswith("MAV_") else value.encode()
    return value


def matches(message: Any, name: str, fields: dict[str, Any]) -> bool:
    """Whether a message is the one that was recorded; modes and arming as HEARTBEAT shows them."""
    if message.get_type() != name or message.get_srcComponent() != 1:
        return False
    for field, value in fields.items():
        if field == "armed":
            found: Any = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        else:
            found = getattr(message, field)
        wanted = value if isinstance(value, bool) or field in ("text", "uri", "param_id") else number_of(value)
        if isinstance(found, str):
            found = found.rstrip("\0")
        if found != wanted:
            return False
    return True


@pytest.fixture
def qgc(tmp_path: Path) -> QGroundControl:
    """A ground station at a vehicle that has been up for fifteen seconds, as in the recording."""
    station = QGroundControl(tmp_path)
    station.run(15.0)
    return station


def parameters(heard: list[Any]) -> list[int]:
    """Indices of a parameter list. What is told before its hash is left out: the declination that PX4 saves."""
    values = [m for m in heard if m.get_type() == "PARAM_VALUE"]
    begin = next((place for place, m in enumerate(values) if m.param_index == NO_INDEX), 0)
    return [m.param_index for m in values[begin:] if m.param_index != NO_INDEX]


def test_the_first_connect(qgc: QGroundControl) -> None:
    qgc.replay(RECORDING["connect"])
    values = [m for m in qgc.heard if m.get_type() == "PARAM_VALUE" and m.param_index != NO_INDEX]
    assert parameters(qgc.heard) == list(range(values[0].param_count))
    acked = {m.command for m in qgc.heard if m.get_type() == "COMMAND_ACK"}
    assert REQUEST_CAMERA_INFORMATION not in acked


def test_the_whole_parameter_list_comes_within_a_second(qgc: QGroundControl) -> None:
    qgc.send(mavlink.MAVLink_param_request_list_message(1, 0))
    start = len(qgc.heard)
    qgc.run(PARAMETERS_LIMIT_S / 2)
    values = [m for m in qgc.heard[start:] if m.get_type() == "PARAM_VALUE"]
    assert parameters(values) == list(range(values[0].param_count))


def test_metadata_files_are_what_the_general_file_says(qgc: QGroundControl) -> None:
    qgc.send(mavlink.MAVLink_heartbeat_message(6, 8, 192, 0, 4, 3))
    general = json.loads(lzma.decompress(qgc.download("/etc/extras/component_general.json.xz")))
    for entry in general["metadataTypes"]:
        path = entry["uri"].removeprefix("mftp:/")
        assert json.loads(lzma.decompress(qgc.download(path)))


@pytest.mark.slow
def test_a_flight_from_the_screen_and_the_reconnect(qgc: QGroundControl) -> None:
    qgc.replay(RECORDING["connect"])
    qgc.replay(RECORDING["actions"])
    # QGroundControl is started anew: its caches hold the files, so it asks for the rest only.
    qgc._ftp_sequence = 1
    start = len(qgc.heard)
    qgc.replay(RECORDING["reconnect"])
    count = next(m.param_count for m in qgc.heard[start:] if m.get_type() == "PARAM_VALUE")
    qgc.run(1.0)
    assert parameters(qgc.heard[start:]) == list(range(count))
    start = len(qgc.heard)
    qgc.replay(RECORDING["reconnect_params_unchanged"])
    stopped = len(qgc.heard)
    qgc.run(PARAMETERS_LIMIT_S)
    assert parameters(qgc.heard[stopped:]) == []
    assert len(parameters(qgc.heard[start:stopped])) < count
