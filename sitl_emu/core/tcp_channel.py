"""The simulator API over TCP: MAVLink 2 frames between a simulator that listens on 4560+i and an autopilot.

As PX4's src/modules/simulation/simulator_mavlink (v1.18) has it: the autopilot connects, may say HEARTBEAT and
COMMAND_LONG (SET_MESSAGE_INTERVAL) first, which a simulator may pass over, and waits for HIL_SENSOR; it answers with
HIL_ACTUATOR_CONTROLS. The simulated battery travels as BATTERY_STATUS_V2, speed controllers as ESC_STATUS, beacons as
RANGING_BEACON, pictures as CAMERA_IMAGE_CAPTURED, all of which a real PX4 ignores; an autopilot of ours says
PARAM_VALUE, HEARTBEAT, GIMBAL_DEVICE_ATTITUDE_STATUS, CAMERA_SETTINGS, CAMERA_TRIGGER and VIDEO_STREAM_STATUS before an
answer (`simulator_api.BesideMessage`). Other messages are skipped unread, broken frames (wrong CRC) too. Records arrive
with the very values that `MemoryChannel` hands over. Packed and parsed by prepared struct formats, since this runs 250
times a simulated second. No signing, no MAVLink 1.
"""

import contextlib
import errno
import math
import socket
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from fastcrc import crc16

from sitl_emu.core.c_types import Layout
from sitl_emu.core.framing import frame, header_tail
from sitl_emu.core.simulator_api import (
    BATTERY_STATUS_V2_LAYOUT,
    CAMERA_SETTINGS_LAYOUT,
    DISTANCE_SENSOR_LAYOUT,
    GIMBAL_LAYOUT,
    HIL_ACTUATOR_CONTROLS_LAYOUT,
    HIL_GPS_LAYOUT,
    HIL_SENSOR_LAYOUT,
    AutopilotState,
    BesideMessage,
    CameraTrigger,
    CameraZoom,
    ChannelClosed,
    DistanceSensor,
    EscTelemetry,
    GimbalState,
    HilActuatorControls,
    HilGps,
    HilSensor,
    HilStateQuaternion,
    PictureTaken,
    RangingBeacon,
    SimulatedBattery,
    SimulatorMessage,
    SimulatorParameter,
    VideoState,
    pack_battery,
    pack_controls,
    pack_distance,
    pack_gimbal,
    pack_zoom,
    unpack_battery,
    unpack_controls,
    unpack_distance,
    unpack_gimbal,
    unpack_zoom,
)

HIL_STATE_QUATERNION_LAYOUT = Layout("Q4ffffiiihhhHHhhh")
ESC_STATUS_LAYOUT = Layout("Q4i4f4fB")
ESCS_PER_MESSAGE = 4
"""A controller that is not there has no voltage (NaN)."""
RANGING_BEACON_LAYOUT = Layout("QIiifIIIHHBBBBB")
PARAM_VALUE_LAYOUT = Layout("fHH16sB")
HEARTBEAT_LAYOUT = Layout("I5B")
CAMERA_TRIGGER_LAYOUT = Layout("QI")
CAMERA_IMAGE_CAPTURED_LAYOUT = Layout("QI4i4fiBb205s")
VIDEO_STREAM_STATUS_LAYOUT = Layout("fI5HBB")
FIRST_STREAM, STREAM_RUNNING = 1, 1

MAGIC = 0xFD
HEADER_BYTES = 10
CRC_BYTES = 2
SIGNATURE_BYTES = 13
SIGNED = 0x01
READ_BYTES = 1 << 16
SIMULATOR_SYSTEM, SIMULATOR_COMPONENT = 1, 200
AUTOPILOT_SYSTEM, AUTOPILOT_COMPONENT = 1, 1
REAL32 = 9
"""MAV_PARAM_TYPE: every value goes as a float, whole ones too."""
NO_INDEX = 0xFFFF
MAV_TYPE_GENERIC, MAV_AUTOPILOT_PX4, MAVLINK_VERSION = 0, 12, 3

_crc = crc16.mcrf4xx


