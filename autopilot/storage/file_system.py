"""What a ground station sees of the autopilot's files: the folder of the instance, and beside it a read-only `etc/`.

Failures are OSErrors with the errno that PX4's SITL gets from Linux, or ProtectedError. `..` leads nowhere, as in
PX4 v1.18; nor does a symbolic link out of the folder. Files are read piece by piece, whatever their size.
"""

import errno
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, NoReturn, Protocol

from sitl_emu.autopilot.storage import storage

ETC = "etc"
MAV_LOG = "@MAV_LOG"
"""The folder of the logs, whatever its name is (MavlinkFTP::_constructPath)."""
MODE = 0o666
FOLDER_BYTES = 4096
"""Size of a folder, as Linux gives it."""

Tree = Mapping[str, bytes]
"""Files in memory by their path below the root."""


class ProtectedError(Exception):
    """The path leads out of the folder, or would be written where only reading is allowed."""


class Entry(NamedTuple):
    """One entry of a folder."""

    name: str
    kind: str
    """`F` file, `D` folder, `S` anything else, which a listing skips; MAVLink FTP's letters."""
    size: int = 0
    modified_s: int = 0
    """Unix time; 0 if not known."""


DOTS = [Entry(".", "S"), Entry("..", "S")]


class OpenFile(Protocol):
    """A file that was opened."""

    size: int
    """When it was opened, before that changed it."""

    def read(self, offset: int, count: int) -> bytes:
        """At most `count` bytes; raises OSError."""
        ...

    def write(self, offset: int, data: bytes) -> int:
        """How many bytes were written; raises OSError."""
        ...


class DiskFile:
    """A file of the instance's folder; closed when nobody holds it any more."""

    def __init__(self, path: Path, flags: int) -> None:
        try:
            self.size = path.stat().st_size
        except OSError:
            self.size = 0
        # O_NONBLOCK: a FIFO or device that somebody put there must not hold the autopilot up
        self._descriptor = os.open(path, flags | os.O_NONBLOCK, MODE)

    def __del__(self) -> None:
        if hasattr(self, "_descriptor"):
            os.close(self._descriptor)

    def read(self, offset: int, count: int) -> bytes:
        """See OpenFile."""
        return os.pread(self._descriptor, count, offset)

    def write(self, offset: int, data: bytes) -> int:
        """See OpenFile."""
        return os.pwrite(self._descriptor, data, offset)


class MemoryFile:
    """A file of `etc/`, or with None a folder of it, which can be opened too and then gives EISDIR."""

    def __init__(self, content: bytes | None) -> None:
        self._content = content
        self.size = FOLDER_BYTES if content is None else len(content)

    def read(self, offset: int, count: int) -> bytes:
        """See OpenFile."""
        if self._content is None:
            _fail(errno.EISDIR)
        return self._content[offset : offset + count]

    def write(self, _offset: int, _data: bytes) -> int:
        """See OpenFile."""
        _fail(errno.EBADF)


class FileSystem:
    """The folder of an instance and `etc/`. Paths are relative to it, with or without a slash in front."""

    def __init__(self, root: Path | None, etc: Callable[[], Tree], folders: tuple[str, ...] = ()) -> None:
        """`root` None: no storage, only `etc/`. `etc` makes the files below it; `folders` exist even if empty."""
        self._root = None if root is None else Path(os.path.realpath(root))
        self._etc = etc
        self._folders = (ETC, *folders)

    def entries(self, path: str) -> list[Entry]:
        """What is in a folder, sorted by name, then `.` and `..`."""
        names = _names(path)
        if names[:1] == [ETC]:
            return self._entries_of_etc("/".join(names)) + DOTS
        found = [] if self._root is None and not names else _entries_of(self._on_disk(names))
        if not names:
            found.append(Entry(ETC, "S"))  # on PX4's SITL it is a symbolic link, and those are skipped
        return sorted(found) + DOTS

    def open(self, path: str, flags: int) -> OpenFile:
        """A file, opened with the flags of os.open."""
        names = _names(path)
        if names[:1] != [ETC]:
            if not names and self._root is None:
                return MemoryFile(None)
            return DiskFile(self._on_disk(names), flags)
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC):
            raise ProtectedError
        wanted = "/".join(names)
        content = self._etc().get(wanted)
        if content is None and not self._is_folder_of_etc(wanted):
            _fail(errno.ENOENT)
        return MemoryFile(content)

    def truncate(self, path: str, size: int) -> None:
        """Cut a file or fill it up with zeros."""
        os.truncate(self._on_disk(self._writable(path)), size)

    def rename(self, path: str, new_path: str) -> None:
        """Rename or move, replacing a file that bears the new name."""
        old, new = self._writable(path), self._writable(new_path)
        if not old or not new:
            _fail(errno.EBUSY)
        self._on_disk(old, follow=False).rename(self._on_disk(new, follow=False))

    def remove(self, path: str) -> None:
        """Remove a file."""
        self._on_disk(self._writable(path), follow=False).unlink()

    def make_folder(self, path: str) -> None:
        """Make a folder."""
        self._on_disk(self._writable(path), follow=False).mkdir()

    def remove_folder(self, path: str) -> None:
        """Remove an empty folder."""
        names = self._writable(path)
        if not names:
            _fail(errno.EINVAL)
        self._on_disk(names, follow=False).rmdir()

    def _on_disk(self, names: list[str], follow: bool = True) -> Path:
        """The real path; `follow` False for calls that act on a symbolic link itself."""
        if self._root is None:
            _fail(errno.ENOENT)
        path = self._root.joinpath(*names)
        real = Path(os.path.realpath(path if follow or not names else path.parent))
        if not real.is_relative_to(self._root):
            raise ProtectedError
        return path

    @staticmethod
    def _writable(path: str) -> list[str]:
        names = _names(path)
        if names[:1] == [ETC]:
            raise ProtectedError
        return names

    def _entries_of_etc(self, folder: str) -> list[Entry]:
        if not self._is_folder_of_etc(folder):
            _fail(errno.ENOENT)
        files = self._etc()
        below = {path: Entry("", "F", len(content)) for path, content in files.items()}
        below |= {path: Entry("", "D") for path in self._folders}
        below |= {path.rpartition("/")[0]: Entry("", "D") for path in files}
        return sorted(
            entry._replace(name=path.rpartition("/")[2])
            for path, entry in below.items()
            if path.rpartition("/")[0] == folder
        )

    def _is_folder_of_etc(self, path: str) -> bool:
        return path in self._folders or any(name.startswith(f"{path}/") for name in self._etc())


def _names(path: str) -> list[str]:
    """The names on the way to a path. Raises ProtectedError where it goes up."""
    if path == MAV_LOG or path.startswith(f"{MAV_LOG}/"):
        path = storage.LOG + path.removeprefix(MAV_LOG)
    names = [name for name in path.split("/") if name not in ("", ".")]
    if ".." in names:
        raise ProtectedError
    return names


def _entries_of(folder: Path) -> list[Entry]:
    found = []
    with os.scandir(folder) as listing:
        for entry in listing:
            if entry.is_symlink():
                found.append(Entry(entry.name, "S"))
            elif entry.is_dir():
                found.append(Entry(entry.name, "D"))
            elif entry.is_file():
                status = entry.stat()
                found.append(Entry(entry.name, "F", status.st_size, int(status.st_mtime)))
            else:
                found.append(Entry(entry.name, "S"))
    return found


def _fail(number: int) -> NoReturn:
    raise OSError(number, os.strerror(number))
