"""Frames as ROS 2 has them: east, north, up; forward, left, up; z along the optical axis."""

import math

import pytest

from sitl_emu.core import attitude
from sitl_emu.core.attitude import Quaternion
from sitl_emu.run.messages import BodyPose
from sitl_emu.run.ros import frames, messages
from sitl_emu.run.ros.frames import Transform, Vector

LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)


def turned(q: Quaternion, vector: Vector) -> Vector:
    return attitude.rotated(attitude.rotation(q), vector)


def in_map(chain: list[Transform], vector: Vector) -> Vector:
    """A direction in the last frame of a chain, seen in the first's parent."""
    for transform in reversed(chain):
        vector = turned(transform.rotation, vector)
    return vector


def close(one: Vector, other: Vector) -> bool:
    return math.dist(one, other) < 1e-9


def pose(roll_deg: float, pitch_deg: float, yaw_deg: float) -> BodyPose:
    angles = (math.radians(angle) for angle in (roll_deg, pitch_deg, yaw_deg))
    return BodyPose(10.0, 20.0, -30.0, attitude.quaternion(*angles))


def test_a_place_is_told_east_north_up() -> None:
    transform = frames.base_link("uas", pose(0, 0, 0))
    assert transform[:3] == ("map", "uas/base_link", (20.0, 10.0, 30.0))


@pytest.mark.parametrize(
    ("angles", "forward", "left", "up"),
    [
        ((0, 0, 0), (0, 1, 0), (-1, 0, 0), (0, 0, 1)),  # north
        ((0, 0, 90), (1, 0, 0), (0, 1, 0), (0, 0, 1)),  # east
        ((0, 90, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0)),  # nose up
        ((90, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)),  # right wing down
    ],
)
def test_bodies_are_forward_left_up(
    angles: tuple[float, float, float], forward: Vector, left: Vector, up: Vector
) -> None:
    base = [frames.base_link("uas", pose(*angles))]
    assert close(in_map(base, (1, 0, 0)), forward)
    assert close(in_map(base, (0, 1, 0)), left)
    assert close(in_map(base, (0, 0, 1)), up)


def test_a_camera_looks_along_z_and_its_picture_s_right_is_x() -> None:
    """Straight down below a vehicle that flies east: what is forward, east, is on top of the picture (-y)."""
    base = frames.base_link("uas", pose(0, 0, 90))
    camera = frames.fixed("uas", "camera_link", (0.1, 0.2, 0.3), 90.0)
    assert camera.translation == (0.1, -0.2, -0.3)
    chain = [base, camera, frames.optical("uas", "camera")]
    assert close(in_map(chain, (0, 0, 1)), (0, 0, -1))
    assert close(in_map(chain, (0, -1, 0)), (1, 0, 0))
    assert close(in_map(chain, (1, 0, 0)), (0, -1, 0))
    assert [each.child for each in chain] == ["uas/base_link", "uas/camera_link", "uas/camera_optical_frame"]
    assert [each.parent for each in chain] == ["map", "uas/base_link", "uas/camera_link"]


def test_a_gimbal_holds_its_camera_however_the_vehicle_tilts() -> None:
    head = attitude.quaternion(0.0, math.radians(-30.0), math.radians(90.0))  # east, 30° below the horizon
    tilted = pose(20, -10, 40)
    link = frames.on_gimbal("uas", "camera_link", (0.0, 0.0, 0.15), 0.0, tilted, head)
    chain = [frames.base_link("uas", tilted), link, frames.optical("uas", "camera")]
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    assert close(in_map(chain, (0, 0, 1)), (c, 0, -s))
    assert close(in_map(chain, (1, 0, 0)), (0, -1, 0))
    lower = frames.on_gimbal("uas", "camera_link", (0.0, 0.0, 0.15), 60.0, tilted, head)
    assert close(in_map([chain[0], lower], (1, 0, 0)), (0, 0, -1))


def test_times_are_seconds_and_nanoseconds() -> None:
    assert messages.stamp(1_700_000_000_123_456) == {"sec": 1_700_000_000, "nanosec": 123_456_000}
    (told,) = frames.tf_message(2_000_000, [frames.base_link("uas", pose(0, 0, 0))])["transforms"]
    assert told["header"] == {"stamp": {"sec": 2, "nanosec": 0}, "frame_id": "map"}
    assert set(told["transform"]["rotation"]) == set("xyzw")
