"""What each process of a run is told at its start: one record per kind of process, JSON on its standard input.

The launcher fills them in, `written` and `read` are the two sides of the border. File descriptors are those of sockets
that the process inherits. What users write freely, a world's and a mission's options, stays the mapping that it is.
"""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from sitl_emu.core.radio import RadioSettings
from sitl_emu.vehicles import record
from sitl_emu.vehicles.image_sensor import ImageSensor

ROOTFS = "rootfs"
"""In the run's folder: the file systems of its autopilots, a folder each, named as the vehicle."""
Config = TypeVar("Config", bound="ProcessConfig")


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessConfig:
    """What every process of a run knows."""

    folder: str
    """The run's folder."""
    start_us: int
    """Microseconds since 1970 at which simulated time begins."""
    seed: int
    name: str = ""
    """The vehicle's; empty where a process belongs to none."""

    @property
    def fds(self) -> list[int]:
        """What the process inherits beside its control channel."""
        return []


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDescription:
    """A vehicle's rendered camera; `cameras.py` says how it follows from data and scenario, and who reads it."""

    width_px: int
    height_px: int
    hfov_deg: float
    """Horizontal field of view, without distortion."""
    distortion: tuple[float, float, float, float, float]
    """OpenCV's k1, k2, p1, p2, k3."""
    place_m: tuple[float, float, float]
    """Forward, right and down from the body's origin."""
    depression_deg: float
    """How far below the horizon it looks, forward; of no meaning on a gimbal."""
    on_gimbal: bool = False
    rate_hz: float
    latency_s: float
    """How long a frame is under way to the companion."""
    sensor: ImageSensor | None = None
    """None: the plain one."""
    zoom_max: float = 1.0
    """Focal length at full zoom over that at none, which `hfov_deg` is of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthDescription:
    """A vehicle's depth camera."""

    camera: CameraDescription
    """Its picture, lens, place and rate."""
    reach_m: float
    noise_m: float
    """Standard deviation."""
    tells_obstacles: bool
    """By OBSTACLE_DISTANCE, to the autopilot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarDescription:
    """A vehicle's scanning lidar."""

    columns: int
    rows: int
    elevation_deg: tuple[float, float]
    """Of the first and the last row, above the plane that it spins in."""
    range_m: tuple[float, float]
    """Nearest and farthest."""
    noise_m: float
    """Standard deviation."""
    place_m: tuple[float, float, float]
    """Forward, right and down from the body's origin."""
    depression_deg: float
    """How far its plane is tilted down, forward."""
    rate_hz: float
    latency_s: float
    """How long a scan is under way to the companion."""
    tells_obstacles: bool
    """By OBSTACLE_DISTANCE, to the autopilot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelData:
    """Which vehicle it is, and what of its sensors and its camera is other than its data say."""

    model: str
    """One of ours, or the path of a folder."""
    sensors: Mapping[str, Any] = field(default_factory=dict)
    camera: CameraDescription | None = None
    parcel: Mapping[str, Any] | None = None
    """What of the parcel on its release is other than its data say; None: it carries none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StartPlace:
    """Where a vehicle starts, in metres from the world's origin; the heading is from north over east."""

    north_m: float
    east_m: float
    heading_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedData:
    """A feed of a vehicle's as the world process knows it."""

    feed: str
    """"camera", "depth" or "lidar"."""
    on_gimbal: bool = False
    fd: int
    rate_hz: float
    latency_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkEnd:
    """One end of a link in an isolated run: an inherited UDP socket on a free port, and the port of the other end."""

    fd: int
    other_port: int


