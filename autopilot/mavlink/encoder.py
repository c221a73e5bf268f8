"""MAVLink 2 frames from field tuples, fast: struct formats prepared once per message.

The layout of every message comes from the dialect's class tables (pymavlink's code), the frame from
`sitl_emu.core.framing`. Output is byte-identical to pymavlink's `pack`. Fields come in *wire
order* (as `ordered_fieldnames`), arrays flattened. Links sign their frames themselves.
"""

from typing import Any, Final

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from sitl_emu.core.c_types import Layout

AUTOPILOT_COMPONENT: Final = 1
EXTENSIONS = {
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: "III",
    mavlink.MAVLINK_MSG_ID_MISSION_COUNT: "I",
    mavlink.MAVLINK_MSG_ID_MISSION_ACK: "I",
    mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL: "BB",
    mavlink.MAVLINK_MSG_ID_TIMESYNC: "BB",
}
"""Extension fields that PX4 sends and pymavlink's dialect lacks: opaque ids of plans, targets of shell and time."""


class Codec:
    """One message of one sender: payload packer, end of the header, CRC_EXTRA.

    `pack(*fields)` returns the full-length payload; a number that its field can't hold becomes what C makes of it.
    """

    __slots__ = ("crc_extra", "header_tail", "id", "pack", "size")

    def __init__(self, message_id: int, system_id: int) -> None:
        """Raises KeyError for a message that the dialect does not know."""
        table: Any = mavlink.mavlink_map[message_id]
        self.id = message_id
        layout = Layout(table.unpacker.format.removeprefix("<") + EXTENSIONS.get(message_id, ""))
        self.pack, self.size = layout.pack, layout.size
        self.header_tail = framing.header_tail(system_id, AUTOPILOT_COMPONENT, message_id)
        self.crc_extra = bytes((table.crc_extra,))

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
