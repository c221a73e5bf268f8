"""The log's files: names, the room for them, the one that is being written (PX4: log_writer_file.cpp, util.cpp).

Nothing raises: a log that can't be written ends, `trouble` says why, and the flight goes on.
"""

import datetime
import errno
import os
import re
import shutil
from io import FileIO
from pathlib import Path

from sitl_emu.autopilot.storage import storage

DATE_FOLDER = re.compile(r"\d{4}-\d\d-\d\d")
LEAST_FREE_BYTES = 1 << 20
"""With less room than this PX4 starts no log (util::cleanup_old_logs)."""
MEBIBYTE = 1 << 20


def free_bytes(root: Path) -> int:
    """Room on the file system. Raises OSError."""
    found = os.statvfs(root)
    return found.f_bavail * found.f_frsize


def log_name(unix_us: int, utc_offset_min: int) -> str:
    """`YYYY-MM-DD/HH_MM_SS.ulg` of a log that begins then."""
    begin = datetime.datetime.fromtimestamp(unix_us // 1_000_000, datetime.UTC)
    return (begin + datetime.timedelta(minutes=utc_offset_min)).strftime("%Y-%m-%d/%H_%M_%S.ulg")


def keep_newest_folders(root: Path, count: int) -> None:
    """Remove the oldest days' logs but `count` (SDLOG_DIRS_MAX; 0: keep all). Raises OSError."""
    if count <= 0:
        return
    folders = sorted(path for path in (root / storage.LOG).iterdir() if DATE_FOLDER.fullmatch(path.name))
    for folder in folders[:-count]:
        shutil.rmtree(folder)


class LogFile:
    """A log that is being written, in pieces, into the instance's folder; the file is open only while a piece is."""

    def __init__(self, root: Path, unix_us: int, utc_offset_min: int) -> None:
        """Creates the file, under the next free second if there is one of that name already."""
        self.written_bytes = 0
        self.trouble = ""
        """Why it could not be written, in the system's words; empty while all is well."""
        self.gone = False
        """Somebody removed it, a client by LOG_ERASE perhaps. Its log ends, and the next flight has a file: on purpose
        otherwise than in PX4, whose writer goes on in the file that nobody sees any more, so that a flight after the
        boot log was erased is in no file (Logger::start_log_file returns where one is_started)."""
        while True:
            self.name = log_name(unix_us, utc_offset_min)
            self._path = root / storage.LOG / self.name
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                self._path.touch(exist_ok=False)
            except FileExistsError:
                if self._path.exists():
                    unix_us += 1_000_000
                    continue
                self.trouble = os.strerror(errno.ENOTDIR)
            except OSError as error:
                self.trouble = error.strerror or str(error)
            return

    def write(self, data: bytes, unix_us: int) -> None:
        """Append; the file's time is the simulated date, which LOG_ENTRY tells."""
        try:
            with FileIO(self._path, "r+b") as file:
                file.seek(0, os.SEEK_END)
                rest = memoryview(data)
                while rest:
                    rest = rest[file.write(rest) :]
            os.utime(self._path, (unix_us // 1_000_000,) * 2)
            self.written_bytes += len(data)
        except FileNotFoundError:
            self.gone = True
        except OSError as error:
            self.trouble = error.strerror or str(error)
