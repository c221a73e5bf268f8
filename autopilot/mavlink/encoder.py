"""MAVLink 2 frames from field tuples, fast: struct formats prepared once per message.

The layout of every message comes from the dialect's class tables (pymavlink's code), the frame from
`sitl_emu.core.framing`. Output is byte-identical to pymavlink's `pack`. Fields come in *wire
order* (as `ordered_fieldnames`), arrays flattened. Links sign their frames themselves.
"""

import math
import re
import struct
from typing import Any

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing

AUTOPILOT_COMPONENT = 1
EXTENSIONS = {
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: "III",
    mavlink.MAVLINK_MSG_ID_MISSION_COUNT: "I",
    mavlink.MAVLINK_MSG_ID_MISSION_ACK: "I",
    mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL: "BB",
}
"""Extension fields that PX4 sends and pymavlink's dialect lacks: opaque ids of plans, the shell's target."""


class Codec:
    """One message of one sender: payload packer, end of the header, CRC_EXTRA."""

    __slots__ = ("_layout", "crc_extra", "header_tail", "id", "size")

    def __init__(self, message_id: int, system_id: int) -> None:
        """Raises KeyError for a message that the dialect does not know."""
        table: Any = mavlink.mavlink_map[message_id]
        self.id = message_id
        self._layout = struct.Struct(table.unpacker.format + EXTENSIONS.get(message_id, ""))
        self.size = self._layout.size
        self.header_tail = framing.header_tail(system_id, AUTOPILOT_COMPONENT, message_id)
        self.crc_extra = bytes((table.crc_extra,))

    def pack(self, *fields: Any) -> bytes:
        """The full-length payload. A whole number that its field can't hold wraps around, as it does in PX4's C++.

        A float that is too large for its field becomes the largest.
        """
        try:
            return self._layout.pack(*fields)
        except (struct.error, OverflowError):
            return self._layout.pack(*_wrapped(self._layout.format, fields))

    def frame(self, payload: bytes, sequence: int, flags: int = 0) -> bytes:
        """A MAVLink 2 frame around a full-length payload, trailing zeros cut as the wire wants it."""
        return framing.frame(payload, sequence, self.header_tail, self.crc_extra, flags)


class Encoder:
    """The codecs of one vehicle, made when first used."""

    def __init__(self, system_id: int) -> None:
        """`system_id` is MAV_SYS_ID; the component is always the autopilot's."""
        self.system_id = system_id
        self._codecs: dict[int, Codec] = {}

    def codec(self, message_id: int) -> Codec:
        """Codec of a message; KeyError for an unknown id."""
        codec = self._codecs.get(message_id)
        if codec is None:
            codec = self._codecs[message_id] = Codec(message_id, self.system_id)
        return codec


BITS = {"b": 8, "B": 8, "h": 16, "H": 16, "i": 32, "I": 32, "q": 64, "Q": 64}
LARGEST_FLOAT32 = (2.0 - 2.0**-23) * 2.0**127


def _wrapped(layout: str, fields: tuple[Any, ...]) -> list[Any]:
    """The fields with numbers made to fit the layout's places; what is no number stays as it is."""
    places = [
        code
        for count, code in re.findall(r"(\d*)([a-zA-Z])", layout)
        for _ in range(1 if code == "s" else int(count or 1))
    ]
    wrapped = []
    for code, value in zip(places, fields, strict=True):
        bits = BITS.get(code)
        if bits is not None and isinstance(value, int):
            value &= (1 << bits) - 1
            if code.islower() and value >> (bits - 1):
                value -= 1 << bits
        elif code == "f":
            value = max(-LARGEST_FLOAT32, min(LARGEST_FLOAT32, value)) if math.isfinite(value) else value
        wrapped.append(value)
    return wrapped
