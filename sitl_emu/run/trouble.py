"""What a user can do something about: bad input, a port in use, a folder that can't be written."""

from pathlib import Path


class Trouble(Exception):
    """The text is one line for people: what is wrong, and what is allowed or what to do."""


def unwritable(folder: Path, error: OSError, option: str = "--out") -> Trouble:
    """That a folder, chosen by an option, can't be written."""
    return Trouble(f"{folder}: can't write there: {error.strerror or error}; name another folder with {option}")
