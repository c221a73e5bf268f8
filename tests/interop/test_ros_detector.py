"""The example's node sees a field's patches in pictures that come over DDS, and says so to ROS 2."""

import contextlib
import functools
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, camera_pose, project
from sitl_emu.run.messages import RangeSeen
from sitl_emu.run.ros import sensors
from sitl_emu.world import camera
from sitl_emu.world.kinds.corn_field.field import CornField, build
from sitl_emu.world.kinds.corn_field.scene import FieldScene
from sitl_emu.world.lens import Intrinsics
from tests import dds

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sitl_emu.run.ros.publisher import Publisher, described

ROOT = Path(__file__).parents[2]
STAND_IN = Path(__file__).parent / "rclpy_stand_in"
DOMAIN = dds.domain()
LIMIT_S = 60.0
until = functools.partial(dds.until, limit_s=LIMIT_S)
HEIGHT_M = 15.0
NAMESPACE = "px4_3"
FRAME = "uas/camera_optical_frame"
TAKEN_US = 1_700_000_000_100_000


@pytest.fixture(autouse=True)
def loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))


@contextlib.contextmanager
def example() -> Iterator[subprocess.Popen[str]]:
    """The example in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(STAND_IN), str(ROOT)))}
    command = [sys.executable, str(ROOT / "examples" / "ros2_detector.py"), NAMESPACE]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def above(field: CornField, north_m: float, east_m: float) -> tuple[Any, camera.Pose]:
    """A picture from 15 m above a place."""
    pose = camera.Pose(north_m, east_m, -field.terrain.height_m(north_m, east_m) - HEIGHT_M, (1.0, 0.0, 0.0, 0.0))
    return camera.Camera(FieldScene(field)).render(pose, 1), pose


def test_a_patch_is_seen_and_told() -> None:
    field = build(301)
    target = field.targets[0]
    picture, pose = above(field, target.north_m - 2.0, target.east_m + 2.0)
    seen_from = camera_pose(pose[:3], pose.q, NADIR)
    height_m = field.terrain.height_m(target.north_m, target.east_m)
    pixel = project(CameraModel(), seen_from, (target.north_m, target.east_m, -height_m))
    assert pixel is not None
    participant = DomainParticipant(DOMAIN)
    kind = described("vision_msgs/Detection2DArray")
    topic = Topic(participant, f"rt/{NAMESPACE}/camera/detections", kind)
    plain = Policy.DataRepresentation(use_cdrv0_representation=True)
    reader = DataReader(participant, topic, qos=Qos(Policy.History.KeepLast(10), plain))
    image = Publisher(participant, f"{NAMESPACE}/camera/image_raw", "sensor_msgs/Image")
    info = Publisher(participant, f"{NAMESPACE}/camera/camera_info", "sensor_msgs/CameraInfo")
    height = Publisher(participant, f"{NAMESPACE}/range", "sensor_msgs/Range")
    told = list[Any]()
    with example():
        until(lambda: image.is_heard and info.is_heard and height.is_heard and reader.get_matched_publications())

        def answered() -> bool:
            """Best effort: a picture may be lost; with each come its lens and the height."""
            height.publish(sensors.range_(TAKEN_US, "uas/range_link", RangeSeen(0, HEIGHT_M, 0.1, 40.0, 0.0, 0.0)))
            info.publish(sensors.camera_info(TAKEN_US, FRAME, Intrinsics()))
            image.publish(sensors.image(TAKEN_US, FRAME, picture, "bgr8"))
            end = time.monotonic() + 2.0
            while not told and time.monotonic() < end:
                told.extend(reader.take(1))
                time.sleep(0.01)
            return bool(told)

        until(answered)
    (array,) = told
    assert (array.header.frame_id, array.header.stamp.nanosec) == (FRAME, 100_000_000)
    near = [
        each.results[0].hypothesis
        for each in array.detections
        if math.dist((each.bbox.center.position.x, each.bbox.center.position.y), pixel) < 40.0
    ]
    assert [hypothesis.class_id for hypothesis in near] == [target.kind]
    assert near[0].score > 0.4
