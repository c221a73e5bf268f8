"""Scenario files: which vehicles, in which world, with which companions, and how they talk.

A YAML file per scenario; those that missions bring go by their name. Whatever is wrong in a file is told in one line
with file, field, value and what is allowed. The parts are in `scenario_parts/`.
"""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from sitl_emu.missions import registry
from sitl_emu.missions.companion.swarm.key import MOST_SEED
from sitl_emu.run import worlds
from sitl_emu.run.scenario_parts.faults import EventPart, FaultKind, FaultPart
from sitl_emu.run.scenario_parts.feeds import CameraPart, DepthPart, DistortionPart, LidarPart, MountPart
from sitl_emu.run.scenario_parts.part import LONGEST_RUN_S, NAME, NUMBERS, Part, Place
from sitl_emu.run.scenario_parts.vehicle import MOST, AutopilotPart, CompanionPart, VehiclePart, counted
from sitl_emu.run.scenario_parts.world import LightPart, PeerRadio, WindPart, WorldPart
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.conditions import Changes
from sitl_emu.world.description import yaml_text

SUFFIX = ".yaml"


class ScenarioError(Trouble):
    """A scenario that is unknown or wrong; the text is one line for people."""


class Scenario(Part):
    """One scenario file."""

    format: Literal[1] = 1
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,60}$")]
    description: str = ""
    seed: Annotated[int, Field(ge=0, le=MOST_SEED)] = 1
    start_date: datetime = datetime(2026, 6, 15, 9, 0, tzinfo=UTC)
    time_limit_s: Annotated[float, Field(gt=0, le=LONGEST_RUN_S)] = 1800.0
    world: WorldPart
    wind: WindPart | None = None
    light: LightPart | None = None
    vehicles: Annotated[list[VehiclePart], Field(min_length=1, max_length=MOST)]
    peer_radio: PeerRadio = PeerRadio()
    faults: list[FaultPart] = Field(default_factory=list)

    @model_validator(mode="after")
    def names_differ(self) -> "Scenario":
        """Vehicle names are file names too."""
        names = [vehicle.name for vehicle in self.vehicles]
        if len(set(names)) != len(names):
            raise ValueError(f"vehicle names must differ, these do not: {', '.join(names)}")
        return self

    @field_validator("vehicles", mode="before")
    @classmethod
    def as_many_as_counted(cls, vehicles: Any) -> Any:
        """Each vehicle with a `count` stands for so many."""
        return counted(vehicles)

    @field_validator("start_date")
    @classmethod
    def can_be_logged(cls, date: datetime) -> datetime:
        """Logs count from 1970; a date without a zone is UTC."""
        date = date if date.tzinfo else date.replace(tzinfo=UTC)
        if not 1970 <= date.year < 2200:
            raise ValueError("a date from 1970 to 2199")
        return date

    @property
    def changes(self) -> Changes:
        """What is other than the world has it."""
        wind = None if self.wind is None else self.wind.change
        light = None if self.light is None else self.light.change
        return Changes(wind, light)

    @field_validator("world", mode="before")
    @classmethod
    def by_one_word(cls, world: Any) -> Any:
        """A kind or a file alone stands for a mapping without options."""
        return {"kind": world} if isinstance(world, str) else world

    @property
    def start_us(self) -> int:
        """The start date as microseconds since 1970."""
        return round(self.start_date.timestamp() * 1e6)


def find(name_or_file: str) -> Path:
    """The file of a scenario. Raises ScenarioError, which lists those there are."""
    path = Path(name_or_file)
    if path.suffix in {".yaml", ".yml"} or path.is_file():
        if not path.is_file():
            raise ScenarioError(f"{path}: there is no such scenario file")
        return path
    brought = registry.scenarios()
    if name_or_file not in brought:
        known = f"missions bring: {', '.join(sorted(brought))}; or give a {SUFFIX} file"
        raise ScenarioError("; ".join([f"there is no scenario {name_or_file!r}; {known}", *registry.broken()]))
    return brought[name_or_file]


