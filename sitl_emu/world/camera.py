"""A camera in the simulated world: a pure function of world seed, time, pose and zoom.

What it is (picture size, field of view, distortion, mount) stands in `lens.py`. A lens with distortion takes its
picture from an undistorted one, as much larger as it sees further, by a map that is worked out once. The picture's top
is forward. The camera follows the body's attitude, or that of the gimbal's head it sits on. The plain sensor adds a
slight blur, vignetting and noise from tiles that are drawn once and chosen by time, and knows neither rolling shutter
nor motion blur. `imaging/` works by a real one's figures (`vehicles/image_sensor.py`).
"""

import math
import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.imaging.motion import Motion, drift
from sitl_emu.world.lens import NADIR, Intrinsics, Mount, source_of, zoomed_source

if TYPE_CHECKING:
    from sitl_emu.world.imaging.imager import Imager

FloatArray = npt.NDArray[np.float64]
Quaternion = tuple[float, float, float, float]
Image = npt.NDArray[np.uint8]
"""(height, width, channels), BGR first."""


class Renderer(Protocol):
    """Draws pictures of one scene with one set of intrinsics."""

    def draw(self, position_ned_m: FloatArray, camera_to_ned: FloatArray, time_s: float, zoom: float = 1.0) -> Image:
        """The picture (height, width, 3), BGR, from a place (3,) with an attitude (3, 3), camera axes to NED.

        Camera axes: x right, y down in the picture, z along the optical axis. `zoom`: times the focal length.
        """
        ...


class Scene(Protocol):
    """What a camera can look at."""

    @property
    def seed(self) -> int:
        """What the sensor's noise is drawn from."""
        ...

    @property
    def moves(self) -> bool:
        """Whether it looks otherwise at another time."""
        ...

    def ground_m(self, north_m: float, east_m: float) -> float:
        """How high the ground is."""
        ...

    def renderer(self, width: int, height: int, focal_px: float) -> Renderer:
        """For pictures of a size in pixels, the focal length being that of both axes."""
        ...


class Pose(NamedTuple):
    """Where a body is (metres NED from the world's origin), and its attitude: quaternion (w, x, y, z), body to NED."""

    north_m: float
    east_m: float
    down_m: float
    q: tuple[float, float, float, float]


class OtherVehicle(NamedTuple):
    """A vehicle that a camera of another one may see."""

    name: str
    vehicle: Vehicle
    pose: Pose
    turning: bool
    """Whether its motors turn."""


@runtime_checkable
class ShowsVehicles(Protocol):
    """A scene that has vehicles in its pictures."""

    def put_vehicles(self, others: Sequence[OtherVehicle]) -> None:
        """Put vehicles where they are; those that were there before and are not named have gone."""
        ...


class Posed(Protocol):
    """Anything that has a pose: `Pose` itself, or the truth a vehicle's simulator gives."""

    @property
    def north_m(self) -> float:
        """North of the world's origin."""

    @property
    def east_m(self) -> float:
        """East of the world's origin."""

    @property
    def down_m(self) -> float:
        """Down from the world's origin."""

    @property
    def q(self) -> tuple[float, float, float, float]:
        """Unit quaternion (w, x, y, z), body to NED."""


