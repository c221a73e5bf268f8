"""A vehicle's sensors to ROS 2: which topics there are, and what becomes of what is told of it.

Topics lie in its namespace, as PX4's do: `camera/…` and `depth_camera/…` are named as image_transport and
image_pipeline name them; `lidar/points`, `lidar/scan` and `range` are ours.
"""

from collections import deque
from typing import NamedTuple

from cyclonedds.domain import DomainParticipant

from sitl_emu.core.frame_ring import RingReader, Sample
from sitl_emu.run import cameras
from sitl_emu.run.configs import CameraDescription, DepthDescription, LidarDescription, RosVehicleData
from sitl_emu.run.dds_socket import namespace
from sitl_emu.run.messages import FrameTaken, VehicleSeen
from sitl_emu.run.ros import frames, sensors
from sitl_emu.run.ros.frames import Transform
from sitl_emu.run.ros.publisher import Publisher

ZOOMS_KEPT = 256
"""Barriers (20 ms) for which it is known how far the camera had zoomed: longer than any frame is under way."""


class Topics:
    """Publishers in a vehicle's namespace."""

    def __init__(self, participant: DomainParticipant, instance: int) -> None:
        self._participant, self._within = participant, namespace(instance)

    def publisher(self, topic: str, message: str) -> Publisher:
        """Of a topic in the namespace."""
        return Publisher(self._participant, f"{self._within}/{topic}" if self._within else topic, message)


class Zoomed(NamedTuple):
    """How far a camera has zoomed."""

    time_us: int
    percent: float


class Camera:
    """A camera's frames: raw, compressed, and what its lens is."""

    def __init__(self, topics: Topics, vehicle: str, camera: CameraDescription) -> None:
        self._camera, self._frame = camera, frames.name(vehicle, "camera_optical_frame")
        self._raw = topics.publisher("camera/image_raw", "sensor_msgs/Image")
        self._compressed = topics.publisher("camera/image_raw/compressed", "sensor_msgs/CompressedImage")
        self._info = topics.publisher("camera/camera_info", "sensor_msgs/CameraInfo")
        self._zooms = deque([Zoomed(0, 0.0)], ZOOMS_KEPT)

    def zoomed(self, now_us: int, percent: float) -> None:
        """How far it has zoomed now."""
        self._zooms.append(Zoomed(now_us, percent))

    def publish(self, time_us: int, sample: Sample) -> None:
        """A frame; `time_us`: when it was taken, since 1970."""
        percent = next((each.percent for each in reversed(self._zooms) if each.time_us <= sample.time_us), 0.0)
        seen = cameras.intrinsics(self._camera).zoomed(cameras.zoom(self._camera, percent))
        if self._info.is_heard:
            self._info.publish(sensors.camera_info(time_us, self._frame, seen))
        if self._raw.is_heard:
            self._raw.publish(sensors.image(time_us, self._frame, sample.data, "bgr8"))
        if self._compressed.is_heard:
            self._compressed.publish(sensors.compressed_image(time_us, self._frame, sample.data))


class DepthCamera:
    """A depth camera's frames: as a picture, as points, and what its lens is."""

    def __init__(self, topics: Topics, vehicle: str, depth: DepthDescription) -> None:
        self._seen, self._frame = cameras.intrinsics(depth.camera), frames.name(vehicle, "depth_camera_optical_frame")
        self._raw = topics.publisher("depth_camera/image_raw", "sensor_msgs/Image")
        self._points = topics.publisher("depth_camera/points", "sensor_msgs/PointCloud2")
        self._info = topics.publisher("depth_camera/camera_info", "sensor_msgs/CameraInfo")

    def publish(self, time_us: int, sample: Sample) -> None:
        """A frame."""
        if self._info.is_heard:
            self._info.publish(sensors.camera_info(time_us, self._frame, self._seen))
        if self._raw.is_heard:
            self._raw.publish(sensors.image(time_us, self._frame, sample.data, "32FC1"))
        if self._points.is_heard:
            points = sensors.depth_points(sample.data, self._seen)
            self._points.publish(sensors.cloud(time_us, self._frame, points))


