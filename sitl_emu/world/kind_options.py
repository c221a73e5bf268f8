"""Options of worlds that are generated: each a number within bounds, with a default."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from sitl_emu.world.description import WorldError


class Option(NamedTuple):
    """One number that a kind takes."""

    default: float
    low: float
    high: float
    is_whole: bool = False


def chosen(kind: str, known: Mapping[str, Option], given: Mapping[str, Any]) -> dict[str, float]:
    """All options of a kind, as given or by default. Raises WorldError, which names what is allowed."""
    for name, value in given.items():
        if name not in known:
            raise WorldError(f"world {kind} has no option {name!r}; it knows {', '.join(known)}")
        option = known[name]
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not is_number or not option.low <= value <= option.high or (option.is_whole and value != int(value)):
            what = "a whole number" if option.is_whole else "a number"
            raise WorldError(f"world {kind}: {name}: {value!r}; must be {what} from {option.low:g} to {option.high:g}")
    return {name: float(given.get(name, option.default)) for name, option in known.items()}
