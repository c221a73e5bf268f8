"""Hostile bytes for an autopilot's links, and a flying autopilot that must bear them.

`Nonsense` makes well-formed messages of every id of the dialect with fields at random and at their limits, `mutated`
spoils real traffic, `Victim` is an autopilot in its simulator, without sockets, that looks after every batch whether
anything broke. One seed, one sequence of datagrams. tests/unit/test_hostile_bytes.py and tools/fuzz.py use it.
"""

import gc
import math
import random
import re
import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.mavlink.signature import NO_KEY
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.gcs.command import Command, arm
from sitl_emu.gcs.mission import MissionDownload, MissionItem, MissionUpload
from sitl_emu.gcs.parameter import ParameterList, ParameterRead, ParameterSet
from sitl_emu.gcs.set_mode import set_mode
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICK_US = 4_000
LINKS = 4
FED_BYTES = 200_000
"""Kept of what came on a link: a few datagrams of the largest size."""
SENDERS = ((255, 190), (245, 191), (1, 1), (1, 100), (1, 191), (2, 1), (0, 0), (255, 0), (77, 77))
TARGET_SYSTEMS = (1, 1, 1, 1, 0, 255, 2)
TARGET_COMPONENTS = (1, 1, 1, 0, 100, 154, 190, 255)
FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-30, 1e-45, 1e9, -1e9, 3.4e38, -3.4e38, 2147483648.0, 65536.5)
NO_FLOATS = (math.nan, math.inf, -math.inf)
STRINGS = (
    b"",
    b"\0" * 8 + b"tail",
    b"\xff" * 255,
    b"\x80\x81\xfe\xff",
    b"%s%n%x%d" * 20,
    b"../../../../etc/passwd",
    b"/dev/zero",
    b"\x1b[2J\r\n\t\b",
    "ü€😀".encode() * 30,
    b"MPC_XY_VEL_MAX",
    b"_HASH_CHECK",
    b"A" * 255,
)
NOT_COMMANDED = {mavlink.MAV_CMD_DO_FLIGHTTERMINATION}
"""Ends a flight for good: what comes after it would try little."""
FTP_PATHS = (
    b"/",
    b"etc/extras",
    b"log",
    b"fs/microsd/log",
    b"../..",
    b"new.bin",
    b"mavlink/mavlink-signing-key.bin",
    b"",
)
SHELL_LINES = (
    b"help",
    b"ver all",
    b"param show MPC*",
    b"param set MPC_XY_P nan",
    b"listener vehicle_status",
    b"mavlink status",
)
SHARE_HEARD = 0.6
"""Share of messages that the autopilot listens to; the others are any of the dialect."""
NEVER_NAN = {
    "vehicle_attitude": ("q", "euler"),
    "vehicle_angular_velocity": ("xyz",),
    "vehicle_local_position": ("x", "y", "z", "vx", "vy", "vz", "heading"),
    "vehicle_global_position": ("lat", "lon", "alt"),
    "actuator_outputs": ("controls",),
    "battery_status": ("voltage_v", "remaining"),
    "manual_control_setpoint": ("roll", "pitch", "yaw", "throttle"),
}
"""Topics and fields that are numbers whatever happens; others use NaN for what is not given, as PX4's do."""
NEVER_NAN_SENT = {
    name: struct.Struct(mavlink.mavlink_map[number].unpacker.format)
    for name, number in (
        ("ATTITUDE", mavlink.MAVLINK_MSG_ID_ATTITUDE),
        ("ATTITUDE_QUATERNION", mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION),
        ("LOCAL_POSITION_NED", mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED),
        ("VFR_HUD", mavlink.MAVLINK_MSG_ID_VFR_HUD),
        ("HIGHRES_IMU", mavlink.MAVLINK_MSG_ID_HIGHRES_IMU),
        ("VIBRATION", mavlink.MAVLINK_MSG_ID_VIBRATION),
    )
}
NOT_MEASURED = {"VFR_HUD": 1}
"""Of these messages so many fields in front are NaN, as there is no sensor: the airspeed."""
CHECKED_IDS = {mavlink.MAVLINK_MSG_ID_ATTITUDE: "ATTITUDE"} | {
    int(getattr(mavlink, f"MAVLINK_MSG_ID_{name}")): name for name in NEVER_NAN_SENT
}


class _Place(NamedTuple):
    """One place in a message's layout."""

    code: str
    bytes: int
    choices: Sequence[int] = ()


NOT_SAID, NOT_SET = {mavlink.MAVLINK_MSG_ID_BATTERY_STATUS}, ("BAT", "SIM_BAT")
"""By these a battery seems empty, and one that stands is then turned off and answers no more, as a real PX4
(Commander::battery_status_check)."""


