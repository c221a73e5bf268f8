"""`run --dds` as a node finds it: the clock, where the vehicle is, and its sensors, all of one time."""

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests import dds

pytest.importorskip("cyclonedds", reason="needs the extra ros2")

import itertools

from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from sitl_emu.run.ros.publisher import TF_STATIC, described

YARD = Path(__file__).parents[2] / "examples" / "own_world" / "yard.yaml"
INSTANCE = 71
DOMAIN = dds.domain()
START_S = 1_750_000_000
SCENARIO = f"""
name: seen_by_ros
world: {YARD}
start_date: 2025-06-15T15:06:40Z
time_limit_s: 6
vehicles:
  - name: iris
    model: iris
    camera: {{mount: nadir, rate_hz: 10, latency_s: 0.1, resolution: [160, 120]}}
    lidar: {{rows: 1, elevation_deg: [0, 0], rate_hz: 5}}
"""
SENSOR_DATA = Qos(
    Policy.Reliability.BestEffort, Policy.History.KeepAll, Policy.DataRepresentation(use_cdrv0_representation=True)
)


def seconds(stamp: Any) -> float:
    return float(stamp.sec - START_S + stamp.nanosec * 1e-9)


class Heard:
    """All that came on a topic."""

    def __init__(self, participant: DomainParticipant, topic: str, message: str, qos: Qos = SENSOR_DATA) -> None:
        self._reader = DataReader(participant, Topic(participant, f"rt/{topic}", described(message)), qos=qos)
        self.messages: list[Any] = []

    def take(self) -> None:
        """What has come since."""
        self.messages += [each for each in self._reader.take(100) if not isinstance(each, InvalidSample)]


def test_a_run_is_heard_in_ros_s_own_messages(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", dds.LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    (tmp_path / "scenario.yaml").write_text(SCENARIO)
    participant = DomainParticipant(DOMAIN)
    clock, tf = Heard(participant, "clock", "rosgraph_msgs/Clock"), Heard(participant, "tf", "tf2_msgs/TFMessage")
    static = Heard(participant, "tf_static", "tf2_msgs/TFMessage", TF_STATIC)
    image = Heard(participant, f"px4_{INSTANCE}/camera/image_raw", "sensor_msgs/Image")
    scan = Heard(participant, f"px4_{INSTANCE}/lidar/scan", "sensor_msgs/LaserScan")
    height = Heard(participant, f"px4_{INSTANCE}/range", "sensor_msgs/Range")
    command = [sys.executable, "-P", "-m", "sitl_emu", "run", "scenario.yaml", "--dds", "--speed", "1"]
    command += ["--instance", str(INSTANCE), "--out", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        while run.poll() is None:
            for each in (clock, tf, static, image, scan, height):
                each.take()
            time.sleep(0.02)
        assert run.stdout is not None
        said = run.stdout.read()
    assert "time limit reached" in said, said
    told = [seconds(each.clock) for each in clock.messages]
    assert told == sorted(told) and len(told) > 200
    assert told[-1] == pytest.approx(6.0, abs=0.1)
    assert min(later - earlier for earlier, later in itertools.pairwise(told)) == pytest.approx(0.02)
    assert len(image.messages) > 20 and len(scan.messages) > 10 and len(height.messages) > 50
    taken = [seconds(each.header.stamp) for each in image.messages]
    assert all(10.0 * stamp == pytest.approx(round(10.0 * stamp), abs=0.05) for stamp in taken)
    assert {(each.width, each.height, len(each.data)) for each in image.messages} == {(160, 120, 3 * 160 * 120)}
    (base, *others) = tf.messages[-1].transforms
    assert not others and (base.header.frame_id, base.child_frame_id) == ("map", "iris/base_link")
    assert abs(base.transform.translation.z) < 1.0
    children = {each.child_frame_id for each in static.messages[-1].transforms}
    assert {image.messages[0].header.frame_id, scan.messages[0].header.frame_id} < children
    assert height.messages[0].header.frame_id in children
