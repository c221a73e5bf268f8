"""Telemetry logs: .tlog files as QGroundControl and MAVProxy write and read them.

Each record is the time in microseconds since 1970 as 8 bytes, big-endian, and the raw MAVLink frame.
"""

import struct
from pathlib import Path
from types import TracebackType

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
