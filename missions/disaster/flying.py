"""What parts of a disaster mission need of the flight that they are parts of."""

from collections.abc import Generator
from typing import Protocol

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.coverage import Line
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.disaster.places import Place
from sitl_emu.missions.disaster.regions import Region, RegionMap
from sitl_emu.missions.disaster.relief import Relief
from sitl_emu.missions.disaster.settings import Settings

STANDING_M, HEIGHT_M = 1.0, 0.7
"""How near is over a place, and at a height; ours."""


class Flying(Protocol):
    """What is needed of one's own flight (`flight.Flight`, which says what each of these does)."""

    onboard: Onboard
    settings: Settings
    regions: RegionMap | None
    home: tuple[float, float, float]
    delivered: bool
    ground: Relief

    @property
    def here_m(self) -> Corner: ...  # noqa: D102
    @property
    def altitude_m(self) -> float: ...  # noqa: D102
    @property
    def over_ground_m(self) -> float: ...  # noqa: D102
    def place_deg(self, place_m: Corner) -> tuple[float, float]: ...  # noqa: D102
    def check(self) -> None: ...  # noqa: D102
    def until_clear(self, to_m: Corner) -> Generator[None, None, bool]: ...  # noqa: D102
    def clear_return(self) -> Script: ...  # noqa: D102
    def due(self) -> Place | None: ...  # noqa: D102
    def fly_line(self, number: int, line: Line) -> Script: ...  # noqa: D102
    def go_aside(self, place: Place, left_m: Corner | None = None) -> Script: ...  # noqa: D102
    def place_of(self, region: Region, *, closer: bool = False) -> Place | None: ...  # noqa: D102
    def may_try_at(self, place: Place) -> bool: ...  # noqa: D102
