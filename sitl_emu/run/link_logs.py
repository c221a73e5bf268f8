"""What passes on an autopilot's links, as telemetry logs: a .tlog for each."""

import contextlib
import errno
import sys
from collections.abc import Sequence
from pathlib import Path

from sitl_emu.core.framing import split
from sitl_emu.gcs.tlog import TlogWriter


class LinkLogs:
    """The logs of one autopilot, `PREFIX-LINK.tlog`; they go on over its reboots.

    Where one can't be written any more (the disk is full), that is said once, and all of them stop: a vehicle in the
    air matters more than its log. `must_log`: they raise OSError instead, as befits a run, whose result they are.
    """

    def __init__(self, prefix: Path, links: Sequence[str], *, must_log: bool = False) -> None:
        """`links`: their names, in order. Raises OSError, also where there is such a log already."""
        paths = [prefix.with_name(f"{prefix.name}-{link}.tlog") for link in links]
        for path in paths:
            if path.exists():
                text = "there is a telemetry log of this name already; name another folder with --tlog"
                raise FileExistsError(errno.EEXIST, text, str(path))
        self._writers = [_begun(path) for path in paths]
        self._must_log = must_log

    def write(self, unix_us: int, link: int, datagram: bytes) -> None:
        """A datagram that came or went on a link."""
        if not self._writers:
            return
        writer = self._writers[link]
        try:
            for frame in split(datagram):
                writer.write(unix_us, frame)
        except OSError as error:
            self._stop(writer, error)

    def close(self) -> None:
        """Make the files whole."""
        for writer in self._writers:
            try:
                writer.close()
            except OSError as error:
                self._stop(writer, error)
                return

    def _stop(self, writer: TlogWriter, error: OSError) -> None:
        writers, self._writers = self._writers, []
        for each in writers:
            with contextlib.suppress(OSError):  # what waits to be written fails as well
                each.close()
        if self._must_log:
            raise error
        print(f"sitl-emu: telemetry log {writer.path}: {error.strerror or error}; logging stops", file=sys.stderr)


def _begun(path: Path) -> TlogWriter:
    """A log; raises OSError with the number of what the system said, and the log's own text for people."""
    try:
        return TlogWriter(path)
    except OSError as error:
        cause = error.__cause__
        number = cause.errno if isinstance(cause, OSError) and cause.errno is not None else errno.EIO
        raise OSError(number, str(error)) from None
