"""Where vehicles of `sitl-emu launch` keep their parameters, missions and logs from one launch to the next."""

import os
from pathlib import Path

from sitl_emu.autopilot.storage import storage
from sitl_emu.run.trouble import Trouble, unwritable

REMEDY = "name another folder with --state"


def default_folder() -> Path:
    """`sitl-emu` in $XDG_STATE_HOME, or in ~/.local/state. Raises Trouble for a user without a home."""
    given = Path(os.environ.get("XDG_STATE_HOME", ""))
    if given.is_absolute():
        return given / "sitl-emu"
    try:
        return Path.home() / ".local" / "state" / "sitl-emu"
    except RuntimeError as error:
        raise Trouble(f"no folder for parameters, missions and logs: {error}; {REMEDY}") from None


def prepare(folder: Path, model: str, instance: int, *, fresh: bool) -> Path:
    """The folder of one vehicle inside the state folder, ready for use. Raises Trouble."""
    root = folder / f"{model}-{instance}"
    try:
        storage.prepare(root, fresh=fresh)
    except storage.StorageError as error:
        raise Trouble(f"{error}; {REMEDY}") from None
    return root


def make(folder: Path) -> None:
    """Make a folder for logs. Raises Trouble."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error, "--tlog") from None
