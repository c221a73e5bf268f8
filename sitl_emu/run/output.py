"""Standard output as long as somebody reads it; then (`| head`, a full disk, a terminal that was closed) to nobody.

What is said is none of a run's results: nothing else ends with it.
"""

import contextlib
import os
import sys
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console


def console() -> "Console":
    """On standard output, closed though it may be."""
    from rich.console import Console

    return Console(file=None if sys.stdout is None else Output(sys.stdout))  # type: ignore[arg-type]


def to_nobody(file: TextIO) -> None:
    """Let what is written to a file from now on, and what waits in it, go nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, file.fileno())
    os.close(nowhere)


class Output:
    """A text file that fails for nobody."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def write(self, text: str) -> int:
        """All of it, or as much as somebody reads."""
        try:
            return self._file.write(text)
        except OSError:
            to_nobody(self._file)
        except UnicodeEncodeError:  # by the locale's encoding
            encoding = self._file.encoding
            return self.write(text.encode(encoding, "replace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        """What waits."""
        try:
            self._file.flush()
        except OSError:
            to_nobody(self._file)
            with contextlib.suppress(OSError):
                self._file.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)
