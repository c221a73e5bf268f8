"""What physics, lidar and camera ask of the ground: its height at a place.

`HeightMap` of `terrain.py` is the ground of generated worlds; `FlatGround` that of `launch`, level at the world's
origin, as PX4's SIH has it.
"""

from typing import Protocol


class Terrain(Protocol):
    """Ground without overhangs."""

    def height_m(self, north_m: float, east_m: float) -> float:
        """Height above the world's origin (up), at metres north and east of it."""
        ...


class FlatGround:
    """Level ground at one height, without end."""

    def __init__(self, height_m: float = 0.0) -> None:
        self._height_m = height_m

    def height_m(self, north_m: float, east_m: float) -> float:
        """The same height everywhere."""
        return self._height_m
