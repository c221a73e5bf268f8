"""Horizontal vectors of the flight modes."""

import math


def shortened(x: float, y: float, most: float) -> tuple[float, float]:
    """The vector, but no longer than `most`; a limit below zero turns it round, as PX4's normalised vectors do."""
    size = math.hypot(x, y)
    if size > most and size > 0.0:
        return x * most / size, y * most / size
    return x, y
