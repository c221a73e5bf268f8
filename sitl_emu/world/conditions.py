"""Wind and light that a scenario sets, instead of those that a world brings."""

import dataclasses
from typing import Any, NamedTuple


@dataclasses.dataclass(frozen=True, slots=True)
class WindChange:
    """The whole wind: where the air moves to, and the standard deviation of horizontal gusts, per axis."""

    north_m_s: float
    east_m_s: float
    gust_m_s: float


@dataclasses.dataclass(frozen=True, slots=True)
class LightChange:
    """Figures of the light, under the names a world's `light` has; None leaves the world's."""

    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    gain: float | None = None
    warmth: float | None = None
    visibility_m: float | None = None

    @property
    def given(self) -> dict[str, Any]:
        """What is changed."""
        return {name: value for name, value in dataclasses.asdict(self).items() if value is not None}


class Changes(NamedTuple):
    """Both; None leaves the world's own."""

    wind: WindChange | None = None
    light: LightChange | None = None
