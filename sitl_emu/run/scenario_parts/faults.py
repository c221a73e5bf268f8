"""Faults on a scenario's timeline."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from sitl_emu.run.configs import Fault, FaultData
from sitl_emu.run.scenario_parts.part import LONGEST_RUN_S, Part


class EventPart(Part):
    """The first event of a kind, as events.jsonl has it, and how long after it."""

    event: str
    vehicle: str | None = None
    """Whose event; by default that of the vehicle that the fault befalls."""
    text: str = ""
    """What the event's text contains."""
    after_s: Annotated[float, Field(ge=0, le=LONGEST_RUN_S)] = 0.0


class FaultKind(Part):
    """What fails; exactly one of these."""

    motor: Annotated[int, Field(ge=1)] | None = None
    sensor: Literal["gps", "baro", "mag", "lidar"] | None = None
    gps_satellites: Annotated[int, Field(ge=0, le=50)] | None = None
    gps_offset_m: tuple[float, float, float] | None = None
    battery_charge: Annotated[float, Field(ge=0, le=1)] | None = None
    battery_drain_w: Annotated[float, Field(ge=0, le=1e5)] | None = None
    radio: Literal["out"] | None = None
    kill: Literal["autopilot", "companion"] | None = None

    @model_validator(mode="after")
    def one_of_them(self) -> "FaultKind":
        """A fault is one thing; several at a time are several entries."""
        given = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give exactly one of {', '.join(type(self).model_fields)}")
        return self

    @property
    def lasts(self) -> bool:
        """Whether it can end again."""
        return self.battery_charge is None and self.kill is None


class FaultPart(Part):
    """A fault on the timeline: `at_s`, or `when` an event comes, and perhaps only `for_s`."""

    vehicle: str
    fault: FaultKind
    at_s: Annotated[float, Field(ge=0, le=LONGEST_RUN_S)] | None = None
    when: EventPart | None = None
    for_s: Annotated[float, Field(gt=0, le=LONGEST_RUN_S)] | None = None

    @model_validator(mode="after")
    def at_one_time(self) -> "FaultPart":
        """Either a time or an event."""
        if (self.at_s is None) == (self.when is None):
            raise ValueError("give either `at_s` or `when`")
        if self.for_s is not None and not self.fault.lasts:
            raise ValueError("`for_s` is for what can end again; a charge and a killed process can't")
        return self

    @property
    def data(self) -> FaultData:
        """The same for the world process."""
        when = self.when
        return FaultData(
            vehicle=self.vehicle,
            fault=Fault(**self.fault.model_dump()),
            at_us=None if self.at_s is None else round(self.at_s * 1e6),
            for_us=None if self.for_s is None else round(self.for_s * 1e6),
            event=when.event if when else "",
            event_vehicle=(when.vehicle or self.vehicle) if when else "",
            event_text=when.text if when else "",
            after_us=round(when.after_s * 1e6) if when else 0,
        )
