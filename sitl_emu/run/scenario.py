"""Scenario files: which vehicles, in which world, with which companions, and how they talk.

A YAML file per scenario; those that missions bring go by their name. Whatever is wrong in a file is told in one line
with file, field, value and what is allowed.
"""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from sitl_emu import vehicles
from sitl_emu.core.radio import Outage, RadioSettings
from sitl_emu.missions import registry
from sitl_emu.run import cameras, worlds
from sitl_emu.run.configs import CameraDescription, DepthDescription, Fault, FaultData, LidarDescription, ModelData
from sitl_emu.run.trouble import Trouble
from sitl_emu.vehicles import record
from sitl_emu.vehicles.image_sensor import OV5648, SENSORS, ImageSensor
from sitl_emu.world.conditions import Changes, LightChange, WindChange
from sitl_emu.world.lens import MOUNTS, Distortion, Mount

SUFFIX = ".yaml"
GIMBAL_MOUNT = "gimbal"
"""The one of MOUNTS that turns."""
FARTHEST_M = 10_000.0
LONGEST_RUN_S = 7 * 86400.0


class ScenarioError(Trouble):
    """A scenario that is unknown or wrong; the text is one line for people."""


class Part(BaseModel):
    """What every part of a scenario has in common: unknown fields are errors, and so are numbers without end."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Place(Part):
    """Where a vehicle starts, from the world's origin; the heading is from north over east."""

    north_m: Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
    east_m: Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
    heading_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0


NAME, NUMBERS = "<name>", "<numbers>"


def _name_or_numbers(value: object) -> str:
    return NAME if isinstance(value, str) else NUMBERS


NAME_OR_NUMBERS = Discriminator(_name_or_numbers)
"""Tells which of the two a value is meant as: errors then speak of that one alone."""


class MountPart(Part):
    """Where a camera sits on the vehicle's body, and how far below the horizon it looks, forward."""

    forward_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    right_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    down_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    depression_deg: Annotated[float, Field(ge=-90, le=90)] = 90.0
    on_gimbal: bool = False
    """Its place is the gimbal's head, which says where it looks: `depression_deg` is of no meaning then."""


class DistortionPart(Part):
    """OpenCV's coefficients of a lens."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0


PictureSide = Annotated[int, Field(ge=64, le=4096, multiple_of=8)]


def _sensor(value: Any) -> str | dict[str, Any] | None:
    """An image sensor's name or figures, as they are. Raises ValueError."""
    if isinstance(value, dict):
        record.read(ImageSensor, value, "sensor")
        return value
    if value is None or value in SENSORS:
        return None if value is None else str(value)
    raise ValueError(f"known: {', '.join(SENSORS)}, or a table of what is other than in an {OV5648}")


class CameraPart(Part):
    """A camera of a vehicle. A frame taken at t reaches the companion at t + latency_s.

    What is left out is as in the vehicle's data.
    """

    mount: Annotated[Annotated[str, Tag(NAME)] | Annotated[MountPart, Tag(NUMBERS)], NAME_OR_NUMBERS] | None = None
    resolution: tuple[PictureSide, PictureSide] | None = None
    """Width and height in pixels."""
    hfov_deg: Annotated[float, Field(ge=5, le=150)] | None = None
    """Horizontal field of view, without distortion."""
    distortion: DistortionPart = DistortionPart()
    sensor: Annotated[str | dict[str, Any] | None, PlainValidator(_sensor)] = None
    """A name, or a table of what is other than in an OV5648."""
    rate_hz: Annotated[float, Field(gt=0, le=60)] = 15.0
    latency_s: Annotated[float, Field(ge=0, le=2)] = 0.1


DepthSide = Annotated[int, Field(ge=8, le=1024)]
Elevation = Annotated[float, Field(ge=-90, le=90)]
Metres = Annotated[float, Field(gt=0, le=1000)]
NoiseM = Annotated[float, Field(ge=0, le=10)]


