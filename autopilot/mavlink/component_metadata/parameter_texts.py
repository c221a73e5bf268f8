"""What parameters are, in our words: a short and a long text of every parameter that a vehicle announces.

They lie in `texts/`, a file a subject, and are read when a ground station first asks for the metadata. `{n}` in a name
stands for a number, which the texts may repeat: one entry describes all instances.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar

FOLDER = Path(__file__).with_name("texts")
NUMBER = "{n}"
_INSTANCE = re.compile(r"\d+")
Entry = TypeVar("Entry")


class Text(NamedTuple):
    """A noun phrase, and what a change of the parameter does."""

    short: str
    long: str


def read() -> dict[str, Text]:
    """All texts by the parameter's name or that of its family."""
    return {
        name: Text(*text)
        for path in sorted(FOLDER.glob("*.json"))
        for name, text in json.loads(path.read_text(encoding="utf-8")).items()
    }


def described(texts: Mapping[str, Text], name: str) -> Text | None:
    """The texts of a parameter with its number filled in; None if it has none of its own, and its name must do."""
    text, number = found(texts, name)
    return None if text is None else Text(*(part.replace(NUMBER, number) for part in text))


def found(table: Mapping[str, Entry], name: str) -> tuple[Entry | None, str]:
    """The entry of a name or of its family, and the number that `{n}` stands for."""
    if name in table:
        return table[name], ""
    for number in _INSTANCE.finditer(name):
        entry = table.get(f"{name[: number.start()]}{NUMBER}{name[number.end() :]}")
        if entry is not None:
            return entry, number[0]
    return None, ""
