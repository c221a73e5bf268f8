"""Where things are in ROS 2's axes: `map` is east, north, up (REP 103, 105), bodies are forward, left, up.

Of a vehicle there are NAME/base_link, its origin, and of its sensors NAME/camera_link (x along the optical axis) with
NAME/camera_optical_frame (z along it, x right in the picture; REP 103), the same of depth_camera, NAME/lidar_link and
NAME/range_link (x along the beam; sensor_msgs/Range). Names are ours, as REP 105 and drivers form theirs. What is told
here is the simulator's truth, as Gazebo's poses are.
"""

import math
from typing import Any, NamedTuple

from sitl_emu.core.attitude import Quaternion, product
from sitl_emu.run.messages import BodyPose
from sitl_emu.run.ros.messages import stamp

MAP = "map"
Vector = tuple[float, float, float]
NED_TO_ENU: Quaternion = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)
FRD_TO_FLU: Quaternion = (0.0, 1.0, 0.0, 0.0)
LINK_TO_OPTICAL: Quaternion = (0.5, -0.5, 0.5, -0.5)
"""Roll and yaw of -90°: what every driver's camera_link → camera_optical_frame is (REP 103)."""


class Transform(NamedTuple):
    """Where a frame is within another: its origin, m, and its attitude (w, x, y, z)."""

    parent: str
    child: str
    translation: Vector
    rotation: Quaternion


def name(vehicle: str, frame: str) -> str:
    """A vehicle's frame."""
    return f"{vehicle}/{frame}"


def base_link(vehicle: str, pose: BodyPose) -> Transform:
    """Where a vehicle is."""
    attitude = product(product(NED_TO_ENU, pose.q), FRD_TO_FLU)
    return Transform(MAP, name(vehicle, "base_link"), (pose.east_m, pose.north_m, -pose.down_m), attitude)


def fixed(vehicle: str, link: str, place_m: Vector, depression_deg: float) -> Transform:
    """A sensor that looks forward, so far below the horizon; `place_m`: forward, right and down of the origin."""
    return Transform(name(vehicle, "base_link"), name(vehicle, link), _flu(place_m), _pitched_down(depression_deg))


def on_gimbal(
    vehicle: str, link: str, place_m: Vector, depression_deg: float, pose: BodyPose, head: Quaternion
) -> Transform:
    """The same on the head of a gimbal, whose attitude (to NED) is `head`."""
    w, x, y, z = pose.q
    turned_w, turned_x, turned_y, turned_z = product((w, -x, -y, -z), head)
    turned: Quaternion = (turned_w, turned_x, -turned_y, -turned_z)
    attitude = product(turned, _pitched_down(depression_deg))
    return Transform(name(vehicle, "base_link"), name(vehicle, link), _flu(place_m), attitude)


def optical(vehicle: str, camera: str) -> Transform:
    """A camera's optical frame within its link; `camera`: "camera", "depth_camera"."""
    link, frame = name(vehicle, f"{camera}_link"), name(vehicle, f"{camera}_optical_frame")
    return Transform(link, frame, (0.0, 0.0, 0.0), LINK_TO_OPTICAL)


def _flu(frd: Vector) -> Vector:
    return frd[0], -frd[1], -frd[2]


def _pitched_down(depression_deg: float) -> Quaternion:
    half = math.radians(depression_deg) / 2.0
    return math.cos(half), 0.0, math.sin(half), 0.0


def header(time_us: int, frame: str) -> dict[str, Any]:
    """std_msgs/Header."""
    return {"stamp": stamp(time_us), "frame_id": frame}


def tf_message(time_us: int, transforms: list[Transform]) -> dict[str, Any]:
    """tf2_msgs/TFMessage."""
    return {"transforms": [_stamped(time_us, each) for each in transforms]}


def _stamped(time_us: int, transform: Transform) -> dict[str, Any]:
    x, y, z = transform.translation
    qw, qx, qy, qz = transform.rotation
    return {
        "header": header(time_us, transform.parent),
        "child_frame_id": transform.child,
        "transform": {"translation": {"x": x, "y": y, "z": z}, "rotation": {"x": qx, "y": qy, "z": qz, "w": qw}},
    }