class _Codec(NamedTuple):
    """How a record becomes a payload and back; `size` is the payload's full length."""

    message_id: int
    crc_extra: bytes
    size: int
    pack: Callable[[Any], bytes]
    unpack: Callable[[bytes], Any]


def _pack_truth(message: HilStateQuaternion) -> bytes:
    return HIL_STATE_QUATERNION_LAYOUT.pack(message.time_usec, *message.attitude_quaternion, *message[2:])


def _unpack_truth(payload: bytes) -> HilStateQuaternion:
    fields = HIL_STATE_QUATERNION_LAYOUT.unpack(payload)
    return HilStateQuaternion._make((fields[0], fields[1:5], *fields[5:]))


def _pack_escs(message: EscTelemetry) -> bytes:
    absent = ESCS_PER_MESSAGE - len(message.rpm)
    rpm, told = message.rpm + (0,) * absent, (0.0,) * len(message.rpm) + (math.nan,) * absent
    return ESC_STATUS_LAYOUT.pack(message.time_usec, *rpm, *told, *told, message.first)


def _unpack_escs(payload: bytes) -> EscTelemetry:
    fields = ESC_STATUS_LAYOUT.unpack(payload)
    there = sum(voltage == voltage for voltage in fields[5:9])
    return EscTelemetry(fields[0], fields[13], fields[1 : 1 + there])


def _pack_ranging(message: RangingBeacon) -> bytes:
    return RANGING_BEACON_LAYOUT.pack(*message, 0, AUTOPILOT_SYSTEM, AUTOPILOT_COMPONENT, 0, 0, 0)


def _unpack_ranging(payload: bytes) -> RangingBeacon:
    return RangingBeacon._make(RANGING_BEACON_LAYOUT.unpack(payload)[:9])


def _pack_parameter(message: SimulatorParameter) -> bytes:
    return PARAM_VALUE_LAYOUT.pack(message.value, 0, NO_INDEX, message.name.encode(), REAL32)


def _unpack_parameter(payload: bytes) -> SimulatorParameter:
    value, _, _, name, _ = PARAM_VALUE_LAYOUT.unpack(payload)
    return SimulatorParameter(name.rstrip(b"\0").decode(errors="replace"), value)


def _pack_trigger(message: CameraTrigger) -> bytes:
    return CAMERA_TRIGGER_LAYOUT.pack(0, message.number)


def _unpack_trigger(payload: bytes) -> CameraTrigger:
    return CameraTrigger(CAMERA_TRIGGER_LAYOUT.unpack(payload)[1])


def _pack_picture(message: PictureTaken) -> bytes:
    return CAMERA_IMAGE_CAPTURED_LAYOUT.pack(*(0,) * 6, *(0.0,) * 4, message.number, 0, message.ok, b"")


def _unpack_picture(payload: bytes) -> PictureTaken:
    fields = CAMERA_IMAGE_CAPTURED_LAYOUT.unpack(payload)
    return PictureTaken(fields[10], fields[12] == 1)


def _pack_video(message: VideoState) -> bytes:
    flags = STREAM_RUNNING if message.running else 0
    return VIDEO_STREAM_STATUS_LAYOUT.pack(0.0, 0, flags, 0, 0, 0, 0, FIRST_STREAM, 0)


def _unpack_video(payload: bytes) -> VideoState:
    return VideoState(bool(VIDEO_STREAM_STATUS_LAYOUT.unpack(payload)[2] & STREAM_RUNNING))


def _pack_state(message: AutopilotState) -> bytes:
    return HEARTBEAT_LAYOUT.pack(0, MAV_TYPE_GENERIC, MAV_AUTOPILOT_PX4, 0, message.system_status, MAVLINK_VERSION)


def _unpack_state(payload: bytes) -> AutopilotState:
    return AutopilotState(HEARTBEAT_LAYOUT.unpack(payload)[4])


