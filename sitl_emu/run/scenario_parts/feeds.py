"""What a vehicle sees by: a camera, a depth camera, a scanning lidar, and where each is mounted."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, PlainValidator, Tag, ValidationError, field_validator

from sitl_emu.run import cameras
from sitl_emu.run.configs import CameraDescription, DepthDescription, LidarDescription
from sitl_emu.run.scenario_parts.part import NAME, NAME_OR_NUMBERS, NUMBERS, Part
from sitl_emu.vehicles import record
from sitl_emu.vehicles.description import Camera
from sitl_emu.vehicles.image_sensor import OV5648, SENSORS, ImageSensor
from sitl_emu.world.lens import MOUNTS, Distortion, Mount

GIMBAL_MOUNT = "gimbal"
"""The one of MOUNTS that turns."""


class MountPart(Part):
    """Where a camera sits on the vehicle's body, and how far below the horizon it looks, forward."""

    forward_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    right_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    down_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    depression_deg: Annotated[float, Field(ge=-90, le=90)] = 90.0
    on_gimbal: bool = False
    """Its place is the gimbal's head, which says where it looks: `depression_deg` is of no meaning then."""


def _mount(mount: str | MountPart) -> tuple[Mount, bool]:
    """Where a camera sits, and whether that is on the gimbal."""
    if isinstance(mount, str):
        return MOUNTS[mount], mount == GIMBAL_MOUNT
    depression_deg = 0.0 if mount.on_gimbal else mount.depression_deg
    return Mount(mount.forward_m, mount.right_m, mount.down_m, depression_deg), mount.on_gimbal


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

    def description(self, data: Camera | None) -> CameraDescription:
        """The camera, for the processes that draw by it; `data` is the vehicle's own."""
        own = cameras.intrinsics_of_data(data)
        width_px, height_px = self.resolution or (own.width, own.height)
        place, on_gimbal = _mount(self.mount or (data.mount if data is not None else "nadir"))
        return CameraDescription(
            width_px=width_px,
            height_px=height_px,
            hfov_deg=own.hfov_deg if self.hfov_deg is None else self.hfov_deg,
            distortion=Distortion(**self.distortion.model_dump()),
            place_m=place[:3],
            depression_deg=place.depression_deg,
            on_gimbal=on_gimbal,
            rate_hz=self.rate_hz,
            latency_s=self.latency_s,
            sensor=cameras.sensor(self.sensor, data),
            zoom_max=data.zoom_max if data is not None else 1.0,
        )


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
    """OBSTACLE_DISTANCE to the autopilot, of each image."""

    @property
    def description(self) -> DepthDescription:
        """The depth camera, for its process."""
        place, on_gimbal = _mount(self.mount)
        camera = CameraDescription(
            width_px=self.resolution[0],
            height_px=self.resolution[1],
            hfov_deg=self.hfov_deg,
            distortion=Distortion(),
            place_m=place[:3],
            depression_deg=place.depression_deg,
            on_gimbal=on_gimbal,
            rate_hz=self.rate_hz,
            latency_s=self.latency_s,
        )
        figures = self.model_dump(include={"reach_m", "noise_m", "tells_obstacles"})
        return DepthDescription(camera=camera, **figures)


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
    """OBSTACLE_DISTANCE to the autopilot, of each scan."""

    @field_validator("range_m")
    @classmethod
    def nearest_first(cls, range_m: tuple[float, float]) -> tuple[float, float]:
        """Nearest and farthest, in this order."""
        if range_m[0] >= range_m[1]:
            raise ValueError("the nearest range, then the farthest")
        return range_m

    @property
    def description(self) -> LidarDescription:
        """The lidar, for its process."""
        place, _ = _mount(self.mount)
        figures = self.model_dump(exclude={"mount"})
        return LidarDescription(**figures, place_m=place[:3], depression_deg=place.depression_deg)


def checked(part: type[DepthPart | LidarPart], figures: Mapping[str, Any], where: str) -> dict[str, Any]:
    """A feed's figures from a vehicle's data. Raises ValueError for the first that can't be."""
    try:
        part.model_validate(figures)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(each) for each in first["loc"] if each not in (NAME, NUMBERS))
        raise ValueError(f"{where}.{place}: {first['msg'].removeprefix('Value error, ')}") from None
    return dict(figures)
