"""Files that somebody else is still writing: what has come since they were read last."""

import json
from pathlib import Path
from typing import Any


class GrowingFile:
    """Bytes at the end of a file; one that is not there yet is empty."""

    def __init__(self, path: Path) -> None:
        self._path, self._at = path, 0

    def read(self) -> bytes:
        """What is new."""
        try:
            with self._path.open("rb") as file:
                file.seek(self._at)
                data = file.read()
        except FileNotFoundError:
            return b""
        self._at += len(data)
        return data


class GrowingLines:
    """Whole lines; the last one waits until it is whole."""

    def __init__(self, path: Path) -> None:
        self._file, self._rest = GrowingFile(path), b""

    def read(self) -> list[str]:
        """Those that are new."""
        *lines, self._rest = (self._rest + self._file.read()).split(b"\n")
        return [line.decode(errors="replace") for line in lines]

    def objects(self) -> list[dict[str, Any]]:
        """New lines that are JSON objects; any other is left out."""
        made = list[dict[str, Any]]()
        for line in self.read():
            try:
                value = json.loads(line)
            except ValueError:
                continue
            if isinstance(value, dict):
                made.append(value)
        return made