class Nonsense:
    """Well-formed frames with senseless content."""

    def __init__(self, chance: random.Random, heard: Iterable[int], names: Sequence[str]) -> None:
        """`heard`: ids that the autopilot listens to; `names`: parameters."""
        self._chance = chance
        self._all = sorted(set(mavlink.mavlink_map) - NOT_SAID)
        self._heard = sorted(set(heard) - NOT_SAID)
        self._names = [name.encode() for name in names if not name.startswith(NOT_SET)]
        self._commands = sorted(set(mavlink.enums["MAV_CMD"]) - NOT_COMMANDED)
        self._layouts: dict[int, list[_Place]] = {}

    def frame(self) -> bytes:
        """One of MAVLink 2, or of 1 where that has the message."""
        chance = self._chance
        number = chance.choice(self._heard if chance.random() < SHARE_HEARD else self._all)
        layout = self._layouts.get(number) or self._layouts.setdefault(number, self._places(number))
        shaped = self._shaped(number)
        payload = (
            shaped
            if shaped is not None
            else struct.pack(
                "<" + "".join(f"{p.bytes}s" if p.code == "s" else p.code for p in layout), *map(self._value, layout)
            )
        )
        table: Any = mavlink.mavlink_map[number]
        sender = chance.choice(SENDERS)
        extra = bytes((table.crc_extra,))
        if number < 256 and chance.random() < 0.1:
            body = bytes((len(payload), chance.getrandbits(8), *sender, number)) + payload
            return b"\xfe" + body + struct.pack("<H", framing._crc(body + extra))
        return framing.frame(payload, chance.getrandbits(8), framing.header_tail(*sender, number), extra)

    def _shaped(self, number: int) -> bytes | None:
        """Messages that carry another protocol, of which at least the head makes sense; None leaves it to chance."""
        chance = self._chance
        if chance.random() < 0.3:
            return None
        if number == mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            path = chance.choice(FTP_PATHS) + (b"\0" + chance.choice(FTP_PATHS) if chance.random() < 0.3 else b"")
            size = chance.choice((len(path), 0, 4, 239, 255))
            head = (chance.getrandbits(16), chance.choice((0, 0, 0, 1, 255)), chance.randrange(18), size, 0, 0, 0)
            return (
                bytes((0, 1, 1))
                + (struct.pack("<HBBBBBBI", *head, chance.choice((0, 1, 239, 1 << 31, (1 << 32) - 1))) + path).ljust(
                    251, b"\0"
                )[:251]
            )
        if number == mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL:
            line = chance.choice(SHELL_LINES) + chance.choice((b"\n", b"\r\n", b"", b"\xff\n"))
            return struct.pack("<IHBBB70s", 0, 0, 10, chance.getrandbits(8), chance.choice((len(line), 70, 255)), line)
        if number == mavlink.MAVLINK_MSG_ID_PARAM_SET and self._names:
            kind = chance.choice(
                (mavlink.MAV_PARAM_TYPE_INT32, mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_REAL32)
            )
            value = self._value(_Place("f", 4)) if kind == mavlink.MAV_PARAM_TYPE_REAL32 else 0.0
            raw = (
                struct.pack("<f", value)
                if kind == mavlink.MAV_PARAM_TYPE_REAL32
                else struct.pack("<i", self._value(_Place("i", 4)))
            )
            return raw + struct.pack("<BB16sB", 1, 1, chance.choice(self._names), kind)
        return None

    def _value(self, place: _Place) -> Any:
        chance = self._chance
        if place.choices and chance.random() < 0.9:
            return chance.choice(place.choices)
        if place.code in "fd":
            kind = chance.random()
            if kind < 0.15:
                return chance.choice(NO_FLOATS)
            return chance.choice(FLOATS) if kind < 0.4 else chance.uniform(-100.0, 100.0)
        if place.code == "s":
            kind = chance.random()
            if kind < 0.5 and self._names:
                return chance.choice(self._names)[: place.bytes]
            return chance.choice(STRINGS)[: place.bytes] if kind < 0.9 else chance.randbytes(place.bytes)
        bits = 8 * place.bytes
        kind = chance.random()
        if kind < 0.4:
            value = chance.choice((0, 1, 2, (1 << bits) - 1, 1 << (bits - 1), (1 << (bits - 1)) - 1))
        else:
            value = chance.getrandbits(bits if kind < 0.7 else min(bits, 8))
        return value - (1 << bits) if place.code.islower() and value >> (bits - 1) else value

    def _places(self, number: int) -> list[_Place]:
        table: Any = mavlink.mavlink_map[number]
        places = []
        codes = re.findall(r"(\d*)([a-zA-Z])", table.unpacker.format)
        for name, (count, code) in zip(table.ordered_fieldnames, codes, strict=True):
            if code == "s":
                places.append(_Place("s", int(count or 1)))
                continue
            choices: Sequence[int] = ()
            if name == "target_system":
                choices = TARGET_SYSTEMS
            elif name == "target_component":
                choices = TARGET_COMPONENTS
            elif name == "command" and code == "H":
                choices = self._commands
            elif name == "seq" and code == "H":
                choices = range(8)
            elif name == "count" and code == "H":
                choices = (0, 1, 3, 8)
            elif name == "mission_type":
                choices = (0, 1, 2)
            places += [_Place(code, struct.calcsize("<" + code), choices)] * int(count or 1)
        return places


