"""Telemetry logs: .tlog files as QGroundControl and MAVProxy write and read them.

Each record is the time in microseconds since 1970 as 8 bytes, big-endian, and the raw MAVLink frame.
"""

import struct
from pathlib import Path
from types import TracebackType

from sitl_emu.core.framing import (
    CRC_BYTES,
    HEADER_V1_BYTES,
    HEADER_V2_BYTES,
    SIGNATURE_BYTES,
    STX_V1,
    STX_V2,
    is_signed,
)

_TIME = struct.Struct(">Q")


class TlogWriter:
    """Writes one .tlog; records may come in any number, the file is whole after `close` (or `flush`)."""

    def __init__(self, path: Path) -> None:
        """Creates the file. Raises OSError whose text names the path and what to do about it."""
        self.path = path
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise OSError(f"can't write telemetry log {path}: {error.strerror}; choose another folder") from error

    def write(self, time_us: int, frame: bytes) -> None:
        """Adds a frame. `time_us`: microseconds since 1970 (UTC)."""
        self._file.write(_TIME.pack(time_us) + frame)

    def flush(self) -> None:
        """Hands what was written to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """Closes the file; may be called twice."""
        self._file.close()

    def __enter__(self) -> "TlogWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class TlogReader:
    """Cuts the bytes of a .tlog, as they come, into its records."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """The records that these bytes complete: microseconds since 1970, and the frame, CRC unchecked.

        What follows something that is no record is left out.
        """
        data, at = self._rest + data, 0
        records = list[tuple[int, bytes]]()
        while (end := _end_of(data, at)) is not None:
            start = at + _TIME.size
            records.append((_TIME.unpack_from(data, at)[0], data[start:end]))
            at = end
        self._rest = data[at:]
        return records


def _end_of(data: bytes, at: int) -> int | None:
    """Where a record ends; None where it is not there as a whole."""
    start = at + _TIME.size
    if start + 3 > len(data) or data[start] not in (STX_V1, STX_V2):
        return None
    if data[start] == STX_V1:
        size = HEADER_V1_BYTES + CRC_BYTES
    else:
        size = HEADER_V2_BYTES + CRC_BYTES + (SIGNATURE_BYTES if is_signed(data[start : start + 3]) else 0)
    end = start + size + data[start + 1]
    return end if end <= len(data) else None
