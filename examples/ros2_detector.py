"""A ROS 2 node hears a camera's pictures, and publishes the weeds and the diseased corn that it sees in them.

    sitl-emu run agriculture --dds --speed 1      # in one terminal; pip install 'sitl-emu[ros2]'
    python examples/ros2_detector.py              # in another, with ROS 2 and vision_msgs sourced

It asks the network of the agriculture mission's scout, so that sitl-emu has to be installed
for ROS 2's Python; how large a pixel is on the ground they are told from `range` and `camera/camera_info`. What it sees
is on `camera/detections` (vision_msgs/Detection2DArray) with the picture's stamp and frame, boxes in pixels.
Another vehicle's camera: `python examples/ros2_detector.py px4_1`.
"""

import sys

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, Range
from vision_msgs.msg import BoundingBox2D, Detection2D, Detection2DArray, ObjectHypothesisWithPose

from sitl_emu.missions.agriculture.detectors import network
from sitl_emu.missions.companion.detector import Detection

KEPT = 10
"""Messages that a late reader still finds."""


class Detector(Node):
    """Looks at each picture that comes."""

    def __init__(self, namespace: str) -> None:
        super().__init__("detector")
        within = f"/{namespace}" if namespace else ""
        self._detector, self._focal_px, self._height_m = network(), 0.0, 0.0
        self._detections = self.create_publisher(Detection2DArray, f"{within}/camera/detections", KEPT)
        self.create_subscription(Range, f"{within}/range", self._on_range, qos_profile_sensor_data)
        self.create_subscription(CameraInfo, f"{within}/camera/camera_info", self._on_info, qos_profile_sensor_data)
        self.create_subscription(Image, f"{within}/camera/image_raw", self._on_image, qos_profile_sensor_data)

    def _on_range(self, message: Range) -> None:
        self._height_m = message.range

    def _on_info(self, message: CameraInfo) -> None:
        self._focal_px = message.k[0]

    def _on_image(self, message: Image) -> None:
        rows = np.asarray(message.data, np.uint8).reshape(message.height, message.step)
        picture = np.ascontiguousarray(rows[:, : 3 * message.width].reshape(message.height, message.width, 3))
        known = self._focal_px > 0.0 and 0.0 < self._height_m < float("inf")
        found = self._detector.detect(picture, self._height_m / self._focal_px if known else None)
        told = Detection2DArray()
        told.header = message.header
        told.detections = [detection(each, message) for each in found]
        self._detections.publish(told)
        for each in found:
            print(f"{each.label} {each.score:.2f} at {each.x:.0f}, {each.y:.0f}", flush=True)


def detection(found: Detection, picture: Image) -> Detection2D:
    """A find as vision_msgs has it."""
    hypothesis = ObjectHypothesisWithPose()
    hypothesis.hypothesis.class_id, hypothesis.hypothesis.score = found.label, found.score
    box = BoundingBox2D()
    box.center.position.x, box.center.position.y = found.x, found.y
    box.size_x, box.size_y = found.w, found.h
    told = Detection2D()
    told.header, told.bbox, told.results = picture.header, box, [hypothesis]
    return told


def main(namespace: str = "") -> None:
    """Look until Ctrl-C."""
    rclpy.init()
    node = Detector(namespace)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:2])
