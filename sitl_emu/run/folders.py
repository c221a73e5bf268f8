"""Folders that a command fills: new or empty ones, so that nothing of the user's, or of an earlier one, is lost."""

import itertools
import os
from pathlib import Path

from sitl_emu.run.trouble import Trouble, unwritable


def make(folder: Path) -> None:
    """Make the folder of a command's --out. Raises Trouble where it holds something, or can't be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise Trouble(f"--out {folder}: this folder is not empty; name a new one")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(None, "Permission denied")
    except OSError as error:
        raise unwritable(folder, error) from None


def make_new(folder: Path) -> Path:
    """Make a folder that nobody else has: of this name, or with a number after it. Raises Trouble."""
    new, numbers = folder, itertools.count(2)
    while True:
        try:
            new.mkdir(parents=True)
        except FileExistsError:
            new = folder.with_name(f"{folder.name}-{next(numbers)}")
        except OSError as error:
            raise unwritable(folder, error) from None
        else:
            return new