class DepthPart(Part):
    """A depth camera of a vehicle.

    Field of view and reach are those of an Intel RealSense D435 (data sheet: 87 degrees across; 10 m outdoors). The
    noise is ours: a stereo camera's grows with the range, this one's does not.
    """

    mount: Annotated[Annotated[str, Tag(NAME)] | Annotated[MountPart, Tag(NUMBERS)], NAME_OR_NUMBERS] = "nadir"
    resolution: tuple[DepthSide, DepthSide] = (64, 48)
    """Width and height in pixels; each is a ray."""
    hfov_deg: Annotated[float, Field(ge=5, le=150)] = 87.0
    reach_m: Metres = 10.0
    noise_m: NoiseM = 0.02
    """Standard deviation."""
    rate_hz: Annotated[float, Field(gt=0, le=60)] = 5.0
    latency_s: Annotated[float, Field(ge=0, le=2)] = 0.1
    tells_obstacles: bool = True
    """OBSTACLE_DISTANCE to the autopilot, of each image or scan."""


class LidarPart(Part):
    """A scanning lidar of a vehicle.

    Rows, elevations, range and noise are those of a Velodyne VLP-16 (data sheet 63-9229: 16 rows from -15 to 15
    degrees, 100 m, ±3 cm); it has 900 columns at 20 Hz, here are fewer by default.
    """

    mount: MountPart = MountPart(depression_deg=0.0)
    columns: Annotated[int, Field(ge=1, le=2048)] = 180
    """All around; each column of each row is a ray."""
    rows: Annotated[int, Field(ge=1, le=128)] = 16
    elevation_deg: tuple[Elevation, Elevation] = (-15.0, 15.0)
    """Of the first and the last row, above the plane that it spins in."""
    range_m: tuple[Metres, Metres] = (0.5, 100.0)
    """Nearest and farthest."""
    noise_m: NoiseM = 0.03
    """Standard deviation."""
    rate_hz: Annotated[float, Field(gt=0, le=60)] = 5.0
    latency_s: Annotated[float, Field(ge=0, le=2)] = 0.1
    tells_obstacles: bool = True
    """OBSTACLE_DISTANCE to the autopilot, of each image or scan."""

    @field_validator("range_m")
    @classmethod
    def nearest_first(cls, range_m: tuple[float, float]) -> tuple[float, float]:
        """Nearest and farthest, in this order."""
        if range_m[0] >= range_m[1]:
            raise ValueError("the nearest range, then the farthest")
        return range_m


class CompanionPart(Part):
    """A companion computer: one of our missions, or any command.

    In a command the words {connect}, {peer}, {camera}, {calibration}, {depth}, {depth_calibration}, {lidar}, {out},
    {seed} and {python} (the one that runs sitl-emu) are filled in; a word that is a file beside the scenario means
    that file.
    """

    mission: str | None = None
    options: dict[str, Any] = {}
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
    env: dict[str, str | int | float] = {}
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
    sensors: dict[str, Any] = {}
    """Figures of its model's sensors that are other here, named and nested as in `vehicle.toml`."""
    camera: CameraPart | None = None
    depth: DepthPart | None = None
    lidar: LidarPart | None = None
    """A scanning one; the single beam that PX4 flies by is one of its model's sensors."""
    autopilot: AutopilotPart | None = None
    """None: ours."""
    companion: CompanionPart | None = None

    @field_validator("model")
    @classmethod
    def beside_the_file(cls, model: str, info: ValidationInfo) -> str:
        """A model's folder as a whole path, so that it is found from anywhere."""
        folder = info.context["folder"] / model if info.context else Path(model)
        is_own = model not in vehicles.models() and (vehicles.is_folder(folder) or "/" in model)
        return str(folder.resolve()) if is_own else model

    @property
    def model_data(self) -> ModelData:
        """The model with its sensors' figures, for the processes that load it."""
        return ModelData(model=self.model, sensors=self.sensors, camera=self.camera_description)

    @property
    def camera_description(self) -> CameraDescription | None:
        """The camera: the scenario's figures, else those of the vehicle's data."""
        given = self.camera
        if given is None:
            return None
        data = vehicles.load(self.model).camera
        own = cameras.intrinsics_of_data(data)
        width_px, height_px = given.resolution or (own.width, own.height)
        place, on_gimbal = _mount(given.mount or (data.mount if data is not None else "nadir"))
        return CameraDescription(
            width_px=width_px,
            height_px=height_px,
            hfov_deg=own.hfov_deg if given.hfov_deg is None else given.hfov_deg,
            distortion=Distortion(**given.distortion.model_dump()),
            place_m=place[:3],
            depression_deg=place.depression_deg,
            on_gimbal=on_gimbal,
            rate_hz=given.rate_hz,
            latency_s=given.latency_s,
            sensor=cameras.sensor(given.sensor, data),
        )

    @property
    def depth_description(self) -> DepthDescription | None:
        """The depth camera."""
        given = self.depth
        if given is None:
            return None
        place, on_gimbal = _mount(given.mount)
        camera = CameraDescription(
            width_px=given.resolution[0],
            height_px=given.resolution[1],
            hfov_deg=given.hfov_deg,
            distortion=Distortion(),
            place_m=place[:3],
            depression_deg=place.depression_deg,
            on_gimbal=on_gimbal,
            rate_hz=given.rate_hz,
            latency_s=given.latency_s,
        )
        figures = given.model_dump(include={"reach_m", "noise_m", "tells_obstacles"})
        return DepthDescription(camera=camera, **figures)

    @property
    def lidar_description(self) -> LidarDescription | None:
        """The scanning lidar."""
        given = self.lidar
        if given is None:
            return None
        place, _ = _mount(given.mount)
        figures = given.model_dump(exclude={"mount"})
        return LidarDescription(**figures, place_m=place[:3], depression_deg=place.depression_deg)

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


