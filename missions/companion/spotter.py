"""A vehicle's camera and what it has found: from detections in frames, by the pose of their moment, to targets."""

from collections.abc import Sequence
from typing import NamedTuple

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.gcs.telemetry import Pose, Telemetry
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, Mount, Point, Sweep, camera_pose, gsd_m
from sitl_emu.missions.companion.companion import Candidate
from sitl_emu.missions.companion.confirmation import Confirmation, Target
from sitl_emu.missions.companion.detector import Detection


class Origin(NamedTuple):
    """Where the metres that targets are placed in begin."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float | None
    """None: the vehicle stands on the ground, and heights count from it."""


def position(pose: Pose, origin: Origin) -> Point:
    """Where a vehicle was, in metres NED from an origin."""
    north_m, east_m = to_metres(pose.lat_deg, pose.lon_deg, origin.lat_deg, origin.lon_deg)
    return north_m, east_m, 0.0 if origin.alt_amsl_m is None else origin.alt_amsl_m - pose.alt_amsl_m


def camera_pose_at(telemetry: Telemetry, frame_time_us: int, mount: Mount, origin: Origin) -> CameraPose | None:
    """The camera's pose of a frame; None where it is not known, on a gimbal also where that was not heard."""
    pose, head = telemetry.pose_at(frame_time_us), None
    if pose is not None and mount.on_gimbal:
        head = telemetry.gimbal_at(frame_time_us, pose.yaw_rad)
        if head is None:
            return None
    return None if pose is None else camera_pose(position(pose, origin), pose.q, mount, head)


def camera_sweep_at(
    telemetry: Telemetry, frame_time_us: int, camera: CameraModel, mount: Mount, origin: Origin
) -> Sweep | None:
    """The camera's poses of a frame's first and last row; None where one of them is not known."""
    half_us = round(camera.readout_s / 2.0 * 1e6)
    first = camera_pose_at(telemetry, frame_time_us - half_us, mount, origin)
    last = camera_pose_at(telemetry, frame_time_us + half_us, mount, origin) if half_us else first
    return None if first is None or last is None else Sweep(first, last)


class Spotter:
    """Takes frames' detections; gives targets."""

    def __init__(
        self,
        telemetry: Telemetry,
        camera: CameraModel,
        mount: Mount,
        origin: Origin,
        confirmation: Confirmation,
        look_rate_hz: float = 0.0,
    ) -> None:
        """`confirmation` decides which detections become targets, in metres NED from `origin`.

        `look_rate_hz`: at most so many frames a second are wanted; 0: every one.
        """
        self._telemetry, self._camera, self._mount = telemetry, camera, mount
        self.origin, self.confirmation = origin, confirmation
        self._period_us = round(1e6 / look_rate_hz) if look_rate_hz else 0
        self._due_us = 0

    def wants(self, frame_time_us: int) -> float | None:
        """Metres a pixel of a frame, 0 if that is not known; None if it is not wanted, or the pose then not known."""
        pose = self._camera_pose(frame_time_us)
        if pose is None or (self._period_us and frame_time_us < self._due_us):
            return None
        self._due_us = max(self._due_us + self._period_us, frame_time_us)
        return gsd_m(self._camera, pose, self.confirmation.ground_down_m) or 0.0

    def found(self, frame_time_us: int, detections: Sequence[Detection]) -> list[Target]:
        """The targets that are now to be reported, after another frame's detections (also when there are none)."""
        pose = self._camera_pose(frame_time_us)
        if pose is None:
            return []
        self.confirmation.accuracy_m = (self._telemetry.eph_m, self._telemetry.epv_m)
        return self.confirmation.update(frame_time_us, pose, detections)

    def vehicle_at(self, frame_time_us: int) -> Point | None:
        """Where the vehicle was at a moment, in metres NED."""
        pose = self._telemetry.pose_at(frame_time_us)
        return None if pose is None else position(pose, self.origin)

    def place(self, target: Target) -> tuple[float, float]:
        """Latitude and longitude of a target in degrees."""
        return from_metres(target.north_m, target.east_m, self.origin.lat_deg, self.origin.lon_deg)

    def candidates(self) -> list[Candidate]:
        """What is seen and not reported yet."""
        return [
            Candidate(one.label, one.score, *self.place(one), one.covariance_m2.horizontal_sigma_m, one.sightings)
            for one in self.confirmation.candidates
        ]

    def _camera_pose(self, frame_time_us: int) -> CameraPose | None:
        return camera_pose_at(self._telemetry, frame_time_us, self._mount, self.origin)