def mutated(chance: random.Random, seeds: Sequence[bytes]) -> bytes:
    """Real traffic, spoiled: bits, bytes, lengths, order; one in three has a right CRC again."""
    data = bytearray(chance.choice(seeds))
    for _ in range(chance.randint(1, 4)):
        kind, at = chance.randrange(7), chance.randrange(len(data) + 1)
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << chance.randrange(8)
        elif kind == 1 and data:
            data[at % len(data)] = chance.choice((0, 1, 127, 128, 253, 254, 255))
        elif kind == 2:
            data[at:at] = chance.randbytes(chance.randint(1, 20))
        elif kind == 3:
            del data[at : at + chance.randint(1, 20)]
        elif kind == 4:
            del data[at:]
        elif kind == 5:
            data += chance.choice(seeds)
        else:
            data[at:at] = data[: chance.randint(0, len(data))]
    if chance.random() < 1 / 3:
        data = bytearray(b"".join(with_right_crc(frame) for frame in framing.split(bytes(data))) or data)
    return bytes(data[:65_000])


def with_right_crc(frame: bytes) -> bytes:
    """The same frame with the CRC that belongs to its bytes; unsigned and of a known id, else unchanged."""
    table: Any = mavlink.mavlink_map.get(framing.message_id(frame))
    if table is None or framing.is_signed(frame):
        return frame
    return frame[:-2] + struct.pack("<H", framing._crc(frame[1:-2] + bytes((table.crc_extra,))))