def _mount(mount: str | MountPart) -> tuple[Mount, bool]:
    """Where a camera sits, and whether that is on the gimbal."""
    if isinstance(mount, str):
        return MOUNTS[mount], mount == GIMBAL_MOUNT
    depression_deg = 0.0 if mount.on_gimbal else mount.depression_deg
    return Mount(mount.forward_m, mount.right_m, mount.down_m, depression_deg), mount.on_gimbal


class WindPart(Part):
    """Wind instead of the world's own: where the air moves to, and the standard deviation of gusts, per axis."""

    north_m_s: Annotated[float, Field(ge=-40, le=40)] = 0.0
    east_m_s: Annotated[float, Field(ge=-40, le=40)] = 0.0
    gust_m_s: Annotated[float, Field(ge=0, le=20)] = 0.0


class LightPart(Part):
    """The sun and the exposure; what is left out stays the world's."""

    azimuth_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    """Where the sun stands, from north over east."""
    elevation_deg: Annotated[float, Field(ge=5, le=90)] | None = None
    """Above the horizon."""
    gain: Annotated[float, Field(ge=0.1, le=4)] | None = None
    """Brightness of the picture; 1 exposes it as it should be."""
    warmth: Annotated[float, Field(ge=0.5, le=2)] | None = None
    """Red over blue; above 1 is a low, warm sun."""


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


class WorldPart(Part):
    """A world by its kind, and the options that kind knows; or by its file (`world: my_world.yaml`)."""

    kind: str
    options: dict[str, Any] = {}


class PeerRadio(Part):
    """The radio between the companions."""

    range_m: Annotated[float, Field(gt=0)] = 1000.0
    latency_s: Annotated[float, Field(ge=0, le=10)] = 0.02
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    bandwidth_bit_s: Annotated[float, Field(gt=0)] = 250_000.0
    outages_s: list[tuple[float, float]] = []

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
            self.range_m, self.latency_s, self.loss, self.bandwidth_bit_s, RadioSettings().queue_bytes, outages
        )


class Scenario(Part):
    """One scenario file."""

    format: Literal[1] = 1
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,60}$")]
    description: str = ""
    seed: Annotated[int, Field(ge=0)] = 1
    start_date: datetime = datetime(2026, 6, 15, 9, 0, tzinfo=UTC)
    time_limit_s: Annotated[float, Field(gt=0, le=LONGEST_RUN_S)] = 1800.0
    world: WorldPart
    wind: WindPart | None = None
    light: LightPart | None = None
    vehicles: Annotated[list[VehiclePart], Field(min_length=1, max_length=40)]
    peer_radio: PeerRadio = PeerRadio()
    faults: list[FaultPart] = []

    @model_validator(mode="after")
    def names_differ(self) -> "Scenario":
        """Vehicle names are file names too."""
        names = [vehicle.name for vehicle in self.vehicles]
        if len(set(names)) != len(names):
            raise ValueError(f"vehicle names must differ, these do not: {', '.join(names)}")
        return self

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
        wind = WindChange(**self.wind.model_dump()) if self.wind is not None else None
        light = LightChange(**self.light.model_dump()) if self.light is not None else None
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
    try:
        data = yaml.safe_load(path.read_text())
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict):
        raise ScenarioError(f"{path}: a scenario is a mapping with the fields {', '.join(Scenario.model_fields)}")
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
