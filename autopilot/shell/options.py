"""Options of a command line, wherever they stand among its words (PX4: platforms/common/px4_getopt.c)."""

from collections.abc import Sequence

NOT_UNDERSTOOD = -1
"""What commands return for an option that they do not have, or that lacks its value."""


def options(arguments: Sequence[str], letters: str) -> tuple[dict[str, str] | None, list[str]]:
    """Values by letter, of options that all take one, and the words beside them; None: not understood."""
    told: dict[str, str] = {}
    words: list[str] = []
    rest = iter(arguments)
    for word in rest:
        if not word.startswith("-"):
            words.append(word)
            continue
        letter = word[1:]
        value = next(rest, None)
        if value is None or len(letter) != 1 or letter not in letters:
            return None, words
        told[letter] = value
    return told, words
