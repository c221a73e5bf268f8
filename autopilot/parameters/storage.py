"""Parameters outlive the process: read at boot, and saved by themselves soon after a change.

As PX4 SITL: param_load_default, param_save_default, autosave.cpp and the start-up script (init.d-posix/rcS). A file
that can't be read gives way to its backup, and where there is none, to the defaults. Without a folder nothing is kept.
"""

import errno
import os
from collections.abc import Callable
from pathlib import Path

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.parameters import SET_AT_EACH_START, Parameters, Value, matches
from sitl_emu.autopilot.parameters import file as parameter_file
from sitl_emu.autopilot.storage import storage

SAVE_DELAY_US = 300_000
"""So that what is set together is saved together."""
SAVE_INTERVAL_US = 2_000_000
RETRIES = 3
KEPT_BY_AUTOCONFIG = (
    "SYS_AUTOSTART",
    "SYS_PARAM_VER",
    "CAL_*",
    "LND_FLIGHT*",
    "TC_*",
    "COM_FLIGHT*",
)
"""What a start with SYS_AUTOCONFIG 1 does not reset (init.d-posix/rcS)."""
NO_AIRFRAME = 0
"""SYS_AUTOSTART by PX4's own default."""
OF_FIRST_START = "SENS_DPRES_OFF"
"""A first start sets it, so it is in PX4's files, and was in none of an emulator's before November 2026."""


class ParameterStorage:
    """The parameter file of one instance and its backup."""

    def __init__(self, parameters: Parameters, root: Path | None, say: Callable[[Severity, str], None]) -> None:
        """`root` is the instance's folder, None for no storage; `say` tells the ground of trouble."""
        self._parameters = parameters
        self._root = root
        self._file = None if root is None else root / storage.PARAMETERS
        self._backup = None if root is None else root / storage.PARAMETERS_BACKUP
        self._say = say
        self._edits_seen = parameters.edits
        self._due_us: int | None = None
        self._saved_us = -SAVE_INTERVAL_US
        self._tries = 0
        self._trouble_told = False

    def boot(self) -> None:
        """What the start-up script does: load, and begin anew if SYS_AUTOCONFIG or another airframe wants it."""
        parameters = self._parameters
        self.load()
        given = parameters.set_at_start
        airframe = given.get("SYS_AUTOSTART", NO_AIRFRAME)
        if airframe not in (NO_AIRFRAME, parameters["SYS_AUTOSTART"]):
            parameters.set("SYS_AUTOCONFIG", 1, notify=False)
        if parameters["SYS_AUTOCONFIG"] > 0:
            parameters.reset(lambda name: not matches(name, KEPT_BY_AUTOCONFIG))
        elif airframe != NO_AIRFRAME and parameters[OF_FIRST_START] != parameters.default(OF_FIRST_START):
            given = {name: value for name, value in given.items() if matches(name, SET_AT_EACH_START)}
        parameters.set_quietly(given)

    def load(self) -> bool:
        """Forget all changes and take over the saved values; False if the file can't be read.

        What can be read of a damaged file counts, then its backup; both are written anew soon.
        """
        parameters = self._parameters
        parameters.reset()
        self._edits_seen = parameters.edits
        if self._file is None or self._backup is None:
            return True
        intact = True
        for path in (self._file, self._backup):
            try:
                values, whole = parameter_file.decode(path.read_bytes())
            except FileNotFoundError:
                continue
            except OSError as error:
                self._say(Severity.CRITICAL, f"Parameters not loaded: {path.name}: {error.strerror}")
                values, whole = {}, False
            else:
                if not whole:
                    self._say(Severity.CRITICAL, f"Parameters not loaded: {path.name} is damaged")
            parameters.load(values)
            if whole:
                break
            intact = False
        if not intact:
            parameters.edits += 1
        return intact

    def save(self) -> bool:
        """Write file and backup now; False, told once, if that fails. A failure leaves the old files whole."""
        self._due_us = None
        self._edits_seen = self._parameters.edits
        if self._file is None or self._backup is None:
            self._parameters.unsaved.clear()
            return True
        document = self._document()
        try:
            storage.write(self._file, document)
            storage.write(self._backup, document)
        except OSError as error:
            if not self._trouble_told:
                self._say(Severity.CRITICAL, f"Parameters not saved: {error.strerror}")
            self._trouble_told = True
            return False
        self._trouble_told = False
        self._parameters.unsaved.clear()
        return True

    def export(self, name: str) -> None:
        """Write the changed values into a file of the folder (the shell's `param save FILE`). Raises OSError."""
        storage.write(self._inside(name), self._document())

    def take_from(self, name: str, *, reset: bool) -> tuple[dict[str, Value], bool]:
        """Take over a file's values, after a `reset` alone or on top of what is set, and save nothing by that.

        (The values, whether the file is whole.) Raises OSError.
        """
        values, whole = parameter_file.decode(self._inside(name).read_bytes())
        parameters = self._parameters
        edits = parameters.edits
        if reset:
            parameters.reset()
        parameters.load(values)
        parameters.unsaved.difference_update(values)
        if self._edits_seen == edits:
            self._edits_seen = parameters.edits
        return values, whole

    def _document(self) -> bytes:
        return parameter_file.encode(dict(sorted(self._parameters.changed().items())))

    def _inside(self, name: str) -> Path:
        """A file of the folder: nobody gets out of it, and nobody waits for what is no file. Raises OSError."""
        if self._root is None:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
        path = (self._root / name).resolve()
        if not path.is_relative_to(self._root.resolve()):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if path.exists() and not path.is_file():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        return path

    def update(self, now_us: int) -> None:
        """Save when it is time; run often."""
        parameters = self._parameters
        if self._due_us is None:
            if parameters.edits == self._edits_seen:
                return
            self._tries = 0
            self._schedule(now_us)
        elif now_us >= self._due_us:
            self._saved_us = now_us
            self._tries += 1
            if not self.save() and self._tries <= RETRIES:
                self._schedule(now_us)

    def close(self) -> None:
        """Save what waits to be saved: the process ends."""
        if self._parameters.edits != self._edits_seen or self._due_us is not None:
            self.save()

    def _schedule(self, now_us: int) -> None:
        self._edits_seen = self._parameters.edits
        self._due_us = max(now_us + SAVE_DELAY_US, self._saved_us + SAVE_INTERVAL_US)
