"""A vehicle's sensors over DDS: another participant, with the QoS of a node, hears what lies in the feeds' memory."""

import functools
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from sitl_emu.core.frame_ring import Encoding, Format, Kind, RingWriter
from sitl_emu.core.simulator_api import CameraZoom, DistanceSensor, GimbalState
from sitl_emu.run.conductor import VehicleInRun
from sitl_emu.run.configs import CameraDescription, DepthDescription, LidarDescription, RosVehicleData
from sitl_emu.run.feed_in_run import FeedInRun
from sitl_emu.run.messages import BodyPose, FrameTaken, Message, RangeSeen, Seen, VehicleSeen, decoded, encoded
from sitl_emu.run.ros.seen import SeenByRos, range_seen
from tests import dds

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sitl_emu.run.ros.publisher import TF_STATIC, Publisher, described
from sitl_emu.run.ros.vehicle import RosVehicle

DOMAIN = 120 + os.getpid() % 80
LIMIT_S = 10.0
until = functools.partial(dds.until, limit_s=LIMIT_S)
START_US = 1_700_000_000_000_000
SENSOR_DATA = Qos(
    Policy.Reliability.BestEffort,
    Policy.Durability.Volatile,
    Policy.History.KeepLast(5),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
"""rmw_qos_profile_sensor_data."""
CAMERA = CameraDescription(
    width_px=64,
    height_px=48,
    hfov_deg=90.0,
    distortion=(0.0,) * 5,
    place_m=(0.0, 0.0, 0.15),
    depression_deg=0.0,
    on_gimbal=True,
    rate_hz=10.0,
    latency_s=0.1,
    zoom_max=2.0,
)
LIDAR = LidarDescription(
    columns=36,
    rows=1,
    elevation_deg=(0.0, 0.0),
    range_m=(0.1, 20.0),
    noise_m=0.0,
    place_m=(0.0, 0.0, 0.0),
    depression_deg=0.0,
    rate_hz=10.0,
    latency_s=0.0,
    tells_obstacles=False,
)
LEVEL = (1.0, 0.0, 0.0, 0.0)


class Node:
    """Who hears topics of a vehicle."""

    def __init__(self) -> None:
        self._participant = DomainParticipant(DOMAIN)

    def hear(self, topic: str, message: str, qos: Qos = SENSOR_DATA) -> Callable[[], Any]:
        """Waits for the next message of a topic."""
        kind = described(message)
        reader = DataReader(self._participant, Topic(self._participant, f"rt/{topic}", kind), qos=qos)
        until(reader.get_matched_publications)

        def next_one() -> Any:
            found = list[Any]()

            def take() -> bool:
                found.extend(reader.take(1))
                return bool(found)

            until(take)
            return found[0]

        return next_one


@pytest.fixture
def rings() -> Iterator[dict[str, RingWriter]]:
    formats = {
        "camera": Format(Kind.IMAGE, Encoding.BGR8, 48, 64),
        "depth": Format(Kind.DEPTH, Encoding.M32, 48, 64),
        "lidar": Format(Kind.POINTS, Encoding.XYZ32, 36),
    }
    made = {feed: RingWriter(f"sitl_emu-test-{os.getpid()}-{feed}", what) for feed, what in formats.items()}
    yield made
    for ring in made.values():
        ring.close()


@pytest.fixture
def vehicle(rings: dict[str, RingWriter], monkeypatch: pytest.MonkeyPatch) -> RosVehicle:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    depth = DepthDescription(camera=CAMERA, reach_m=10.0, noise_m=0.0, tells_obstacles=False)
    names = {feed: ring.name for feed, ring in rings.items()}
    data = RosVehicleData(
        name="uas", instance=2, range_finder=True, camera=CAMERA, depth=depth, lidar=LIDAR, rings=names
    )
    return RosVehicle(DomainParticipant(DOMAIN), data, START_US)


def seen(*taken: FrameTaken, zoom: float = 0.0, distance: RangeSeen | None = None) -> VehicleSeen:
    return VehicleSeen(BodyPose(1.0, 2.0, -3.0, LEVEL), LEVEL, zoom, distance, taken)


def nanoseconds(header: Any) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def test_a_camera_s_frame_is_heard_raw_and_compressed_with_its_lens(
    vehicle: RosVehicle, rings: dict[str, RingWriter]
) -> None:
    node = Node()
    raw = node.hear("px4_2/camera/image_raw", "sensor_msgs/Image")
    compressed = node.hear("px4_2/camera/image_raw/compressed", "sensor_msgs/CompressedImage")
    info = node.hear("px4_2/camera/camera_info", "sensor_msgs/CameraInfo")
    picture = np.random.default_rng(1).integers(0, 255, (48, 64, 3), np.uint8)
    rings["camera"].write(100_000, picture)
    vehicle.publish(100_000, seen(zoom=100.0))
    vehicle.publish(200_000, seen(FrameTaken("camera", 0, 100_000), zoom=0.0))
    told = raw()
    assert bytes(told.data) == picture.tobytes()
    assert (told.header.frame_id, told.encoding) == ("uas/camera_optical_frame", "bgr8")
    assert nanoseconds(told.header) == (START_US + 100_000) * 1000
    assert bytes(compressed().data[:2]) == b"\xff\xd8"
    lens = info()
    assert nanoseconds(lens.header) == nanoseconds(told.header)
    assert lens.k[0] == pytest.approx(2.0 * 32.0)  # it had zoomed when the frame was taken


def test_depth_scans_and_ranges_are_heard(vehicle: RosVehicle, rings: dict[str, RingWriter]) -> None:
    node = Node()
    depth = node.hear("px4_2/depth_camera/image_raw", "sensor_msgs/Image")
    depth_points = node.hear("px4_2/depth_camera/points", "sensor_msgs/PointCloud2")
    points = node.hear("px4_2/lidar/points", "sensor_msgs/PointCloud2")
    scan = node.hear("px4_2/lidar/scan", "sensor_msgs/LaserScan")
    height = node.hear("px4_2/range", "sensor_msgs/Range")
    rings["depth"].write(0, np.full((48, 64), 2.5, np.float32))
    rings["lidar"].write(0, np.array(((5.0, 0.0, 0.0), (0.0, 3.0, 0.0)), np.float32))
    distance = RangeSeen(60_000, 12.34, 0.1, 40.0, 0.0, 4e-4)
    vehicle.publish(100_000, seen(FrameTaken("depth", 0, 0), FrameTaken("lidar", 0, 0), distance=distance))
    told = depth()
    assert told.encoding == "32FC1" and set(np.frombuffer(bytes(told.data), "<f4")) == {2.5}
    assert (depth_points().width, points().width) == (64, 2)
    ranges = scan().ranges
    assert {place: value for place, value in enumerate(ranges) if np.isfinite(value)} == {0: 5.0, 27: 3.0}
    told = height()
    assert told.range == pytest.approx(12.34)
    assert nanoseconds(told.header) == (START_US + 60_000) * 1000


def test_a_frame_that_was_overwritten_is_left_out(vehicle: RosVehicle, rings: dict[str, RingWriter]) -> None:
    info = Node().hear("px4_2/camera/camera_info", "sensor_msgs/CameraInfo")
    for number in range(9):
        rings["camera"].write(number * 100_000, np.zeros((48, 64, 3), np.uint8))
    vehicle.publish(800_000, seen(FrameTaken("camera", 0, 0), FrameTaken("camera", 1, 100_000)))
    assert nanoseconds(info().header) == (START_US + 100_000) * 1000


def test_frames_of_a_vehicle_hang_together(vehicle: RosVehicle) -> None:
    static, moving = vehicle.static_transforms(), vehicle.transforms(seen())
    parents = {each.child: each.parent for each in (*static, *moving)}
    assert len(parents) == len(static) + len(moving)
    for frame in ("camera_optical_frame", "depth_camera_optical_frame", "lidar_link", "range_link"):
        place, steps = f"uas/{frame}", 0
        while place != "map":
            place, steps = parents[place], steps + 1
        assert steps in (2, 3)
    assert {each.child for each in moving} == {"uas/base_link", "uas/camera_link", "uas/depth_camera_link"}


def test_who_comes_late_hears_of_what_never_moves(vehicle: RosVehicle) -> None:
    publisher = Publisher(DomainParticipant(DOMAIN), "tf_static", "tf2_msgs/TFMessage", TF_STATIC)
    publisher.publish({"transforms": []})
    assert not publisher.is_heard
    hear = Node().hear("tf_static", "tf2_msgs/TFMessage", TF_STATIC)
    assert hear().transforms == []
    assert publisher.is_heard


class Channel:
    """Takes what is offered, as if it had passed a socket."""

    def __init__(self) -> None:
        self.offered: list[Message] = []

    def offer(self, message: Message) -> bool:
        """See `ros.seen.Channel`."""
        self.offered.append(decoded(encoded(message)))
        return True


class Simulator:
    """One that stands still."""

    def pose(self) -> Any:
        """Level, at the origin."""
        return self

    north_m = east_m = down_m = 0.0
    q = LEVEL


def test_a_range_that_was_not_measured_is_infinite() -> None:
    told = DistanceSensor(60, 10, 4000, 4001, 0, 0, 25, 4, 0.0, 0.0, LEVEL, 100)
    assert range_seen(told) == RangeSeen(60_000, np.inf, 0.1, 40.0, 0.0, 4e-4)


def test_what_is_told_at_a_barrier_is_what_is_so_then() -> None:
    channel: Any = Channel()
    feed = FeedInRun("camera", channel, 10.0, 100_000, on_gimbal=True)
    unused: Any = None
    first = VehicleInRun("uas", Simulator(), unused, feeds=[feed], zoom=CameraZoom(40.0))
    first.gimbal = GimbalState((0.0, 1.0, 0.0, 0.0))
    second = VehicleInRun("ugv", Simulator(), unused)
    distance = DistanceSensor(60, 10, 4000, 1234, 0, 0, 25, 4, 0.0, 0.0, LEVEL, 100)
    onlooker = SeenByRos(channel)
    onlooker.sensed([[], [distance]])
    onlooker.sensed([[], []])
    frame = FrameTaken("camera", 3, 10_000)
    onlooker.barrier(20_000, [first, second], [(frame,), ()])
    onlooker.barrier(40_000, [first, second], [(), ()])
    here = BodyPose(0.0, 0.0, 0.0, LEVEL)
    looking = VehicleSeen(here, (0.0, 1.0, 0.0, 0.0), 40.0, None, (frame,))
    standing = VehicleSeen(here, None, 0.0, RangeSeen(60_000, 12.34, 0.1, 40.0, 0.0, 4e-4), ())
    assert channel.offered == [
        Seen(20_000, (looking, standing)),
        Seen(40_000, (looking._replace(frames=()), standing._replace(distance=None))),
    ]
