"""The missions a companion can run, by name, and the score of the runs they were flown in."""

from collections.abc import Collection
from typing import Any

from missions.companion.companion import Companion
from missions.scoring import MissionScore, RunRecord

NAMES = ("agriculture-scout", "agriculture-inspect")


class MissionError(Exception):
    """A mission that is unknown or was given wrong options; the text is one line for people."""


def make_companion(name: str, options: dict[str, Any]) -> Companion:
    """The companion program of a mission. Raises MissionError, which names what is wrong and what is allowed.

    `options` come from the scenario file or the command line; each mission's module documents its own.
    """
    try:
        if name == "agriculture-scout":
            from missions.agriculture.scout import Scout

            return Scout.from_options(options)
        if name == "agriculture-inspect":
            from missions.agriculture.inspect import Inspect

            return Inspect.from_options(options)
    except ValueError as error:
        raise MissionError(f"mission {name}: {error}") from error
    raise MissionError(f"there is no mission {name!r}; there are: {', '.join(NAMES)}")


def score_of(names: Collection[str], record: RunRecord) -> MissionScore | None:
    """The score of a run in which companions ran these missions; None where none of them has one."""
    if not {"agriculture-scout", "agriculture-inspect"}.isdisjoint(names):
        from missions.agriculture.score import score

        return score(record)
    return None
