"""What passes on an autopilot's links, as telemetry logs: a .tlog for each."""

from collections.abc import Sequence
from pathlib import Path

from sitl_emu.core.framing import split
from sitl_emu.gcs.tlog import TlogWriter


class LinkLogs:
    """The logs of one autopilot, `PREFIX-LINK.tlog`; they go on over its reboots."""

    def __init__(self, prefix: Path, links: Sequence[str]) -> None:
        """`links`: their names, in order. Raises OSError."""
        self._writers = [TlogWriter(prefix.with_name(f"{prefix.name}-{link}.tlog")) for link in links]

    def write(self, unix_us: int, link: int, datagram: bytes) -> None:
        """A datagram that came or went on a link."""
        write = self._writers[link].write
        for frame in split(datagram):
            write(unix_us, frame)

    def close(self) -> None:
        """Make the files whole."""
        for writer in self._writers:
            writer.close()