@dataclass(frozen=True, slots=True, kw_only=True)
class IsolatedLinks:
    """Ends of a vehicle's links in an isolated run, those of one process; None where nobody is at the other end."""

    companion: LinkEnd | None = None
    """The onboard link, between autopilot and companion."""
    sensors: LinkEnd | None = None
    """The payload link, between autopilot and what tells it of obstacles."""

    @property
    def fds(self) -> list[int]:
        """What the process inherits."""
        return [end.fd for end in (self.companion, self.sensors) if end is not None]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleData:
    """A vehicle as the world process knows it, and the sockets to its processes."""

    name: str
    model: ModelData
    instance: int
    lockstep: bool
    """Whether its autopilot takes part in barriers."""
    start: str | StartPlace
    """The name of a place of the world, or numbers."""
    autopilot_fd: int | None
    """None for an autopilot from outside."""
    components: bool = False
    """Whether camera and gimbal speak to an autopilot from outside."""
    companion_fd: int | None = None
    radio_fd: int | None = None
    feeds: tuple[FeedData, ...] = ()
    tells_obstacles: bool = False
    """Whether one of its feeds does, to the autopilot."""
    video: bool = False
    """Whether what its camera sees is sent to the ground station."""
    isolated: IsolatedLinks | None = None
    """The sensors' end of the payload link; None: on PX4's ports."""

    @property
    def fds(self) -> list[int]:
        """All that the world process inherits for this vehicle."""
        links = self.isolated.fds if self.isolated is not None else []
        fds = (self.autopilot_fd, self.companion_fd, self.radio_fd, *(feed.fd for feed in self.feeds), *links)
        return [fd for fd in fds if fd is not None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What fails: exactly one of these is given."""

    motor: int | None = None
    """This motor stops; the first is 1."""
    sensor: str | None = None
    """gps, baro, mag or lidar falls silent."""
    gps_satellites: int | None = None
    gps_offset_m: tuple[float, float, float] | None = None
    """North, east and down of where the vehicle is."""
    battery_charge: float | None = None
    """0 to 1."""
    battery_drain_w: float | None = None
    """Beside what the vehicle takes."""
    radio: str | None = None
    """"out": none of its companion's datagrams come or go."""
    kill: str | None = None
    """autopilot or companion: the process gets SIGKILL."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultData:
    """A fault on the timeline: at a time, or so long after an event."""

    vehicle: str
    fault: Fault
    at_us: int | None = None
    for_us: int | None = None
    """How long it lasts; None: for ever."""
    event: str = ""
    event_vehicle: str = ""
    event_text: str = ""
    """What the event's text must contain."""
    after_us: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldConfig(ProcessConfig):
    """For the world process."""

    world: str
    """The world's file, in the run's folder."""
    vehicles: tuple[VehicleData, ...]
    radio: RadioSettings
    speed: float | None
    """Times real time; None: as fast as it goes."""
    time_limit_s: float
    commands: tuple[str, ...]
    """Vehicles whose companion is a command that the run waits for."""
    faults: tuple[FaultData, ...] = ()
    ros_fd: int | None = None
    """To who tells ROS 2 of clock, sensors and frames; None: nobody does."""

    @property
    def fds(self) -> list[int]:
        """See ProcessConfig."""
        fds = [fd for vehicle in self.vehicles for fd in vehicle.fds]
        return fds if self.ros_fd is None else [*fds, self.ros_fd]


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotConfig(ProcessConfig):
    """For the process of an autopilot of ours."""

    model: ModelData
    instance: int
    lockstep: bool
    gcs: tuple[str, int] | None
    """Host and port of the ground station; None: on this machine."""
    tells_obstacles: bool = False
    """Whether it is told of obstacles, on its payload link."""
    video: bool = False
    """Whether what its camera sees is sent to the ground station."""
    dds: bool = False
    """Whether it speaks to ROS 2."""
    isolated: IsolatedLinks | None = None
    """The autopilot's ends; None: on PX4's ports."""

    @property
    def fds(self) -> list[int]:
        """See ProcessConfig."""
        return self.isolated.fds if self.isolated is not None else []


@dataclass(frozen=True, slots=True, kw_only=True)
class RingData:
    """The shared memory that a feed goes to."""

    name: str
    slots: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoData:
    """Where a camera's video goes: who hears it, on UDP."""

    host: str
    port: int
    bit_rate: int
    """Bit/s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraConfig(ProcessConfig):
    """For the process of a camera."""

    world: str
    """The world's file, in the run's folder."""
    camera: CameraDescription
    ring: RingData | None
    """None: nobody reads its frames."""
    card: str = ""
    """The folder that stands for the autopilot's file system, in which its pictures are kept."""
    shared_fd: int | None = None
    """Memory for what the cameras of a run can share: a memfd that all inherit."""
    video: VideoData | None = None
    """Where its video goes, once it is told to send any; None: it sends none."""

    @property
    def fds(self) -> list[int]:
        """See ProcessConfig."""
        return [self.shared_fd] if self.shared_fd is not None else []


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeConfig(ProcessConfig):
    """For the process of a depth camera or of a scanning lidar: one of the two."""

    world: str
    """The world's file, in the run's folder."""
    ring: RingData
    depth: DepthDescription | None = None
    lidar: LidarDescription | None = None

    @property
    def tells_obstacles(self) -> bool:
        """Whether the autopilot is told of obstacles."""
        described = self.depth or self.lidar
        return described is not None and described.tells_obstacles

    @property
    def rate_hz(self) -> float:
        """Of its frames."""
        if self.depth is not None:
            return self.depth.camera.rate_hz
        assert self.lidar is not None, "one of the two is described"
        return self.lidar.rate_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class RosVehicleData:
    """A vehicle as ROS 2 is told of it."""

    name: str
    instance: int
    range_finder: bool
    camera: CameraDescription | None = None
    depth: DepthDescription | None = None
    lidar: LidarDescription | None = None
    rings: Mapping[str, Any]
    """Names of its feeds' shared memory, by feed."""

    @property
    def on_gimbal(self) -> bool:
        """Whether its gimbal carries a feed."""
        cameras = (self.camera, self.depth.camera if self.depth is not None else None)
        return any(camera is not None and camera.on_gimbal for camera in cameras)


@dataclass(frozen=True, slots=True, kw_only=True)
class RosConfig(ProcessConfig):
    """For the process that tells ROS 2 of clock, sensors and frames."""

    vehicles: tuple[RosVehicleData, ...]
    tells_clock: bool = True
    """Whether /clock is its to tell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CompanionConfig(ProcessConfig):
    """For the process of a companion of ours."""

    instance: int
    lockstep: bool
    """Whether it is told how many datagrams its autopilot has sent: not by one from outside."""
    mission: str
    options: Mapping[str, Any]
    radio_port: int | None
    """The radio's UDP port for this companion; None where it has no peer."""
    rings: Mapping[str, Any]
    """Names of its feeds' shared memory, by feed."""
    inference_latency_us: int
    isolated: IsolatedLinks | None = None
    """The companion's end; None: on PX4's ports."""

    @property
    def fds(self) -> list[int]:
        """See ProcessConfig."""
        return self.isolated.fds if self.isolated is not None else []


def written(config: ProcessConfig) -> str:
    """A record as JSON."""
    return json.dumps(dataclasses.asdict(config))


def read(config: type[Config], text: str) -> Config:
    """The record that `written` wrote. Raises VehicleError where the text is of another kind."""
    return record.read(config, json.loads(text), config.__name__)
