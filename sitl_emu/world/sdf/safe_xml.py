"""XML of others, read without what XML can do to its reader: a file that declares entities or a DTD is refused."""

from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from sitl_emu.world.description.common import WorldError

MOST_BYTES = 64_000_000
"""Ours: the largest worlds of Gazebo's are of some megabytes."""


class _Declared(Exception):
    """There is a document type declaration."""


def read(path: Path) -> ElementTree.Element:
    """The root element. Raises WorldError."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise WorldError(f"{path}: {path.stat().st_size} bytes; {MOST_BYTES} are allowed")
        data = path.read_bytes()
    except OSError as error:
        raise WorldError(f"{path}: {error.strerror}") from None
    try:
        _refuse_declarations(data)
        return ElementTree.fromstring(data)
    except _Declared:
        raise WorldError(f"{path}: declares a DTD, which may hold entities; SDF has none: take it out") from None
    except (expat.ExpatError, ElementTree.ParseError, LookupError, ValueError) as error:
        raise WorldError(f"{path}: not XML: {error}") from None


def _refuse_declarations(data: bytes) -> None:
    """Entities, which may grow without bounds or name other files, can only be declared in a DTD."""

    def refuse(*_: object) -> None:
        raise _Declared

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.Parse(data, True)