class Lidar:
    """A scanning lidar's scans: as points, and as a scan where it sees a plane."""

    def __init__(self, topics: Topics, vehicle: str, lidar: LidarDescription) -> None:
        self._lidar, self._frame = lidar, frames.name(vehicle, "lidar_link")
        self._points = topics.publisher("lidar/points", "sensor_msgs/PointCloud2")
        plane = sensors.is_plane(lidar)
        self._scan = topics.publisher("lidar/scan", "sensor_msgs/LaserScan") if plane else None

    def publish(self, time_us: int, sample: Sample) -> None:
        """A scan."""
        points = sensors.in_lidar(sample.data, self._lidar)
        if self._points.is_heard:
            self._points.publish(sensors.cloud(time_us, self._frame, points))
        if self._scan is not None and self._scan.is_heard:
            self._scan.publish(sensors.scan(time_us, self._frame, points, self._lidar))


class RosVehicle:
    """One vehicle."""

    def __init__(self, participant: DomainParticipant, data: RosVehicleData, start_us: int) -> None:
        """`start_us`: the date of the run's time 0."""
        self._data, self._start_us = data, start_us
        topics = Topics(participant, data.instance)
        self._camera = Camera(topics, data.name, data.camera) if data.camera is not None else None
        self._range = topics.publisher("range", "sensor_msgs/Range") if data.range_finder else None
        self._feeds: dict[str, Camera | DepthCamera | Lidar] = {}
        if self._camera is not None:
            self._feeds["camera"] = self._camera
        if data.depth is not None:
            self._feeds["depth"] = DepthCamera(topics, data.name, data.depth)
        if data.lidar is not None:
            self._feeds["lidar"] = Lidar(topics, data.name, data.lidar)
        self._rings: dict[str, RingReader] = {}
        """By feed, from its first frame on: a launch flies on while its cameras are set up."""

    def static_transforms(self) -> list[Transform]:
        """Where its sensors are, those apart that a gimbal carries."""
        name, found = self._data.name, list[Transform]()
        for link, camera in self._cameras():
            if not camera.on_gimbal:
                found.append(frames.fixed(name, f"{link}_link", camera.place_m, camera.depression_deg))
            found.append(frames.optical(name, link))
        if self._data.lidar is not None:
            found.append(frames.fixed(name, "lidar_link", self._data.lidar.place_m, self._data.lidar.depression_deg))
        if self._data.range_finder:
            found.append(frames.fixed(name, "range_link", (0.0, 0.0, 0.0), 90.0))
        return found

    def transforms(self, seen: VehicleSeen) -> list[Transform]:
        """Where it is, and where a gimbal's head looks."""
        name, found = self._data.name, [frames.base_link(self._data.name, seen.pose)]
        for link, camera in self._cameras():
            if camera.on_gimbal and seen.head is not None:
                mount = camera.place_m, camera.depression_deg
                found.append(frames.on_gimbal(name, f"{link}_link", *mount, seen.pose, seen.head))
        return found

    def publish(self, now_us: int, seen: VehicleSeen) -> None:
        """What is told of it at a barrier. Raises RingError where the memory of a frame can't be found."""
        if self._camera is not None:
            self._camera.zoomed(now_us, seen.zoom_percent)
        if seen.distance is not None and self._range is not None and self._range.is_heard:
            time_us = self._start_us + seen.distance.time_us
            self._range.publish(sensors.range_(time_us, frames.name(self._data.name, "range_link"), seen.distance))
        for frame in seen.frames:
            self._publish_frame(frame)

    def _publish_frame(self, frame: FrameTaken) -> None:
        """From its feed's memory, unless it was overwritten there meanwhile; with the time that is told of it."""
        ring = self._rings.get(frame.feed)
        if ring is None:
            ring = self._rings[frame.feed] = RingReader(self._data.rings[frame.feed])
        sample = ring.at(frame.index)
        if sample is not None:
            self._feeds[frame.feed].publish(self._start_us + frame.time_us, sample._replace(time_us=frame.time_us))

    def _cameras(self) -> list[tuple[str, CameraDescription]]:
        depth = self._data.depth.camera if self._data.depth is not None else None
        both = (("camera", self._data.camera), ("depth_camera", depth))
        return [(link, camera) for link, camera in both if camera is not None]
