"""Frames of a camera as they come in real time, stamped with the vehicle's boot time.

The simulator's and recorded frames carry that time. For a stream or a device it is the time at which it was read, less
the camera's latency, brought to the vehicle's boot time by the fastest telemetry of the last 10 s.
"""

import threading
import time
from collections import deque

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.camera import CameraError, CameraSource, Frame, RecordedFrames

OFFSET_WINDOW_US = 10_000_000
IDLE_S = 0.002
FILE_PERIOD_S = 1.0 / 30.0
"""A video file is read as fast as a camera gives frames."""
ENDED = "the stream has ended, and no frame comes any more; look after the camera, then begin anew"


class BootClock:
    """From this computer's time to the vehicle's boot time: the smallest delay of the last 10 s counts as none."""

    def __init__(self) -> None:
        self._offsets: deque[tuple[int, int]] = deque()

    def heard(self, now_us: int, msg: mavlink.MAVLink_message) -> None:
        """A message of the autopilot came in, which may bear its boot time."""
        time_boot_ms = getattr(msg, "time_boot_ms", None)
        if time_boot_ms is None or msg.get_srcComponent() != 1:
            return
        offset = time_boot_ms * 1000 - now_us
        while self._offsets and self._offsets[-1][1] <= offset:
            self._offsets.pop()
        self._offsets.append((now_us, offset))
        while self._offsets[0][0] < now_us - OFFSET_WINDOW_US:
            self._offsets.popleft()

    def boot_us(self, now_us: int) -> int | None:
        """The vehicle's boot time now; None before it was heard."""
        return now_us + self._offsets[0][1] if self._offsets else None


class LiveFrames:
    """Reads a camera in a thread, as a stream makes its reader wait. Two frames are kept for who takes them."""

    def __init__(self, source: CameraSource, clock: BootClock, latency_us: int) -> None:
        self._source, self._clock, self._latency_us = source, clock, latency_us
        self._frames: deque[tuple[Frame, int]] = deque(maxlen=2)
        self._stop = threading.Event()
        self.error: str | None = None
        """Why no more frames come, or a recorded one did not; a line for people. A file just ends."""
        self._thread = threading.Thread(target=self._read, name="camera", daemon=True)
        self._thread.start()

    def take(self, now_us: int) -> list[Frame]:
        """The frames since the last call; what came before the vehicle was heard is left out."""
        if isinstance(self._source, RecordedFrames):
            return self._recorded(self._source, now_us)
        taken = list[Frame]()
        while self._frames:
            frame, read_us = self._frames.popleft()
            if self._source.clock != "vehicle":
                boot_us = self._clock.boot_us(read_us - self._latency_us)
                if boot_us is None:
                    continue
                frame = frame._replace(time_usec=boot_us)
            taken.append(frame)
        return taken

    def close(self) -> None:
        """Ends the thread and lets the camera go."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._source.close()

    def _recorded(self, source: RecordedFrames, now_us: int) -> list[Frame]:
        """Recorded frames come at their own time; one that can't be read is told and left out."""
        taken = list[Frame]()
        boot_us = self._clock.boot_us(now_us)
        while boot_us is not None and (next_us := source.next_time_usec) is not None and next_us <= boot_us:
            try:
                frame = source.read()
            except CameraError as error:
                self.error = str(error)
                break
            if frame is not None:
                taken.append(frame)
        return taken

    def _read(self) -> None:
        if isinstance(self._source, RecordedFrames):
            return
        try:
            self._read_on()
            if self._source.clock != "file":
                self._tell(ENDED)
        except CameraError as error:
            self._tell(str(error))
        except Exception as error:  # whatever a driver or a decoder does
            self._tell(f"{type(error).__name__}: {error}")

    def _read_on(self) -> None:
        while not self._stop.is_set() and not self._source.ended:
            frame = self._source.read()
            if frame is None:
                self._stop.wait(IDLE_S)
                continue
            self._frames.append((frame, time.monotonic_ns() // 1000))
            if self._source.clock == "file":
                self._stop.wait(FILE_PERIOD_S)

    def _tell(self, why: str) -> None:
        if not self._stop.is_set():
            self.error = " ".join(why.split())
