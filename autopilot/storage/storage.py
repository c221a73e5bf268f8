"""The folder of one instance, which stands for the root of PX4's file system (PX4 SITL: `rootfs/<instance>`).

Every path in it has its name here. Whoever keeps something there reads and writes its own file, through a `Path` that
it is handed; None instead of a folder means that there is no storage, as on a flight controller without a card.
"""

import shutil
import tempfile
from pathlib import Path

PARAMETERS = "parameters.bson"
PARAMETERS_BACKUP = "parameters_backup.bson"
DATAMAN = "dataman"
EEPROM = "eeprom"
LOG = "log"
MAVLINK = "mavlink"
SIGNING_KEY = f"{MAVLINK}/mavlink-signing-key.bin"

FOLDERS = (EEPROM, LOG)
SETTINGS = (PARAMETERS, PARAMETERS_BACKUP, DATAMAN, EEPROM, MAVLINK)
"""What `forget` removes; flight logs and files that a user put there stay."""
NEEDED_BYTES = 1 << 20
"""Parameters, missions and a first log fit in so much."""


class StorageError(Exception):
    """A folder that can't be used; the text is one line for people."""


def prepare(root: Path, *, fresh: bool = False) -> None:
    """Make the folder of an instance and see that it can be written; `fresh` forgets what was set in earlier flights.

    Raises StorageError.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
        if fresh:
            forget(root)
        for name in FOLDERS:
            (root / name).mkdir(exist_ok=True)
        with tempfile.TemporaryFile(dir=root) as trial:
            trial.write(bytes(NEEDED_BYTES))
    except OSError as error:
        raise StorageError(f"{error.filename or root}: can't keep files there: {error.strerror}") from None


def forget(root: Path) -> None:
    """Remove what was set in earlier flights: parameters, missions, calibration, the signing key. Raises OSError."""
    for name in SETTINGS:
        path = root / name
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def write(path: Path, data: bytes) -> None:
    """Replace a file's content whole or not at all, also when the process is killed meanwhile. Raises OSError."""
    new = path.with_name(path.name + ".new")
    try:
        new.write_bytes(data)
        new.replace(path)
    except OSError:
        new.unlink(missing_ok=True)
        raise