CODECS: dict[type, _Codec] = {
    HilSensor: _Codec(
        107,
        b"\x6c",
        HIL_SENSOR_LAYOUT.size,
        lambda message: HIL_SENSOR_LAYOUT.pack(*message),
        lambda payload: HilSensor._make(HIL_SENSOR_LAYOUT.unpack(payload)),
    ),
    HilGps: _Codec(
        113,
        b"\x7c",
        HIL_GPS_LAYOUT.size,
        lambda message: HIL_GPS_LAYOUT.pack(*message),
        lambda payload: HilGps._make(HIL_GPS_LAYOUT.unpack(payload)),
    ),
    DistanceSensor: _Codec(132, b"\x55", DISTANCE_SENSOR_LAYOUT.size, pack_distance, unpack_distance),
    HilStateQuaternion: _Codec(115, b"\x04", HIL_STATE_QUATERNION_LAYOUT.size, _pack_truth, _unpack_truth),
    SimulatedBattery: _Codec(369, b"\x91", BATTERY_STATUS_V2_LAYOUT.size, pack_battery, unpack_battery),
    EscTelemetry: _Codec(291, b"\x0a", ESC_STATUS_LAYOUT.size, _pack_escs, _unpack_escs),
    RangingBeacon: _Codec(510, b"\x63", RANGING_BEACON_LAYOUT.size, _pack_ranging, _unpack_ranging),
    HilActuatorControls: _Codec(93, b"\x2f", HIL_ACTUATOR_CONTROLS_LAYOUT.size, pack_controls, unpack_controls),
    SimulatorParameter: _Codec(22, b"\xdc", PARAM_VALUE_LAYOUT.size, _pack_parameter, _unpack_parameter),
    AutopilotState: _Codec(
        0,
        b"\x32",
        HEARTBEAT_LAYOUT.size,
        _pack_state,
        _unpack_state,
    ),
    CameraTrigger: _Codec(112, b"\xae", CAMERA_TRIGGER_LAYOUT.size, _pack_trigger, _unpack_trigger),
    PictureTaken: _Codec(263, b"\x85", CAMERA_IMAGE_CAPTURED_LAYOUT.size, _pack_picture, _unpack_picture),
    VideoState: _Codec(270, b"\x3b", VIDEO_STREAM_STATUS_LAYOUT.size, _pack_video, _unpack_video),
    GimbalState: _Codec(285, b"\x89", GIMBAL_LAYOUT.size, pack_gimbal, unpack_gimbal),
    CameraZoom: _Codec(260, b"\x92", CAMERA_SETTINGS_LAYOUT.size, pack_zoom, unpack_zoom),
}
FROM_AUTOPILOT = (
    HilActuatorControls,
    SimulatorParameter,
    AutopilotState,
    GimbalState,
    CameraZoom,
    CameraTrigger,
    VideoState,
)
FROM_SIMULATOR = tuple(record for record in CODECS if record not in FROM_AUTOPILOT)
Record = SimulatorMessage | HilActuatorControls | BesideMessage


class Framer:
    """MAVLink 2 frames from records, and records from a stream of bytes; no socket in here."""

    def __init__(self, system: int, component: int, heard: Iterable[type] = tuple(CODECS)) -> None:
        """Who speaks, and which records it wants to hear."""
        self._heard = {CODECS[record].message_id: CODECS[record] for record in heard}
        self._tails = {record: header_tail(system, component, codec.message_id) for record, codec in CODECS.items()}
        self._sequence = 0
        self._buffer = bytearray()

    def encode(self, message: Record) -> bytes:
        """One frame, its payload without trailing zeros, as MAVLink 2 has it."""
        record, sequence = type(message), self._sequence
        codec = CODECS[record]
        self._sequence = (sequence + 1) & 0xFF
        return frame(codec.pack(message), sequence, self._tails[record], codec.crc_extra)

    def decode(self, data: bytes) -> list[Record]:
        """The records that these bytes complete, in order; the rest is kept for later."""
        buffer, heard = self._buffer, self._heard
        buffer += data
        records: list[Record] = []
        at, end = 0, len(buffer)
        while end - at >= HEADER_BYTES + CRC_BYTES:
            if buffer[at] != MAGIC:
                found = buffer.find(MAGIC, at)
                at = end if found < 0 else found
                continue
            length = buffer[at + 1]
            signature = SIGNATURE_BYTES if buffer[at + 2] & SIGNED else 0
            crc_at = at + HEADER_BYTES + length
            if crc_at + CRC_BYTES + signature > end:
                break
            codec = heard.get(int.from_bytes(buffer[at + 7 : at + 10], "little"))
            if codec is not None:
                body = bytes(buffer[at + 1 : crc_at])
                if _crc(body + codec.crc_extra) != buffer[crc_at] | buffer[crc_at + 1] << 8:
                    at += 1  # not a frame, or a broken one: look for the next beginning
                    continue
                records.append(codec.unpack(body[HEADER_BYTES - 1 :].ljust(codec.size, b"\0")[: codec.size]))
            at = crc_at + CRC_BYTES + signature
        del buffer[:at]
        return records