def load(path: Path) -> Scenario:
    """Read and check a scenario file. Raises ScenarioError."""
    return checked(read(path), path)


def read(path: Path) -> dict[str, Any]:
    """What a scenario file says, unchecked. Raises ScenarioError where it is no mapping."""
    try:
        data = yaml_text.load(path.read_text("utf-8"))
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}") from None
    except yaml_text.YamlError as error:
        raise ScenarioError(f"{path}: {error}") from None
    except ValueError as error:  # no UTF-8
        raise ScenarioError(f"{path}: not YAML: {error}") from None
    if not isinstance(data, dict):
        raise ScenarioError(f"{path}: a scenario is a mapping with the fields {', '.join(Scenario.model_fields)}")
    return data


def checked(data: dict[str, Any], path: Path) -> Scenario:
    """A scenario from what its file says; `path`: of the file, beside which others are named. Raises ScenarioError."""
    try:
        scenario = Scenario.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise ScenarioError(f"{path}: {_explained(error)}") from None
    if worlds.is_file(scenario.world.kind):
        beside = WorldPart(kind=str(path.parent / scenario.world.kind), options=scenario.world.options)
        scenario = scenario.model_copy(update={"world": beside})
    for vehicle in scenario.vehicles:
        if vehicle.companion is not None:
            _find_files(vehicle.companion.options, path.parent)
        for part in (vehicle.companion, vehicle.autopilot):
            words = part.command or [] if part is not None else []
            words[:] = [_beside(word, path.parent) for word in words]
    return scenario


def _find_files(options: dict[str, Any], folder: Path) -> None:
    """Make options that name a file beside the scenario into whole paths."""
    for name, value in options.items():
        if isinstance(value, str):
            options[name] = _beside(value, folder)


def _beside(word: str, folder: Path) -> str:
    """The whole path of a file in a folder; any other word as it is."""
    return str((folder / word).resolve()) if word and (folder / word).is_file() else word


def _explained(error: ValidationError) -> str:
    """The first error as `field: value: what is allowed`."""
    first = error.errors()[0]
    where = [part for part in first["loc"] if part not in _UNION_TAGS]
    field = ".".join(str(part) for part in where) or "scenario"
    if first["type"] == "extra_forbidden":
        return f"{field}: unknown field; allowed here: {', '.join(_fields_at(where[:-1]))}"
    if first["type"] == "missing":
        return f"{field}: this field is missing"
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] in {"model_type", "model_attributes_type"}:
        alternative = "a name, or " if first["loc"][-1] == NUMBERS else ""
        message = f"must be {alternative}a mapping with the fields {', '.join(_fields_at(where))}"
    elif first["type"] == "dict_type":
        message = "must be a mapping"
    value = first["input"]
    shown = repr(value) if not isinstance(value, dict) else "(mapping)"
    return f"{field}: {shown}: {message}"


_UNION_TAGS = {NAME, NUMBERS}


def _fields_at(where: list[int | str]) -> list[str]:
    """The fields that the part at this place may have."""
    part: type[BaseModel] = Scenario
    for name in where:
        if isinstance(name, int):
            continue
        part = _PARTS.get(name, part)
    return list(part.model_fields)


_PARTS: dict[str, type[BaseModel]] = {
    "world": WorldPart,
    "wind": WindPart,
    "light": LightPart,
    "vehicles": VehiclePart,
    "peer_radio": PeerRadio,
    "camera": CameraPart,
    "depth": DepthPart,
    "lidar": LidarPart,
    "companion": CompanionPart,
    "autopilot": AutopilotPart,
    "start": Place,
    "mount": MountPart,
    "distortion": DistortionPart,
    "faults": FaultPart,
    "when": EventPart,
    "fault": FaultKind,
}
