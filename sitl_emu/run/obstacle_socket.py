"""Where a vehicle's depth camera and lidar tell its autopilot of obstacles: the far end of its payload link.

By MAVLink over UDP, as a companion computer would, so that it is the same to an autopilot of ours and to a real PX4
(its start script, px4-rc.mavlink, has that link for what the vehicle carries). What the autopilot says there is not
read.
"""

import contextlib
import socket

from sitl_emu.components.obstacle_detector import ObstacleDetector
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.run.link_sockets import PrivateSocket
from sitl_emu.run.messages import FrameTaken, ObstaclesSeen

LOOPBACK = "127.0.0.1"
SENSORS: dict[str, int] = {
    "lidar": mavlink.MAV_DISTANCE_SENSOR_LASER,
    "depth": mavlink.MAV_DISTANCE_SENSOR_UNKNOWN,
}
"""MAV_DISTANCE_SENSOR by feed; it has none for cameras."""


class ObstacleSocket:
    """One vehicle's."""

    def __init__(self, instance: int, camera: list[bytes] | None = None, private: PrivateSocket | None = None) -> None:
        """`camera`: what a camera has to send that has this end of the link (`carried.py`), and which then sends ours.

        `private`: the socket in an isolated run. Raises OSError where the port is in use.
        """
        link = ports.payload(instance)
        self._autopilot, self._camera = (LOOPBACK, link.local), camera
        self._detector = ObstacleDetector(ports.system_id(instance))
        if private is not None:
            self._socket, self._autopilot = private.opened, (LOOPBACK, private.other_port)
        elif camera is None:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.bind((LOOPBACK, link.remote))

    def tell(self, frame: FrameTaken, obstacles: ObstaclesSeen) -> None:
        """What a frame shows."""
        self._detector.tell(frame.time_us, SENSORS[frame.feed], *obstacles)

    def send(self, now_us: int) -> int:
        """Send what was told, and the heartbeat that is due; how many datagrams."""
        self._detector.on_time(now_us)
        sent = len(self._detector.outbox)
        if self._camera is not None:
            self._camera += self._detector.outbox
            self._detector.outbox.clear()
        for datagram in self._detector.outbox:
            with contextlib.suppress(ConnectionRefusedError):  # an autopilot from outside that boots
                self._socket.sendto(datagram, self._autopilot)
        self._detector.outbox.clear()
        return sent
