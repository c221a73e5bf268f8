"""Options of a mission, from a scenario file or a command line: typed, and unknown ones told."""

import json
from pathlib import Path
from typing import Any


class Options:
    """Takes options out of a mapping. All errors are ValueErrors that name option, value and what is allowed."""

    def __init__(self, options: dict[str, Any]) -> None:
        self._left = dict(options)
        self._known: list[str] = []

    def number(self, name: str, default: float, low: float, high: float) -> float:
        """A number between `low` and `high`."""
        value = self._take(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"option {name}: {value!r}; allowed: a number from {low:g} to {high:g}")
        return float(value)

    def whole(self, name: str, default: int, low: int, high: int) -> int:
        """A whole number between `low` and `high`."""
        value = self._take(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or value % 1 or not low <= value <= high:
            raise ValueError(f"option {name}: {value!r}; allowed: a whole number from {low} to {high}")
        return int(value)

    def mapping(self, name: str) -> dict[str, Any] | str | None:
        """A mapping, or the name of a file that holds one; None if it is not given."""
        value = self._take(name, None)
        if value is not None and not isinstance(value, dict | str):
            raise ValueError(f"option {name}: {value!r}; allowed: a mapping, or the name of a file with one")
        return value

    def content(self, name: str) -> dict[str, Any] | None:
        """A mapping, or that of a JSON file which is named; None if it is not given."""
        value = self.mapping(name)
        if not isinstance(value, str):
            return value
        try:
            told = json.loads(Path(value).read_text())
        except (OSError, ValueError) as error:
            raise ValueError(f"option {name}: {value!r}: can't be read as a JSON file: {error}") from None
        if not isinstance(told, dict):
            raise ValueError(f"option {name}: {value!r}; allowed: a JSON file with a mapping")
        return told

    def yes_or_no(self, name: str, default: bool) -> bool:
        """Yes or no, or what YAML makes of these words where they are not quoted."""
        value = self._take(name, default)
        if value not in (True, False, "yes", "no"):
            raise ValueError(f"option {name}: {value!r}; allowed: yes, no")
        return value in (True, "yes")

    def text(self, name: str, default: str | None = None) -> str:
        """A text; without a default it has to be there."""
        value = self._take(name, default)
        if not isinstance(value, str) or not value:
            shown = "missing" if value is None else repr(value)
            raise ValueError(f"option {name}: {shown}; allowed: a text")
        return value

    def file(self, name: str) -> Path | None:
        """A file, or None where none is given."""
        value = self._take(name, None)
        if value is not None and (not isinstance(value, str) or not value):
            raise ValueError(f"option {name}: {value!r}; allowed: the name of a file")
        return None if value is None else Path(value)

    def end(self) -> None:
        """All have been taken: what is left is unknown."""
        if self._left:
            name = next(iter(self._left))
            raise ValueError(f"option {name}: unknown; allowed: {', '.join(self._known)}")

    def _take(self, name: str, default: object) -> object:
        self._known.append(name)
        return self._left.pop(name, default)
