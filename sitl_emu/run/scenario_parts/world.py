"""The world of a scenario, what is other in it, and the radio between companions."""

from typing import Annotated, Any

from pydantic import Field, field_validator

from sitl_emu.core.radio import Outage, RadioSettings
from sitl_emu.run.scenario_parts.part import Part
from sitl_emu.world.conditions import LightChange, WindChange


class WorldPart(Part):
    """A world by its kind, and the options that kind knows; or by its file (`world: my_world.yaml`)."""

    kind: str
    options: dict[str, Any] = Field(default_factory=dict)


class WindPart(Part):
    """Wind instead of the world's own: where the air moves to, and the standard deviation of gusts, per axis."""

    north_m_s: Annotated[float, Field(ge=-40, le=40)] = 0.0
    east_m_s: Annotated[float, Field(ge=-40, le=40)] = 0.0
    gust_m_s: Annotated[float, Field(ge=0, le=20)] = 0.0

    @property
    def change(self) -> WindChange:
        """The same for the world."""
        return WindChange(**self.model_dump())


class LightPart(Part):
    """The sun, the exposure and the air; what is left out stays the world's."""

    azimuth_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    """Where the sun stands, from north over east."""
    elevation_deg: Annotated[float, Field(ge=5, le=90)] | None = None
    """Above the horizon."""
    gain: Annotated[float, Field(ge=0.1, le=4)] | None = None
    """Brightness of the picture; 1 exposes it as it should be."""
    warmth: Annotated[float, Field(ge=0.5, le=2)] | None = None
    """Red over blue; above 1 is a low, warm sun."""
    visibility_m: Annotated[float, Field(ge=20, le=1e6)] | None = None
    """Meteorological optical range: mist has less than 5000 m, fog less than 1000 m."""

    @property
    def change(self) -> LightChange:
        """The same for the world."""
        return LightChange(**self.model_dump())


class PeerRadio(Part):
    """The radio between the companions."""

    range_m: Annotated[float, Field(gt=0)] = 1000.0
    latency_s: Annotated[float, Field(ge=0, le=10)] = 0.02
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    bandwidth_bit_s: Annotated[float, Field(gt=0)] = 250_000.0
    outages_s: list[tuple[float, float]] = Field(default_factory=list)
    shared: bool = False
    """One air, and its bandwidth, for all together, rather than a link for each pair."""
    obstructed_range_m: Annotated[float, Field(ge=0)] | None = None
    """How far it reaches through ground and what is solid."""

    @field_validator("outages_s")
    @classmethod
    def end_after_they_start(cls, outages: list[tuple[float, float]]) -> list[tuple[float, float]]:
        """In simulated time since the start of the run."""
        for start, end in outages:
            if not 0.0 <= start < end:
                raise ValueError(f"[{start:g}, {end:g}]: an outage is [start, end], 0 or more, the end after the start")
        return outages

    def settings(self) -> RadioSettings:
        """The same for `core.radio`."""
        outages = tuple(Outage(start, end) for start, end in self.outages_s)
        return RadioSettings(
            self.range_m,
            self.latency_s,
            self.loss,
            self.bandwidth_bit_s,
            RadioSettings().queue_bytes,
            outages,
            self.shared,
            self.obstructed_range_m,
        )
