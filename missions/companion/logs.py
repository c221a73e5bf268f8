"""Logs of a flight: one that can't be written any more ends, and the flight goes on."""

from collections.abc import Callable
from pathlib import Path
from typing import Generic, Protocol, TypeVar


class Closes(Protocol):
    """An open file, or what writes into one."""

    def close(self) -> None:
        """Makes it whole."""
        ...


Writer = TypeVar("Writer", bound=Closes)


class Log(Generic[Writer]):
    """A log that ends at its first error: a full disk, or a card that was pulled out."""

    def __init__(self, path: Path, writer: Writer) -> None:
        self._path, self._writer = path, writer
        self.error = ""
        """Why it has ended, a line for people; "" while it has not."""

    def write(self, write: Callable[[Writer], object]) -> None:
        """Has `write` add something; nothing any more once that has failed."""
        if not self.error:
            self._try(lambda: write(self._writer))

    def close(self) -> None:
        """Makes it whole, as far as it can be."""
        self._try(self._writer.close)

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except OSError as error:
            self.error = self.error or f"{self._path.name} ends: {error.strerror or error}"
