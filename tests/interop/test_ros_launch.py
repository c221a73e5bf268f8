"""`launch --world … --camera --dds` as a node finds it: pictures, range and where all is, by the clock of all else."""

import math
import os
import shutil
import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests import dds
from tests.launched import launched

pytest.importorskip("cyclonedds", reason="needs the extra ros2")
pytest.importorskip("av", reason="needs the extra video")

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sitl_emu.run import dds_types
from sitl_emu.run.ros.publisher import TF_STATIC, described
from tests.unit.test_dds_service import Client

YARD = Path(__file__).parents[2] / "examples" / "own_world" / "yard.yaml"
OWN_VEHICLE = Path(__file__).parents[2] / "examples" / "own_vehicle" / "my_quad"
INSTANCE = 72
WITHIN = f"px4_{INSTANCE}"
DOMAIN = dds.domain()
SENSOR_DATA = Qos(
    Policy.Reliability.BestEffort, Policy.History.KeepAll, Policy.DataRepresentation(use_cdrv0_representation=True)
)
NEWEST = SENSOR_DATA + Qos(Policy.History.KeepLast(1))
"""Of pictures: Python takes long to read one, and a queue of them would be heard ever later."""
PX4 = Qos(Policy.Reliability.BestEffort, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
WIDTH, HEIGHT, RATE_HZ, FOCAL_PX = 640, 480, 15.0, 320.0
"""The iris's camera (vehicles/iris/vehicle.toml): 90 degrees across, straight down."""
TAKE_OFF, ARM = 22, 400
until = partial(dds.until, limit_s=240.0)
"""Renderers that were never used here are compiled first (numba)."""


def seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)


class Node:
    """Who hears topics; all that came lies in `heard`, with the time at which it was taken."""

    def __init__(self) -> None:
        self.participant = DomainParticipant(DOMAIN)
        self._readers: dict[str, DataReader[Any]] = {}
        self.heard: dict[str, list[tuple[float, Any]]] = {}

    def hear(self, topic: str, kind: Any, qos: Qos = SENSOR_DATA) -> None:
        self._readers[topic] = DataReader(self.participant, Topic(self.participant, f"rt/{topic}", kind), qos=qos)
        self.heard[topic] = []

    def take(self) -> None:
        for topic, reader in self._readers.items():
            came = [each for each in reader.take(100) if not isinstance(each, InvalidSample)]
            self.heard[topic] += [(time.time(), each) for each in came]

    def until(self, true: Callable[[], Any]) -> None:
        def looked() -> Any:
            self.take()
            return true()

        until(looked)

    def newest(self, topic: str) -> Any:
        return self.heard[topic][-1][1]


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Node:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    made = Node()
    made.hear(f"{WITHIN}/camera/image_raw", described("sensor_msgs/Image"), NEWEST)
    made.hear(f"{WITHIN}/camera/image_raw/compressed", described("sensor_msgs/CompressedImage"), NEWEST)
    for topic, message in (
        (f"{WITHIN}/camera/camera_info", "sensor_msgs/CameraInfo"),
        (f"{WITHIN}/range", "sensor_msgs/Range"),
        ("tf", "tf2_msgs/TFMessage"),
        ("clock", "rosgraph_msgs/Clock"),
    ):
        made.hear(topic, described(message))
    made.hear("tf_static", described("tf2_msgs/TFMessage"), TF_STATIC)
    made.hear(f"{WITHIN}/fmu/out/vehicle_status_v4", dds_types.described("VehicleStatus"), PX4)
    made.hear(f"{WITHIN}/fmu/out/vehicle_attitude", dds_types.described("VehicleAttitude"), PX4)
    return made


def answer(node: Node, client: Client) -> Any:
    """The next reply."""
    replies = list[Any]()

    def came() -> list[Any]:
        replies.extend(client.replies())
        return replies

    node.until(came)
    return replies[0]


def climb(node: Node) -> None:
    """By PX4's service: take off, arm."""
    client, nan = Client(node.participant, 1, within=WITHIN), {f"param{place}": math.nan for place in range(4, 8)}
    client.wait_for_service()
    status = f"{WITHIN}/fmu/out/vehicle_status_v4"
    node.until(lambda: node.heard[status] and node.newest(status).pre_flight_checks_pass)
    for sequence, (number, more) in enumerate(((TAKE_OFF, nan), (ARM, {"param1": 1.0})), 1):
        client.ask(sequence, command=number, target_system=INSTANCE + 1, **more)
        assert answer(node, client).reply.result == 0


