"""Parameter protocol: list, read, set (https://mavlink.io/en/services/parameter.html; PX4: mavlink_parameters.cpp).

Integers travel byte-wise in the float field. A list begins with _HASH_CHECK and is paced, so that no socket overflows;
a second request starts it again, without the hash. A value that is set is echoed to who set it; soon after a change,
and after a start, which sets some, all values that are not saved yet are told on every link, at most once a second.
What cannot be read or set is answered by PARAM_ERROR. Values are not checked against their bounds: PX4 does not either.
PARAM_EXT is unknown to PX4 v1.18.
"""

import math
import struct
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.service import is_for
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.parameters.subscription_interval import PARAMETER_UPDATE_INTERVAL_US, SubscriptionInterval
from sitl_emu.autopilot.storage.dataman import crc32_part
from sitl_emu.autopilot.topics import RcParameter, Topics
from sitl_emu.core import dialect as mavlink

HASH_NAME: Final = "_HASH_CHECK"
NO_INDEX: Final = 65535
REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
INT32 = mavlink.MAV_PARAM_TYPE_INT32
UINT32 = mavlink.MAV_PARAM_TYPE_UINT32
DOES_NOT_EXIST = mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST
READ_ONLY = mavlink.MAV_PARAM_ERROR_READ_ONLY
TYPE_UNSUPPORTED = mavlink.MAV_PARAM_ERROR_TYPE_UNSUPPORTED
TYPE_MISMATCH = mavlink.MAV_PARAM_ERROR_TYPE_MISMATCH
NO_PARAM_INDEX = -1
"""PARAM_ERROR's index where a name was asked for."""
PER_TICK: Final = 5
"""Values of a list per tick of 4 ms: 1250 a second, the whole set in 0.8 s."""
TELL_DELAY_US: Final = 5_000
"""From a change until the links hear of it (MavlinkParametersManager::send_untransmitted)."""
BEFORE_THE_START: Final = -1
"""Of Parameters.notifications: what the start-up script sets is published before there is a link."""
RC_CHANNELS_MAPPED: Final = 3
"""PARAM_MAP_RC's knobs."""
UNMAP = -2


