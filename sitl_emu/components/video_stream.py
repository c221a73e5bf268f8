"""A camera's video stream as the camera speaks of it: what is told of it, and that it is started and stopped.

https://mavlink.io/en/services/camera.html#video_streaming. The one stream is H.264 over RTP to a UDP port of the ground
station. It runs from power-on: QGroundControl listens as soon as it hears of the port, and says START_STREAMING only
where it changes between several streams (src/Camera/VehicleCameraControl.cc). Nothing is encoded here; who does it is
told by `running`.
"""

from typing import Any

from sitl_emu.components.component import text
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData

STREAM = 1
ALL_OR_ONLY = (0, STREAM)
"""What commands and requests may name."""
BIT_RATE = 2_000_000
"""Bit/s: ours; 640 x 480 pixels 15 times a second look well."""
RUNNING: int = mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING
NAME = "camera"


class VideoStream:
    """The stream of one camera."""

    def __init__(self, port: int) -> None:
        """`port`: of UDP, where the ground station hears it."""
        self._port = port
        self.running = True
        """Whether pictures are to be sent."""

    def set_running(self, stream: int, running: bool) -> int:
        """START_STREAMING or STOP_STREAMING of a stream; the MAV_RESULT."""
        if stream not in ALL_OR_ONLY:
            return mavlink.MAV_RESULT_DENIED
        self.running = running
        return mavlink.MAV_RESULT_ACCEPTED

    def information(self, data: CameraData, hfov_deg: float, stream: int) -> Any:
        """VIDEO_STREAM_INFORMATION; None for a stream that there is not."""
        if stream not in ALL_OR_ONLY:
            return None
        return mavlink.MAVLink_video_stream_information_message(
            STREAM,
            1,
            mavlink.VIDEO_STREAM_TYPE_RTPUDP,
            self._flags,
            data.frame_rate_hz,
            data.resolution_h_px,
            data.resolution_v_px,
            BIT_RATE,
            0,
            round(hfov_deg),
            text(NAME, 32),
            text(str(self._port), 160),
            mavlink.VIDEO_STREAM_ENCODING_H264,
        )

    def status(self, data: CameraData, hfov_deg: float, stream: int) -> Any:
        """VIDEO_STREAM_STATUS; None for a stream that there is not."""
        if stream not in ALL_OR_ONLY:
            return None
        return mavlink.MAVLink_video_stream_status_message(
            STREAM,
            self._flags,
            data.frame_rate_hz,
            data.resolution_h_px,
            data.resolution_v_px,
            BIT_RATE,
            0,
            round(hfov_deg),
        )

    @property
    def _flags(self) -> int:
        return RUNNING if self.running else 0