def height_m(node: Node) -> float:
    (base,) = node.newest("tf").transforms
    assert (base.header.frame_id, base.child_frame_id) == ("map", f"iris-{INSTANCE}/base_link")
    return float(base.transform.translation.z)


def children_of(pid: int) -> dict[str, int]:
    """Its processes, by the last word of their module's name."""
    found = {}
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        words = Path(f"/proc/{child}/cmdline").read_bytes().decode().split("\0")
        found[words[words.index("-m") + 1].rpartition(".")[2]] = int(child)
    return found


def test_a_launch_in_a_world_is_heard_and_flies_on_when_the_publisher_dies(node: Node) -> None:
    camera = f"{WITHIN}/camera"
    options = ("--world", str(YARD), "--camera", "--dds", "--instance", str(INSTANCE))
    with launched("iris", *options) as launch:
        node.until(lambda: len(node.heard[f"{camera}/image_raw"]) > 20)
        ground, on_ground_m = node.newest(f"{camera}/image_raw"), height_m(node)
        climb(node)
        node.until(lambda: height_m(node) > on_ground_m + 2.0)
        node.until(lambda: node.newest(f"{WITHIN}/range").range > 1.8)
        risen_m = height_m(node) - on_ground_m
        above, distance_m = node.newest(f"{camera}/image_raw"), node.newest(f"{WITHIN}/range").range
        node.until(lambda: seconds(node.newest(f"{camera}/camera_info").header.stamp) >= seconds(above.header.stamp))
        publisher = children_of(launch.pid)["ros_process"]
        os.kill(publisher, signal.SIGKILL)
        assert launch.stdout is not None
        told = next(line for line in launch.stdout if line.startswith("ROS 2 hears"))
        assert f"ros (pid {publisher}) was killed by SIGKILL" in told
        attitude = f"{WITHIN}/fmu/out/vehicle_attitude"
        node.take()
        many, pictures = len(node.heard[attitude]), len(node.heard[f"{camera}/camera_info"])
        node.until(lambda: len(node.heard[attitude]) > many + 50)
        assert len(node.heard[f"{camera}/camera_info"]) == pictures

    for _, image in node.heard[f"{camera}/image_raw"]:
        assert (image.width, image.height, image.encoding, image.step) == (WIDTH, HEIGHT, "bgr8", 3 * WIDTH)
        assert len(image.data) == 3 * WIDTH * HEIGHT
        assert image.header.frame_id == f"iris-{INSTANCE}/camera_optical_frame"
    stood, rose = (np.frombuffer(bytes(each.data), np.uint8).astype(float) for each in (ground, above))
    assert abs(stood - rose).mean() > 5.0, "it sees something else from above"
    assert distance_m == pytest.approx(risen_m, abs=0.5)

    infos = {seconds(info.header.stamp): info for _, info in node.heard[f"{camera}/camera_info"]}
    assert len(infos) == pictures
    assert np.median(np.diff(list(infos))) > 1.0 / RATE_HZ - 0.005, "no oftener; less often where drawing takes longer"
    info = infos[seconds(above.header.stamp)]
    assert (info.width, info.height) == (WIDTH, HEIGHT) and info.k[0] == pytest.approx(FOCAL_PX)
    assert (info.k[2], info.k[5]) == ((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
    jpeg = node.newest(f"{camera}/image_raw/compressed")
    assert seconds(jpeg.header.stamp) in infos
    drawn = cv2.imdecode(np.frombuffer(bytes(jpeg.data), np.uint8), cv2.IMREAD_COLOR)
    assert drawn is not None and drawn.shape == (HEIGHT, WIDTH, 3)

    poses = [(at, seconds(each.transforms[0].header.stamp)) for at, each in node.heard["tf"]]
    dates = [stamp for _, stamp in poses]
    assert np.median(np.diff(dates)) > 0.015, "50 times a second, or less where the machine can't follow"
    assert min(np.diff(dates)) > 0.0
    late_s = [at - stamp for at, stamp in poses]
    assert min(late_s) > -1.0 and np.median(late_s) < 3.0, "the computer's clock"
    attitudes = [each.timestamp * 1e-6 for _, each in node.heard[attitude]]
    assert min(abs(dates[-1] - each) for each in attitudes) < 0.5, "since the same moment as PX4's topics"
    frames = {each.child_frame_id for each in node.newest("tf_static").transforms}
    assert {ground.header.frame_id, node.newest(f"{WITHIN}/range").header.frame_id} < frames


def test_at_another_speed_a_gimbal_and_its_camera_bear_simulated_time(node: Node) -> None:
    """All stamps are ticks after one moment, those of PX4's topics and of /clock too; a gimbal's camera is in /tf."""
    camera, name = f"{WITHIN}/camera/image_raw", f"m600-{INSTANCE}"
    options = ("--world", str(YARD), "--camera", "--dds", "--speed", "2", "--instance", str(INSTANCE))
    with launched("m600", *options):
        node.until(lambda: len(node.heard[camera]) > 10 and node.heard[f"{WITHIN}/fmu/out/vehicle_attitude"])
    px4_us = node.newest(f"{WITHIN}/fmu/out/vehicle_attitude").timestamp
    stamps = [each.header.stamp for _, each in node.heard[camera]]
    stamps += [each.header.stamp for _, message in node.heard["tf"] for each in message.transforms]
    stamps += [each.clock for _, each in node.heard["clock"]]
    ticks = {(each.sec * 1_000_000 + each.nanosec // 1000 - px4_us) % 4000 for each in stamps}
    assert ticks == {0}
    moving = {each.child_frame_id: each for each in node.newest("tf").transforms}
    assert set(moving) == {f"{name}/base_link", f"{name}/camera_link"}
    q = moving[f"{name}/camera_link"].transform.rotation
    assert 2.0 * (q.y * q.w - q.x * q.z) == pytest.approx(1.0, abs=0.05), "it hangs straight down at the start"


FEEDS = """
[depth]
resolution = [32, 24]
mount = {down_m = 0.05, depression_deg = 90.0}

[lidar]
rows = 1
columns = 360
elevation_deg = [0.0, 0.0]
mount = {down_m = -0.3, depression_deg = 0.0}
rate_hz = 10.0
"""


def test_a_vehicle_s_own_depth_camera_and_lidar_are_heard(node: Node, tmp_path: Path) -> None:
    """Those that its data list, while it stands in a yard: the ground below, house and wall around it."""
    folder = Path(shutil.copytree(OWN_VEHICLE, tmp_path / OWN_VEHICLE.name))
    with (folder / "vehicle.toml").open("a") as toml:
        toml.write(FEEDS)
    depth, scan, points = (f"{WITHIN}/{each}" for each in ("depth_camera/image_raw", "lidar/scan", "lidar/points"))
    node.hear(depth, described("sensor_msgs/Image"))
    node.hear(scan, described("sensor_msgs/LaserScan"))
    node.hear(points, described("sensor_msgs/PointCloud2"))
    with launched(str(folder), "--world", str(YARD), "--dds", "--instance", str(INSTANCE)):
        node.until(lambda: min(len(node.heard[topic]) for topic in (depth, scan, points)) > 10)
        node.until(lambda: node.heard["tf_static"] and node.heard["tf"])

    picture, around = node.newest(depth), node.newest(scan)
    assert (picture.width, picture.height, picture.encoding) == (32, 24, "32FC1")
    below_m = np.frombuffer(bytes(picture.data), np.float32)
    height_m = node.newest("tf").transforms[0].transform.translation.z
    assert np.median(below_m) == pytest.approx(height_m - 0.05, abs=0.05)
    ranges_m = np.array(around.ranges)
    assert len(ranges_m) == 360 and np.isfinite(ranges_m).sum() > 3 and ranges_m.min() > 0.5
    frames = {each.child_frame_id for each in node.newest("tf_static").transforms}
    assert {picture.header.frame_id, around.header.frame_id, node.newest(points).header.frame_id} < frames
    for topic, every_s in ((depth, 0.2), (scan, 0.1), (points, 0.1)):
        stamps = [seconds(message.header.stamp) for _, message in node.heard[topic]]
        assert min(np.diff(stamps)) > 0.0
        assert np.median(np.diff(stamps)) > every_s - 0.03, "no oftener; less often where the machine can't follow"