class _TcpChannel:
    """What both ends share: a connected socket, a framer, and who is at the other end (for errors)."""

    def __init__(self, connection: socket.socket, framer: Framer, peer: str) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._framer, self._peer = connection, framer, peer

    def fileno(self) -> int:
        """For select: readable when something came."""
        return self._socket.fileno()

    def close(self) -> None:
        """Hang up; the other end sees ChannelClosed."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise ChannelClosed(f"{self._peer} has gone ({error.strerror or error})") from None

    def _read(self) -> list[Record]:
        """What came; blocks as long as the socket's timeout allows (then TimeoutError, or BlockingIOError)."""
        try:
            data = self._socket.recv(READ_BYTES)
        except (TimeoutError, BlockingIOError):
            raise
        except OSError as error:
            raise ChannelClosed(f"{self._peer} has gone ({error.strerror or error})") from None
        if not data:
            raise ChannelClosed(f"{self._peer} has closed the connection")
        return self._framer.decode(data)


class TcpAutopilotChannel(_TcpChannel):
    """The autopilot's end of the seam over TCP (`simulator_api.AutopilotChannel`)."""

    def __init__(self, connection: socket.socket, port: int) -> None:
        framer = Framer(AUTOPILOT_SYSTEM, AUTOPILOT_COMPONENT, FROM_SIMULATOR)
        super().__init__(connection, framer, f"the simulator on TCP port {port}")
        self._waiting: deque[SimulatorMessage] = deque()
        self._ticks = 0
        """HIL_SENSORs among what is waiting."""

    def receive(self) -> list[SimulatorMessage]:
        """What came up to and with the next HIL_SENSOR, in order; blocks. Raises ChannelClosed."""
        while not self._ticks:
            for record in self._read():
                if not isinstance(record, FROM_AUTOPILOT):
                    self._waiting.append(record)
                    self._ticks += isinstance(record, HilSensor)
        messages: list[SimulatorMessage] = []
        while True:
            message = self._waiting.popleft()
            messages.append(message)
            if isinstance(message, HilSensor):
                self._ticks -= 1
                return messages

    @property
    def ready(self) -> bool:
        """Whether `receive` has a tick in hand and would not block (select knows only what is still in the socket)."""
        return self._ticks > 0

    def send(self, controls: HilActuatorControls, beside: Sequence[BesideMessage] = ()) -> None:
        """Answer a HIL_SENSOR; `beside` comes first. Raises ChannelClosed."""
        encode = self._framer.encode
        self._send(b"".join([encode(message) for message in beside]) + encode(controls))


