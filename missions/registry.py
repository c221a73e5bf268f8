"""The missions a companion can run, by name."""

from typing import Any

from missions.companion.companion import Companion

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
