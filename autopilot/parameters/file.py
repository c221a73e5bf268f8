"""PX4's parameter file: a BSON document, an int32 or double element per parameter (src/lib/tinybson; bsonspec.org)."""

import struct
from collections.abc import Mapping

from sitl_emu.autopilot.parameters import Value

DOUBLE, BOOL, INT32, INT64 = 1, 8, 16, 18
"""Element types that PX4 reads."""
LAYOUTS = {
    DOUBLE: struct.Struct("<d"),
    BOOL: struct.Struct("<?"),
    INT32: struct.Struct("<i"),
    INT64: struct.Struct("<q"),
}
END = b"\0"
SIZE = struct.Struct("<i")


def encode(values: Mapping[str, Value]) -> bytes:
    """The document of these values: a float becomes a double, an int an int32."""
    elements = b"".join(
        bytes((DOUBLE if isinstance(value, float) else INT32,))
        + name.encode()
        + END
        + LAYOUTS[DOUBLE if isinstance(value, float) else INT32].pack(value)
        for name, value in values.items()
    )
    return SIZE.pack(SIZE.size + len(elements) + len(END)) + elements + END


def decode(data: bytes) -> tuple[dict[str, Value], bool]:
    """(What can be read from the start on, whether the document is whole); an empty file is whole and holds nothing."""
    values: dict[str, Value] = {}
    if not data:
        return values, True
    place = SIZE.size
    try:
        while (kind := data[place]) != END[0]:
            name_end = data.index(END, place + 1)
            layout = LAYOUTS[kind]
            values[data[place + 1 : name_end].decode("ascii")] = layout.unpack_from(data, name_end + 1)[0]
            place = name_end + 1 + layout.size
    except (IndexError, KeyError, ValueError, struct.error):
        return values, False
    return values, SIZE.unpack_from(data)[0] == place + 1
