"""A matrix as PX4 prints it: columns are numbered, every cell is nine characters wide (lib/matrix, Matrix::print)."""

from collections.abc import Iterator, Sequence

NOTHING = 1e-9
"""What is smaller is printed as 0."""
SMALL, LARGE = 1e-4, 10.0
"""From below the one and from the other on with an exponent."""


def lines(rows: Sequence[Sequence[float]], labels: Sequence[str] | None = None) -> Iterator[str]:
    """Of rows of one length; `labels` stand before them, else their numbers."""
    count = len(rows[0])
    if count > 1:
        yield "  " + "".join(f"|{column:2d}      " for column in range(count)) + "\n"
    for number, row in enumerate(rows):
        head = number if labels is None else labels[number]
        yield f"{head:>2}|{''.join(map(_cell, row))}\n"


def _cell(value: float) -> str:
    if abs(value) < NOTHING:
        return " 0       "
    return f"{value: .1e} " if abs(value) < SMALL or abs(value) >= LARGE else f"{value: .5f} "
