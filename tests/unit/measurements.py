"""What was measured on a real PX4 v1.18, by name: `measurements.txt` lists the ids of protocol facts and of flights.

The values are not here. A protocol fact of a single parameter (`param/NAME`) is left out: those are
`autopilot/parameters/parameters.json`.
"""

import functools
import pathlib
from fnmatch import fnmatchcase


@functools.cache
def ids() -> frozenset[str]:
    return frozenset(pathlib.Path(__file__).with_suffix(".txt").read_text().split())


@functools.cache
def is_known(name: str) -> bool:
    """Whether a name is a measurement's id, or a pattern (`*` for any rest) that fits at least one."""
    return name in ids() or ("*" in name and any(fnmatchcase(each, name) for each in ids()))