class Parameter:
    """One for all links; lists run per link."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
            mavlink.MAVLINK_MSG_ID_PARAM_SET,
            mavlink.MAVLINK_MSG_ID_PARAM_MAP_RC,
        }
    )
    HAS_TIMER = True

    def __init__(
        self,
        links: tuple[Link, ...],
        topics: Topics,
        parameters: Parameters,
        say: Say,
        system_id: int,
    ) -> None:
        """Changes are told on `links`; PARAM_MAP_RC goes into `topics`."""
        self._topics = topics
        self._links = links
        self._parameters = parameters
        self._say = say
        self._system_id = system_id
        self._lists: dict[Link, int] = {}
        self._updates = SubscriptionInterval(PARAMETER_UPDATE_INTERVAL_US, BEFORE_THE_START)
        self._tell_us: int | None = None
        self._untold: set[Link] = set()
        """Links that hear of changes once their list has ended."""

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Broadcasts are not for us: PX4 wants its own system id."""
        if not is_for(message, self._system_id, broadcast=False):
            return
        message_id = message.get_msgId()
        if message_id == mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
            if link not in self._lists:
                self._send_hash(link)
            self._lists[link] = 0
        elif message_id == mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ:
            self._read(message, link)
        elif message_id == mavlink.MAVLINK_MSG_ID_PARAM_SET:
            self._set(message, link)
        else:
            self._map_rc(message)

    def on_time(self, now_us: int) -> None:
        """Go on with the lists, and tell what has changed."""
        if self._lists:
            self._continue_lists()
        if self._updates.updated(now_us, self._parameters.notifications) and self._tell_us is None:
            self._tell_us = now_us + TELL_DELAY_US
        if self._tell_us is not None and now_us >= self._tell_us:
            self._tell_us = None
            self._untold.update(self._links)
        if self._untold:
            self._tell_changes()

    def _continue_lists(self) -> None:
        announced = self._parameters.announced
        for link, start in list(self._lists.items()):
            stop = min(start + PER_TICK, len(announced))
            for name in announced[start:stop]:
                self._send(link, name)
            if stop == len(announced):
                del self._lists[link]
            else:
                self._lists[link] = stop

    def _tell_changes(self) -> None:
        parameters = self._parameters
        unsaved = sorted(name for name in parameters.unsaved if name in parameters.index)
        for link in [link for link in self._links if link in self._untold and link not in self._lists]:
            self._untold.discard(link)
            for name in unsaved:
                self._send(link, name)

    def _read(self, message: Any, link: Link) -> None:
        index, name = message.param_index, _name(message)
        if index >= 0:
            if index < len(self._parameters.announced):
                self._send(link, self._parameters.announced[index])
            else:
                self._refuse(message, link, DOES_NOT_EXIST, index=index)
        elif name == HASH_NAME:
            self._send_hash(link)
        elif name in self._parameters:
            self._send(link, name)
        else:
            self._refuse(message, link, DOES_NOT_EXIST, name)

    def _set(self, message: Any, link: Link) -> None:
        name = _name(message)
        if name == HASH_NAME:
            if self._parameters["MAV_HASH_CHK_EN"]:
                self._lists.pop(link, None)
            self._refuse(message, link, READ_ONLY, name)
            return
        if name not in self._parameters:
            self._refuse(message, link, DOES_NOT_EXIST, name)
            return
        is_float = self._parameters.is_float(name)
        if message.param_type != (REAL32 if is_float else INT32):
            supported = message.param_type in (REAL32, INT32)
            self._refuse(message, link, TYPE_MISMATCH if supported else TYPE_UNSUPPORTED, name)
            return
        value: Value = struct.unpack("<f" if is_float else "<i", value_bytes(message))[0]
        self._parameters.set(name, value)
        self._send(link, name)

    def _map_rc(self, message: Any) -> None:
        """Which parameter a knob turns, by index if there is one (-2: none any more)."""
        knob, index = message.parameter_rc_channel_index, message.param_index
        if knob >= RC_CHANNELS_MAPPED:
            text = "parameter_rc_channel_index out of bounds\t"
            self._say(Severity.WARNING, text, "mavlink_param_rc_chan_out_of_bounds")
            return
        limits = (message.param_value0, message.scale, message.param_value_min, message.param_value_max)
        announced = self._parameters.announced
        name = _name(message) if index < 0 else announced[index] if index < len(announced) else ""
        valid = index != UNMAP and all(map(math.isfinite, limits))
        knobs = list(self._topics.rc_parameter_map)
        knobs[knob] = RcParameter(name, *limits) if valid else RcParameter()
        first, second, third = knobs
        self._topics.rc_parameter_map = (first, second, third)

    def _refuse(self, message: Any, link: Link, error: int, name: str = "", index: int = NO_PARAM_INDEX) -> None:
        """PARAM_ERROR to whom asked, by name or by index; PX4 leaves the other of the two as it lies in memory."""
        codec = link.codec(mavlink.MAVLINK_MSG_ID_PARAM_ERROR)
        asker = message.get_srcSystem(), message.get_srcComponent()
        link.send_payload(codec, struct.pack("<hBB16sB", index, *asker, name.encode(), error))

    def _send(self, link: Link, name: str) -> None:
        value = self._parameters.told(name)
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


def _name(message: Any) -> str:
    """The parameter's name, up to the first zero."""
    name: str = message.param_id
    return name.partition("\0")[0]


def value_bytes(message: Any) -> bytes:
    """The four bytes of a PARAM_SET's value as they came: a float on the way would change some integers."""
    frame = bytes(message.get_msgbuf())
    start = 10 if frame[0] == 0xFD else 6
    length = frame[1]
    return frame[start : start + min(4, length)].ljust(4, b"\0")


def parameter_hash(parameters: Parameters) -> int:
    """CRC-32 over names and values as PX4's param_hash_check: of all that are announced and not volatile."""
    crc = 0
    for name in parameters.announced:
        row = parameters.row(name)
        if not row.get("volatile"):
            layout = "<f" if parameters.is_float(name) else "<i"
            crc = crc32_part(name.encode() + struct.pack(layout, parameters.told(name)), crc)
    return crc