class TcpSimulatorChannel(_TcpChannel):
    """The simulator's end of the seam over TCP (`simulator_api.SimulatorChannel`)."""

    def __init__(self, connection: socket.socket, port: int) -> None:
        peer = f"the autopilot on TCP port {port}"
        super().__init__(connection, Framer(SIMULATOR_SYSTEM, SIMULATOR_COMPONENT, FROM_AUTOPILOT), peer)
        self._waiting: deque[HilActuatorControls] = deque()
        self._beside: list[BesideMessage] = []
        self._answer_limit_s: float | None = None

    def limit_answers(self, limit_s: float) -> None:
        """From now on an autopilot that does not answer within `limit_s` has hung, and counts as gone."""
        self._answer_limit_s = limit_s
        self._socket.settimeout(limit_s)

    def send(self, messages: list[SimulatorMessage]) -> None:
        """One tick's messages, HIL_SENSOR last. Raises ChannelClosed."""
        encode = self._framer.encode
        self._send(b"".join([encode(message) for message in messages]))

    def receive(self) -> HilActuatorControls:
        """The answer to the last HIL_SENSOR; blocks. Raises ChannelClosed."""
        while not self._waiting:
            try:
                self._take()
            except TimeoutError:
                raise ChannelClosed(f"{self._peer} has not answered for {self._answer_limit_s:g} s") from None
        return self._waiting.popleft()

    def poll(self, timeout_s: float) -> HilActuatorControls | None:
        """An answer if one comes in time. For a real PX4, which answers only when its outputs have started.

        Raises ChannelClosed.
        """
        if not self._waiting:
            self._socket.settimeout(timeout_s)
            try:
                self._take()
            except (TimeoutError, BlockingIOError):
                return None
            finally:
                self._socket.settimeout(self._answer_limit_s)
        return self._waiting.popleft() if self._waiting else None

    def newest(self, timeout_s: float) -> HilActuatorControls | None:
        """The last answer of those that have come by now; waits up to `timeout_s` for a first. Raises ChannelClosed.

        For an autopilot that listens for a while before it speaks, as a real PX4 does, so that it is not one tick
        behind from then on.
        """
        answer = self.poll(timeout_s)
        while answer is not None and (later := self.poll(0.0)) is not None:
            answer = later
        return answer

    def beside(self) -> Sequence[BesideMessage]:
        """What came beside the answers since this was asked last, in order."""
        if not self._beside:
            return ()
        said = self._beside[:]
        self._beside.clear()
        return said

    def _take(self) -> None:
        for record in self._read():
            if isinstance(record, HilActuatorControls):
                self._waiting.append(record)
            elif isinstance(record, BesideMessage):
                self._beside.append(record)


class SimulatorListener:
    """A simulator's TCP port, open for one autopilot."""

    port: int

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        """`port` 0: any that is free. Raises OSError that names the port and says what to do when it is taken."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._socket.bind((host, port))
            self._socket.listen(1)
            self.port = self._socket.getsockname()[1]
        except OSError as error:
            self._socket.close()
            if error.errno == errno.EADDRINUSE:
                text = f"TCP port {port} is in use, by another simulator or run; end that one, or use another instance"
                raise OSError(errno.EADDRINUSE, text) from None
            raise OSError(error.errno, f"TCP port {port} on {host} cannot be opened: {error.strerror}") from None

    def fileno(self) -> int:
        """For select: readable when an autopilot wants to connect."""
        return self._socket.fileno()

    def accept(self, timeout_s: float | None = None) -> TcpSimulatorChannel:
        """Wait for the autopilot; the port then closes for others. Raises ChannelClosed when none comes in time."""
        self._socket.settimeout(timeout_s)
        try:
            connection, _ = self._socket.accept()
        except TimeoutError:
            text = f"no autopilot has connected to TCP port {self.port} within {timeout_s:g} s"
            raise ChannelClosed(text) from None
        finally:
            self._socket.close()
        connection.settimeout(None)
        return TcpSimulatorChannel(connection, self.port)

    def close(self) -> None:
        """Give the port up without having accepted anybody."""
        self._socket.close()


def connect(port: int, host: str = "127.0.0.1") -> TcpAutopilotChannel:
    """Connect an autopilot to its simulator. Raises ChannelClosed when none listens there."""
    try:
        connection = socket.create_connection((host, port), timeout=10.0)
    except UnicodeError:
        raise ChannelClosed(f"no simulator answers on {host}, TCP port {port} (this is no host's name)") from None
    except OSError as error:
        raise ChannelClosed(f"no simulator answers on {host}, TCP port {port} ({error.strerror or error})") from None
    connection.settimeout(None)
    return TcpAutopilotChannel(connection, port)