class Victim:
    """A vehicle in its simulator whose links are fed with anything."""

    def __init__(self, model: str = "sihsim_hex", root: Path | None = None) -> None:
        vehicle = vehicles.load(model)
        self.autopilot = Autopilot(vehicle.airframe, 0, root)
        self._simulator = VehicleSimulator(vehicle, HOME, 0, FlatGround(), name=model)
        self._channel = MemoryChannel()
        self._controls: Any = None
        self.ticks = 0
        self.sent_bytes = 0
        self._fed = [b""] * LINKS
        """What has come on each link of late: its frames pass to other links as they are, whoever they claim to be."""
        self.station: Any = mavlink.MAVLink(None, 255, 190)
        self._ear: Any = mavlink.MAVLink(None)

    @property
    def heard(self) -> set[int]:
        """Message ids that some service listens to."""
        return set(self.autopilot.mavlink._handlers)

    def hear(self, link: int, data: bytes) -> None:
        """A datagram comes in."""
        self._fed[link] = (self._fed[link] + data)[-FED_BYTES:]
        self.autopilot.on_datagram(link, data)

    def tick(self) -> None:
        """4 ms of simulated time; raises AssertionError if a NaN was sent."""
        self._step()
        self.check_sent()

    def _step(self) -> None:
        channel = self._channel
        channel.simulator.send(self._simulator.tick(self._controls))
        channel.autopilot.send(self.autopilot.step(channel.autopilot.receive()))
        self._controls = channel.simulator.receive()
        self.ticks += 1

    def keep_open(self) -> None:
        """Take away a signing key that nonsense has set: all that comes after it would be dropped."""
        for link in self.autopilot.mavlink.links:
            link.signing.use(NO_KEY)

    def run(self, seconds: float) -> None:
        """So many seconds with a ground station that only beats."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            if self.ticks % 250 == 0:
                self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            self.tick()

    def coast(self, seconds: float) -> None:
        """So many seconds in which nobody says or hears anything."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self._step()
            for link in self.autopilot.mavlink.links:
                link.outbox.clear()

    def say(self, message: Any) -> bytes:
        """The ground station says something; returns the frame."""
        frame = bytes(message.pack(self.station))
        self.station.seq = (self.station.seq + 1) & 255
        self.hear(0, frame)
        return frame

    def take(self, link: int) -> bytes:
        """What waits to be sent on a link."""
        outbox = self.autopilot.mavlink.links[link].outbox
        said = b"".join(outbox)
        outbox.clear()
        return said

    def drive(self, service: Any, limit_s: float = 20.0) -> list[bytes]:
        """One of our clients talks to it on the first link until it is done; all frames of both sides."""
        frames: list[bytes] = []
        for _ in range(round(limit_s * 1e6 / TICK_US)):
            requests = service.on_time(self.autopilot.now_us)
            while requests:
                frames += [self.say(request) for request in requests]
                said = framing.split(self.take(0))
                frames += said
                heard = [self._ear.decode(bytearray(frame)) for frame in said]
                requests = [reply for message in heard for reply in service.on_message(self.autopilot.now_us, message)]
            if service.done:
                break
            self._step()
        return frames

    def answers(self) -> bool:
        """Whether a ground station's command is still acknowledged."""
        outbox = self.autopilot.mavlink.links[0].outbox
        outbox.clear()
        self.keep_open()
        # The first frame may be swallowed by the start of another that never went on.
        for _ in range(20):
            self.say(
                mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_RUN_PREARM_CHECKS, 0, 0, 0, 0, 0, 0, 0, 0)
            )
        frames = framing.split(b"".join(outbox))
        return any(framing.message_id(frame) == mavlink.MAVLINK_MSG_ID_COMMAND_ACK for frame in frames)

    def record(self) -> list[bytes]:
        """Take off, and real conversations of our own clients with it: the traffic that is to be spoiled."""
        items = [
            MissionItem(6, mavlink.MAV_CMD_NAV_TAKEOFF, x=473977420, y=85455940, z=10.0),
            MissionItem(6, mavlink.MAV_CMD_NAV_WAYPOINT, x=473979000, y=85457000, z=12.0),
        ]
        self.run(3.0)
        frames: list[bytes] = []
        for service in (
            MissionUpload(1, items),
            MissionDownload(1, 0),
            ParameterList(1),
            ParameterRead(1, "MPC_XY_VEL_MAX"),
            ParameterSet(1, "MPC_XY_CRUISE", 6.0),
            Command(1, 1, mavlink.MAV_CMD_REQUEST_MESSAGE, (float(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION),)),
            Command(1, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (30.0, 20_000.0)),
            Command(1, 1, mavlink.MAV_CMD_RUN_PREARM_CHECKS),
            set_mode(1, "takeoff"),
            arm(1),
        ):
            frames += self.drive(service)
        for message in (
            mavlink.MAVLink_file_transfer_protocol_message(
                0, 1, 1, [1, 0, 0, 3, 1, 0, 0, 0, 0, 0, 0, 0, 47, *[0] * 238]
            ),
            mavlink.MAVLink_serial_control_message(10, 6, 0, 0, 7, [*b"ver all", *[0] * 63]),
            mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
            mavlink.MAVLink_log_request_list_message(1, 1, 0, 65535),
            mavlink.MAVLink_timesync_message(0, 1),
            mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0x0DF8, 0, 0, -5, 0, 0, 0, 0, 0, 0, 0, 0),
        ):
            frames.append(self.say(message))
        self.run(8.0)
        return frames

    def check_sent(self) -> None:
        """Empty the outboxes. Raises AssertionError for a NaN where there can be none."""
        for link in self.autopilot.mavlink.links:
            for datagram in link.outbox:
                self.sent_bytes += len(datagram)
                for frame in framing.split(datagram):
                    name = CHECKED_IDS.get(framing.message_id(frame))
                    if name is not None and framing.sender(frame) == (1, 1) and frame[0] == framing.STX_V2:
                        layout = NEVER_NAN_SENT[name]
                        payload = frame[10 : 10 + frame[1]].ljust(layout.size, b"\0")[: layout.size]
                        values = layout.unpack(payload)[NOT_MEASURED.get(name, 0) :]
                        finite = all(map(math.isfinite, values))
                        assert finite or any(frame in fed for fed in self._fed), f"{name} {values}"
            link.outbox.clear()

    def check_topics(self) -> None:
        """Raises AssertionError for a NaN in a topic that can have none."""
        for topic, fields in NEVER_NAN.items():
            record = getattr(self.autopilot.topics, topic)
            for field in fields:
                value = getattr(record, field)
                numbers = value if isinstance(value, tuple) else (value,)
                assert all(map(math.isfinite, numbers)), f"{topic}.{field} is {value}"


def objects() -> int:
    """How many objects live, garbage taken away."""
    gc.collect()
    return len(gc.get_objects())
