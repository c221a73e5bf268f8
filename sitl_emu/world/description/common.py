"""What the records of a world file share: limits, colours, polygons, and the error."""

from typing import Annotated

from sitl_emu.vehicles.record import Limits

GROUND = "ground"
"""What a hit on the terrain is called, and so nothing else."""
FARTHEST = Limits(-100_000.0, 100_000.0)
Colour = Annotated[tuple[float, float, float], Limits(0.0, 1.0)]
"""Red, green, blue."""
Polygon = Annotated[tuple[tuple[float, float], ...], FARTHEST]
"""Corners (north, east) in m, three or more, in either sense; the last is joined to the first."""


class WorldError(Exception):
    """A world that is unknown, wrong or can't be built; the text is one line for people."""
