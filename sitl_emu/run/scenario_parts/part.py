"""What the parts of a scenario have in common, and places."""

import typing
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Discriminator, Field, ValidationInfo, field_validator

FARTHEST_M = 10_000.0
LONGEST_RUN_S = 7 * 86400.0
NAME, NUMBERS = "<name>", "<numbers>"


class Part(BaseModel):
    """What every part of a scenario has in common: unknown fields are errors, and so are numbers without end."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def no_switch_for_a_number(cls, value: Any, info: ValidationInfo) -> Any:
        """YAML's true, yes and on would pass for 1, false, no and off for 0."""
        if isinstance(value, bool):
            hint = cls.model_fields[info.field_name or ""].annotation
            if {float, int} & {hint, *typing.get_args(hint)}:
                raise ValueError("must be a number")
        return value


class Place(Part):
    """Where a vehicle starts, from the world's origin; the heading is from north over east."""

    north_m: Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
    east_m: Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
    heading_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0


def _name_or_numbers(value: object) -> str:
    return NAME if isinstance(value, str) else NUMBERS


NAME_OR_NUMBERS = Discriminator(_name_or_numbers)
"""Tells which of the two a value is meant as: errors then speak of that one alone."""
