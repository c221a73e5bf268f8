"""The recording of a video onto a camera's storage: since when, how much it takes, and how often that is told.

https://mavlink.io/en/services/camera.html#video-capture (VIDEO_START_CAPTURE, VIDEO_STOP_CAPTURE). There is no file: a
video is so many MiB a second, and ends when the storage is full. What is seen live is `video_stream.py`. Times are
simulated, in µs.
"""

import math

from sitl_emu.components.component import NEVER_US, Command
from sitl_emu.components.storage import Storage
from sitl_emu.core import dialect as mavlink


class VideoRecording:
    """The recording of one camera, which runs or not."""

    def __init__(self, storage: Storage, mib_s: float) -> None:
        """`mib_s`: what a second of video takes of the storage."""
        self._storage, self._mib_s = storage, mib_s
        self._since_us: int | None = None
        self._asked = (0, 0, 0.0)
        """Who started it (system, component), and how often they want its status."""
        self._status_every_us = 0
        self.status_due_us = NEVER_US
        """When CAMERA_CAPTURE_STATUS is to be sent, while who started it wants it again and again."""

    @property
    def running(self) -> bool:
        """Whether a video is being recorded."""
        return self._since_us is not None

    @property
    def full_us(self) -> int:
        """When the video will have filled the storage."""
        if self._since_us is None or self._mib_s <= 0.0:
            return NEVER_US
        return self._since_us + math.ceil(self._storage.free_mib / self._mib_s * 1e6)

    def start(self, now_us: int, command: Command) -> int:
        """VIDEO_START_CAPTURE; the MAV_RESULT. Sent again, since its ack was lost, it changes nothing.

        Its second parameter: how often the status is told, in Hz; 0 or none: not by itself.
        """
        status_hz = command.params[1] if math.isfinite(command.params[1]) else 0.0
        asked = (command.source_system, command.source_component, status_hz)
        if self.running:
            again = asked == self._asked
            return mavlink.MAV_RESULT_ACCEPTED if again else mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        if self._storage.free_mib <= 0.0:
            return mavlink.MAV_RESULT_FAILED
        self._since_us, self._asked = now_us, asked
        if status_hz > 0.0:
            self._status_every_us = max(round(1e6 / status_hz), 1)
            self.status_due_us = now_us
        return mavlink.MAV_RESULT_ACCEPTED

    def stop(self, now_us: int) -> None:
        """What was recorded stays on the storage."""
        self._storage.used_mib += self.recorded_mib(now_us)
        self._since_us, self.status_due_us = None, NEVER_US

    def status_told(self, now_us: int) -> None:
        """The next is due."""
        self.status_due_us = now_us + self._status_every_us

    def recorded_ms(self, now_us: int) -> int:
        """Length of the video so far."""
        return 0 if self._since_us is None else (now_us - self._since_us) // 1000

    def recorded_mib(self, now_us: int) -> float:
        """What the video takes of the storage so far, no more than is free."""
        seconds = 0.0 if self._since_us is None else (now_us - self._since_us) * 1e-6
        return min(seconds * self._mib_s, self._storage.free_mib)
