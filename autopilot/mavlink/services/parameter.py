"""Parameter protocol: list, read, set (https://mavlink.io/en/services/parameter.html; PX4: mavlink_parameters.cpp).

Integers travel byte-wise in the float field. A list begins with _HASH_CHECK and is paced, so that no socket overflows;
a second request starts it again. A changed value is echoed to who set it and announced on every link, a PARAM_SET of
the wrong type is ignored. Values are not checked against their bounds: PX4 does not either.
"""

import struct
import zlib
from typing import Any

from autopilot.mavlink.link import Link
from autopilot.mavlink.services.service import is_for
from autopilot.parameters import Parameters, Value
from sitl_emu.core import dialect as mavlink

HASH_NAME = "_HASH_CHECK"
NO_INDEX = 65535
REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
INT32 = mavlink.MAV_PARAM_TYPE_INT32
UINT32 = mavlink.MAV_PARAM_TYPE_UINT32
PER_TICK = 5
"""Values of a list per tick of 4 ms: 1250 a second, the whole set in 0.8 s."""
TICK_US = 4_000


class Parameter:
    """One for all links; lists run per link."""

    MESSAGES = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
            mavlink.MAVLINK_MSG_ID_PARAM_SET,
        }
    )
    HAS_TIMER = True

    def __init__(self, links: tuple[Link, ...], parameters: Parameters, system_id: int) -> None:
        """Changes are announced on `links`."""
        self._links = links
        self._parameters = parameters
        self._system_id = system_id
        self._lists: dict[Link, int] = {}

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Broadcasts are not for us: PX4 wants its own system id."""
        if not is_for(message, self._system_id, broadcast=False):
            return
        message_id = message.get_msgId()
        if message_id == mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
            self._send_hash(link)
            self._lists[link] = 0
        elif message_id == mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ:
            self._read(message, link)
        else:
            self._set(message, link)

    def on_time(self, now_us: int) -> None:
        """Go on with the lists."""
        if not self._lists:
            return
        announced = self._parameters.announced
        for link, start in list(self._lists.items()):
            stop = min(start + PER_TICK, len(announced))
            for name in announced[start:stop]:
                self._send(link, name)
            if stop == len(announced):
                del self._lists[link]
            else:
                self._lists[link] = stop

    def _read(self, message: Any, link: Link) -> None:
        index = message.param_index
        if index >= 0:
            if index < len(self._parameters.announced):
                self._send(link, self._parameters.announced[index])
        elif message.param_id == HASH_NAME:
            self._send_hash(link)
        elif message.param_id in self._parameters:
            self._send(link, message.param_id)

    def _set(self, message: Any, link: Link) -> None:
        name = message.param_id
        if name == HASH_NAME:
            self._lists.pop(link, None)
            return
        if name not in self._parameters:
            return
        is_float = self._parameters.is_float(name)
        if message.param_type != (REAL32 if is_float else INT32):
            return
        value: Value = struct.unpack("<f" if is_float else "<i", value_bytes(message))[0]
        before = self._parameters[name]
        self._parameters.set(name, value)
        self._send(link, name)
        if value == value and before != self._parameters[name]:
            for each in self._links:
                self._send(each, name)

    def _send(self, link: Link, name: str) -> None:
        value = self._parameters[name]
        is_float = self._parameters.is_float(name)
        packed = struct.pack("<f", value) if is_float else struct.pack("<i", value)
        index = self._parameters.index.get(name, NO_INDEX)
        self._send_value(link, packed, index, name, REAL32 if is_float else INT32)

    def _send_hash(self, link: Link) -> None:
        self._send_value(link, struct.pack("<I", parameter_hash(self._parameters)), NO_INDEX, HASH_NAME, UINT32)

    def _send_value(self, link: Link, packed: bytes, index: int, name: str, kind: int) -> None:
        count = len(self._parameters.announced)
        codec = link.codec(mavlink.MAVLINK_MSG_ID_PARAM_VALUE)
        link.send_payload(codec, packed + struct.pack("<HH16sB", count, index, name.encode(), kind))


def value_bytes(message: Any) -> bytes:
    """The four bytes of a PARAM_SET's value as they came: a float on the way would change some integers."""
    frame = bytes(message.get_msgbuf())
    start = 10 if frame[0] == 0xFD else 6
    length = frame[1]
    return frame[start : start + min(4, length)].ljust(4, b"\0")


def parameter_hash(parameters: Parameters) -> int:
    """CRC-32 over names and values as PX4's param_hash_check has it (no inversion at start and end)."""
    crc = 0xFFFFFFFF
    for name in parameters.announced:
        layout = "<f" if parameters.is_float(name) else "<i"
        crc = zlib.crc32(name.encode() + struct.pack(layout, parameters[name]), crc)
    return crc ^ 0xFFFFFFFF