def body_to_ned(q: tuple[float, float, float, float]) -> FloatArray:
    """Rotation matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


def camera_to_body(mount: Mount) -> FloatArray:
    """Rotation matrix (3, 3) from camera axes (right, down, forward in the picture) to body axes FRD."""
    s, c = math.sin(math.radians(mount.depression_deg)), math.cos(math.radians(mount.depression_deg))
    return np.array(((0.0, -s, c), (1.0, 0.0, 0.0), (0.0, c, s)))


STILL = Motion()


class Camera:
    """One camera on one vehicle. `name` gives it a noise of its own. Raises LensError for a lens that can't be.

    `sensor`: None for the plain one. `seed`: of the noise, a run's; None: that which the scene is painted by.
    """

    def __init__(
        self,
        scene: Scene,
        mount: Mount = NADIR,
        intrinsics: Intrinsics | None = None,
        name: str = "camera",
        sensor: ImageSensor | None = None,
        seed: int | None = None,
    ) -> None:
        self.mount = mount
        self.intrinsics = intrinsics if intrinsics is not None else Intrinsics()
        # One thread: a run has a camera process per camera, and cores to share.
        cv2.setNumThreads(1)
        noise_seed = scene.seed if seed is None else seed
        self._sensor: Imager | Plain
        if sensor is not None:
            from sitl_emu.world.imaging import imager  # numba, for whoever asks for it

            self._sensor = imager.Imager(self.intrinsics, sensor, noise_seed, name)
        else:
            self._sensor = Plain(self.intrinsics, noise_seed, name)
        width, height = self._sensor.source
        self._renderer = scene.renderer(width, height, self.intrinsics.focal_px)
        self._to_body = camera_to_body(mount)
        self._lever = np.array(mount[:3])
        self._scene = scene
        self._seen_from: tuple[Pose, Quaternion, int, float] | None = None
        self._seen: Image | None = None

    def render(
        self,
        pose: Posed,
        time_us: int,
        head: Quaternion | None = None,
        motion: Motion = STILL,
        zoom: float = 1.0,
    ) -> Image:
        """The picture taken at a time from a body's pose: (height, width, 3) uint8 BGR.

        `head`: attitude (to NED) of the gimbal's head that carries the camera; None: it is fixed to the body. `motion`:
        of the body, which the plain sensor does not heed. `zoom`: so many times the focal length; the distortion's
        coefficients and the vignetting stay.
        """
        place = Pose(pose.north_m, pose.east_m, pose.down_m, pose.q)
        seen = self._drawn(place, pose.q if head is None else head, time_us, zoom)
        if isinstance(self._sensor, Plain):
            return self._sensor.picture(seen, time_us)
        to_ned = body_to_ned(place.q)
        head_to_ned = body_to_ned(head) if head is not None else None
        camera_to_ned = (to_ned if head_to_ned is None else head_to_ned) @ self._to_body
        north_m, east_m, down_m = (float(each) for each in self._place(place))
        height_m = -down_m - self._scene.ground_m(north_m, east_m)
        moving = drift(motion, to_ned, head_to_ned, camera_to_ned, self._lever, height_m)
        return self._sensor.picture(seen, moving, time_us, zoom)

    def _place(self, pose: Pose) -> FloatArray:
        place: FloatArray = np.array((pose.north_m, pose.east_m, pose.down_m)) + body_to_ned(pose.q) @ self._lever
        return place

    def _drawn(self, pose: Pose, head: Quaternion, time_us: int, zoom: float) -> Image:
        """What is before the sensor. A vehicle that stands still before what stands still sees it again."""
        seen_from = (pose, head, time_us if self._scene.moves else 0, zoom)
        if self._seen is None or seen_from != self._seen_from:
            place, turn, focal = self._place(pose), body_to_ned(head) @ self._to_body, self._sensor.focal(zoom)
            drawn = self._renderer.draw(place, turn, time_us * 1e-6, focal)
            self._seen = self._sensor.through_lens(drawn, zoom) if isinstance(self._sensor, Plain) else drawn
            self._seen_from = seen_from
        return self._seen


class Plain:
    """The plain sensor of one camera: lens, a slight blur, vignetting, and noise from tiles. Raises LensError."""

    def __init__(self, intrinsics: Intrinsics, seed: int, name: str) -> None:
        width, height = intrinsics.width, intrinsics.height
        self._intrinsics = intrinsics
        self._lens = source_of(intrinsics) if any(intrinsics.distortion) else None
        self.source = (width, height) if self._lens is None else (self._lens.width, self._lens.height)
        """(width, height) of the picture to be drawn for it."""
        self._noise_seed = [seed, zlib.crc32(name.encode())]
        rng = np.random.Generator(np.random.PCG64(self._noise_seed))
        # One tile larger than the picture by a margin: a frame takes its window at an offset drawn from its time.
        shape = (height + 64, width + 64, 3)
        grains = rng.normal(scale=3.0, size=shape)
        self._noise = np.clip(np.round(grains + 16.0), 0, 32).astype(np.uint8)
        y, x = np.mgrid[0:height, 0:width]
        off_axis = np.hypot(x - (width - 1) / 2, y - (height - 1) / 2) / intrinsics.focal_px
        # A quarter of the cosine-fourth law: a lens of this angle is built to soften it.
        falloff = (1.0 + off_axis**2) ** -0.45
        self._vignette = np.repeat(np.round(255.0 * falloff).astype(np.uint8)[..., None], 3, axis=2)

    def focal(self, zoom: float) -> float:
        """That of the picture to be drawn for it, over the camera's own at no zoom."""
        if self._lens is None or zoom == 1.0:
            return zoom
        return zoomed_source(self._intrinsics, zoom, self.source)[0]

    def through_lens(self, drawn: Image, zoom: float = 1.0) -> Image:
        """What the lens throws on the sensor of a picture of `source` size."""
        if (lens := self._lens) is not None:
            lens = lens if zoom == 1.0 else zoomed_source(self._intrinsics, zoom, self.source)[1]
            drawn = np.asarray(cv2.remap(drawn, lens.map_x, lens.map_y, cv2.INTER_LINEAR), np.uint8)
        blurred = cv2.GaussianBlur(drawn, (3, 3), 0.6)
        return np.asarray(cv2.multiply(blurred, self._vignette, scale=1.0 / 255.0), np.uint8)

    def picture(self, seen: Image, time_us: int) -> Image:
        """What the sensor sends of that at a time."""
        mixed = zlib.crc32(time_us.to_bytes(8, "little"), self._noise_seed[1])
        top, left = mixed % 64, (mixed >> 8) % 64
        height, width = seen.shape[:2]
        noise = self._noise[top : top + height, left : left + width]
        return np.asarray(cv2.addWeighted(seen, 1.0, noise, 1.0, -16.0), np.uint8)
