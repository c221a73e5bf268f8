"""A vehicle of a scenario: its model, autopilot and companion."""

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, Tag, ValidationInfo, field_validator, model_validator

from sitl_emu import vehicles
from sitl_emu.run.configs import CameraDescription, DepthDescription, LidarDescription, ModelData
from sitl_emu.run.scenario_parts.feeds import CameraPart, DepthPart, LidarPart, checked
from sitl_emu.run.scenario_parts.part import NAME, NAME_OR_NUMBERS, NUMBERS, Part, Place

MOST = 40
"""Vehicles of a scenario."""


class CompanionPart(Part):
    """A companion computer: one of our missions, or any command.

    In a command the words {connect}, {peer}, {camera}, {calibration}, {depth}, {depth_calibration}, {lidar}, {out},
    {seed} and {python} (the one that runs sitl-emu) are filled in; a word that is a file beside the scenario means
    that file.
    """

    mission: str | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    inference_latency_s: Annotated[float, Field(ge=0, le=2)] = 0.1
    command: Annotated[list[str], Field(min_length=1)] | None = None
    background: bool = False
    """The run does not wait for this command to end, but ends it: for a vehicle that is at others' service."""

    @model_validator(mode="after")
    def one_of_them(self) -> "CompanionPart":
        """Either a mission or a command."""
        if (self.mission is None) == (self.command is None):
            raise ValueError("give either `mission` or `command`")
        if self.background and self.command is None:
            raise ValueError("`background` is for a `command`; a mission says itself when it is done")
        return self


class AutopilotPart(Part):
    """An autopilot from outside: any command that connects to TCP 4560+instance, such as a real PX4.

    In its command and its environment the words {instance}, {port}, {name}, {model}, {rootfs}, {out}, {seed} and
    {python} are filled in; a word that is a file beside the scenario means that file.
    """

    command: Annotated[list[str], Field(min_length=1)]
    env: dict[str, str | int | float] = Field(default_factory=dict)
    components: bool = False
    """Whether the vehicle's camera and gimbal speak to it, on PX4's payload and gimbal links."""

    @property
    def environment(self) -> dict[str, str]:
        """`env` as texts."""
        return {name: str(value) for name, value in self.env.items()}


class VehiclePart(Part):
    """A vehicle: its model, where it starts, its sensors, its camera and its companion."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,15}$")]
    model: str
    """One of ours, or a folder of one's own beside the scenario file."""
    start: Annotated[Annotated[str, Tag(NAME)] | Annotated[Place, Tag(NUMBERS)], NAME_OR_NUMBERS] = "home"
    count: Annotated[int, Field(ge=1, le=MOST, exclude=True)] = 1
    """So many of them (`counted`)."""
    sensors: dict[str, Any] = Field(default_factory=dict)
    """Figures of its model's sensors that are other here, named and nested as in `vehicle.toml`."""
    parcel: dict[str, Any] | None = None
    """Hangs on its model's release: figures of the parcel there that are other here. None: it carries none."""
    camera: CameraPart | None = None
    depth: DepthPart | None = None
    lidar: LidarPart | None = None
    """A scanning one; the single beam that PX4 flies by is one of its model's sensors."""
    autopilot: AutopilotPart | None = None
    """None: ours."""
    companion: CompanionPart | None = None

    @model_validator(mode="before")
    @classmethod
    def as_its_model_has_it(cls, given: Any, info: ValidationInfo) -> Any:
        """Figures of a depth camera or a lidar that are left out are those of the model's data, where it has any."""
        if not isinstance(given, dict) or not isinstance(given.get("model"), str):
            return given
        try:
            data = vehicles.load(_found(given["model"], info))
        except vehicles.VehicleError:  # `checks` says which
            return given
        own: dict[str, tuple[type[DepthPart] | type[LidarPart], Mapping[str, Any] | None]]
        own = {"depth": (DepthPart, data.depth), "lidar": (LidarPart, data.lidar)}
        return given | {
            name: checked(part, figures, f"{data.model}/{vehicles.TOML}: {name}") | given[name]
            for name, (part, figures) in own.items()
            if figures is not None and isinstance(given.get(name), dict)
        }

    @field_validator("model")
    @classmethod
    def beside_the_file(cls, model: str, info: ValidationInfo) -> str:
        """A model's folder as a whole path, so that it is found from anywhere."""
        return _found(model, info)

    @property
    def model_data(self) -> ModelData:
        """The model with its sensors' and its parcel's figures, for the processes that load it."""
        return ModelData(model=self.model, sensors=self.sensors, camera=self.camera_description, parcel=self.parcel)

    @property
    def camera_description(self) -> CameraDescription | None:
        """The camera: the scenario's figures, else those of the vehicle's data."""
        return None if self.camera is None else self.camera.description(vehicles.load(self.model).camera)

    @property
    def depth_description(self) -> DepthDescription | None:
        """The depth camera."""
        return None if self.depth is None else self.depth.description

    @property
    def lidar_description(self) -> LidarDescription | None:
        """The scanning lidar."""
        return None if self.lidar is None else self.lidar.description

    @property
    def tells_obstacles(self) -> bool:
        """Whether one of its feeds tells the autopilot of obstacles."""
        return any(part is not None and part.tells_obstacles for part in (self.depth, self.lidar))

    def depth_calibration(self, folder: Path) -> Path | None:
        """The calibration file of the depth camera in a run's folder; None where there is none."""
        return folder / f"{self.name}-depth.yaml" if self.depth is not None else None

    def calibration(self, folder: Path) -> Path | None:
        """The calibration file of the camera in a run's folder; None where there is no camera."""
        return folder / f"{self.name}-camera.yaml" if self.camera is not None else None


def counted(given: Any) -> Any:
    """The vehicles of a scenario as its file has them, with as many of each as its `count` says.

    After the first, `uas` at `home`, comes `uas2` at `home2`, and so on. Raises ValueError.
    """
    if not isinstance(given, list):
        return given
    vehicles = list[Any]()
    for one in given:
        count = one.get("count", 1) if isinstance(one, dict) else 1
        if not isinstance(count, int) or not 1 < count <= MOST:
            vehicles.append(one)
            continue
        start = one.get("start", "home")
        if not isinstance(start, str):
            raise ValueError("a `count` above 1 needs a place of the world by its name as `start`, such as home")
        alike = {name: value for name, value in one.items() if name != "count"}
        vehicles.append(alike)
        vehicles += [
            copy.deepcopy(alike) | {"name": f"{one.get('name')}{number}", "start": f"{start}{number}"}
            for number in range(2, count + 1)
        ]
    return vehicles


def _found(model: str, info: ValidationInfo) -> str:
    folder = info.context["folder"] / model if info.context else Path(model)
    is_own = model not in vehicles.models() and (vehicles.is_folder(folder) or "/" in model)
    return str(folder.resolve()) if is_own else model
