"""Messages from frames, fast: struct formats prepared once per message. The mirror of encoder.py.

Layouts come from the dialect's class tables (pymavlink's code); a payload that is shorter than its message ends in
zeros, of a longer one only the part that is known is read.
"""

import re
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing


class Message:
    """A received message. Its fields are attributes with MAVLink's names: numbers, texts, bytes, or lists of numbers.

    The methods are those of pymavlink's messages.
    """

    __slots__ = ("__dict__", "_frame", "_header")

    def __init__(self, header: framing.Header, frame: bytes, fields: dict[str, Any]) -> None:
        self._header, self._frame = header, frame
        self.__dict__ = fields

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    def get_msgId(self) -> int:  # noqa: N802  # pymavlink's name
        """Its number."""
        return self._header.message_id

    def get_srcSystem(self) -> int:  # noqa: N802  # pymavlink's name
        """System that sent it."""
        return self._header.system

    def get_srcComponent(self) -> int:  # noqa: N802  # pymavlink's name
        """Component that sent it."""
        return self._header.component

    def get_seq(self) -> int:
        """Its sequence number."""
        return self._header.sequence

    def get_payload(self) -> bytes:
        """Its fields as they came, without zeros at the end."""
        return self._frame[self._header.payload_start : self._header.payload_end]

    def get_msgbuf(self) -> bytes:
        """The frame in which it came."""
        return self._frame


class _Layout:
    """How one message is read."""

    __slots__ = ("arrays", "crc_extra", "names", "size", "texts", "unpack")

    def __init__(self, table: Any) -> None:
        parts = re.findall(r"(\d*)([a-zA-Z])", table.unpacker.format)
        bytes_as_one = [(count, "s" if count and code == "B" else code) for count, code in parts]
        layout = struct.Struct("<" + "".join(count + code for count, code in bytes_as_one))
        self.unpack: Callable[[bytes], tuple[Any, ...]] = layout.unpack
        self.size = layout.size
        self.crc_extra = bytes((table.crc_extra,))
        self.names: list[str] = table.ordered_fieldnames
        self.texts = [name for name, (_, code) in zip(self.names, parts, strict=True) if code == "s"]
        self.arrays = [(place, int(count)) for place, (count, code) in enumerate(bytes_as_one) if count and code != "s"]
        """Place and length of those that struct spreads out, in wire order."""


def decode(frame: bytes) -> Message | None:
    """The message in a whole frame; None if it is unknown or its CRC is wrong."""
    header = framing.header(frame)
    layout = _LAYOUTS.get(header.message_id)
    if layout is None:
        table = mavlink.mavlink_map.get(header.message_id)
        if table is None:
            return None
        layout = _LAYOUTS[header.message_id] = _Layout(table)
    if not framing.is_intact(frame, header.payload_end, layout.crc_extra):
        return None
    payload, size = frame[header.payload_start : header.payload_end], layout.size
    if len(payload) != size:
        payload = payload[:size].ljust(size, b"\0")
    values = layout.unpack(payload)
    if layout.arrays:
        gathered = list(values)
        for place, length in layout.arrays:
            gathered[place : place + length] = [gathered[place : place + length]]
        fields = dict(zip(layout.names, gathered, strict=True))
    else:
        fields = dict(zip(layout.names, values, strict=True))
    for name in layout.texts:
        fields[name] = fields[name].split(b"\0", 1)[0].decode("ascii", errors="replace")
    return Message(header, frame, fields)


_LAYOUTS: dict[int, _Layout] = {}
