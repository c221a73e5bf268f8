"""A camera's other end: what it says of itself, images and videos taken, its settings and its card.

Source: https://mavlink.io/en/services/camera.html. A ground station first asks for CAMERA_INFORMATION, and then for
what the camera says that it has. Each image is announced by CAMERA_IMAGE_CAPTURED; announcements that were lost show as
a gap in their indices and are asked for. Commands are handed out (`take_image()`, ...) to be driven as any other.
"""

from collections.abc import Iterator
from typing import Any

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.message_request import MessageRequest

CAMERA = 100
"""MAV_COMP_ID_CAMERA, the first of six."""
INFORMATION, SETTINGS, STORAGE, CAPTURE_STATUS, IMAGE_CAPTURED = 259, 260, 261, 262, 263
STREAM_INFORMATION, STREAM_STATUS = 269, 270
HAS_MODES, HAS_VIDEO_STREAM = 4, 256
"""CAMERA_CAP_FLAGS."""
IMAGE_MODE, VIDEO_MODE = 0, 1
ZOOM_RANGE = 2
FOCUS_RANGE = 2
IMAGE_START_CAPTURE, IMAGE_STOP_CAPTURE = 2000, 2001
VIDEO_START_CAPTURE, VIDEO_STOP_CAPTURE, VIDEO_START_STREAMING, VIDEO_STOP_STREAMING = 2500, 2501, 2502, 2503
STORAGE_FORMAT, RESET_CAMERA_SETTINGS, SET_CAMERA_MODE, SET_CAMERA_ZOOM, SET_CAMERA_FOCUS = 526, 529, 530, 531, 532
FORGET_AFTER = 1000
"""Announcements further back than this are not asked for."""


class Camera:
    """One camera; each of its messages is kept as it last came."""

    def __init__(self, system: int, component: int = CAMERA) -> None:
        self.target = (system, component)
        self.information: Any = None
        """CAMERA_INFORMATION."""
        self.settings: Any = None
        """CAMERA_SETTINGS."""
        self.storage: dict[int, Any] = {}
        """STORAGE_INFORMATION by storage_id."""
        self.capture_status: Any = None
        """CAMERA_CAPTURE_STATUS."""
        self.streams: dict[int, Any] = {}
        """VIDEO_STREAM_INFORMATION by stream_id."""
        self.stream_status: dict[int, Any] = {}
        """VIDEO_STREAM_STATUS by stream_id, of streams that were started or stopped since."""
        self.images: dict[int, Any] = {}
        """CAMERA_IMAGE_CAPTURED by image_index, of the images taken since we listen."""
        self.refusal = ""
        """Why there is no camera, in words."""
        self.missed = 0
        """Images whose announcement is lost for good."""
        self._request: MessageRequest | None = None
        self._questions = self._introduction()
        self._introduced = False
        self._next_index: int | None = None
        self._sequence = 0

    @property
    def ready(self) -> bool:
        """Whether it has introduced itself."""
        return self._introduced and not self.refusal

    @property
    def done(self) -> bool:
        """Whether there is nothing to ask for at the moment."""
        return self._introduced and self._request is None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Keeps what it says."""
        if (msg.get_srcSystem(), msg.get_srcComponent()) != self.target:
            return []
        kind = msg.get_msgId()
        if kind == INFORMATION:
            self.information = msg
        elif kind == SETTINGS:
            self.settings = msg
        elif kind == STORAGE:
            self.storage[msg.storage_id] = msg
        elif kind == CAPTURE_STATUS:
            self._on_capture_status(msg)
        elif kind == STREAM_INFORMATION:
            self.streams[msg.stream_id] = msg
        elif kind == STREAM_STATUS:
            self.stream_status[msg.stream_id] = msg
        elif kind == IMAGE_CAPTURED:
            self._on_image(msg)
        if self._request is not None:
            self._request.on_message(now_us, msg)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for what is not known yet, one message after another."""
        if self._request is None:
            self._request = next(self._questions, None)
            if self._request is None:
                self._introduced = True
                self._request = self._lost_image()
        if self._request is None:
            return []
        messages = self._request.on_time(now_us)
        if self._request.done:
            self._answered(self._request)
            self._request = None
        return messages

    def refresh(self) -> None:
        """Ask again for what changes without being told: settings, storage, capture status."""
        self._questions = self._changing()

    # --- commands -------------------------------------------------------------------------------------------

    def take_image(self) -> Command:
        """One image; sent twice, it is still one.

        Numbers go on from how many images there are: a camera may take the first of this run for the last one's.
        """
        taken = 0 if self.capture_status is None else self.capture_status.image_count
        self._sequence = max(self._sequence, taken) + 1
        return self._command(IMAGE_START_CAPTURE, 0, 0, 1, self._sequence)

    def take_images(self, interval_s: float, count: int = 0) -> Command:
        """A series; count 0: until `stop_images`."""
        if count == 1:
            return self.take_image()
        return self._command(IMAGE_START_CAPTURE, 0, interval_s, count)

    def stop_images(self) -> Command:
        """The end of a series."""
        return self._command(IMAGE_STOP_CAPTURE)

    def start_video(self, status_hz: float = 1.0) -> Command:
        """Record; CAMERA_CAPTURE_STATUS then comes `status_hz` times a second."""
        return self._command(VIDEO_START_CAPTURE, 0, status_hz)

    def stop_video(self) -> Command:
        """The end of a recording."""
        return self._command(VIDEO_STOP_CAPTURE)

    def start_streaming(self, stream: int = 1) -> Command:
        """Send the video of a stream; 0: of all."""
        return self._command(VIDEO_START_STREAMING, stream)

    def stop_streaming(self, stream: int = 1) -> Command:
        """Send it no more."""
        return self._command(VIDEO_STOP_STREAMING, stream)

    def set_mode(self, mode: int) -> Command:
        """IMAGE_MODE or VIDEO_MODE."""
        return self._command(SET_CAMERA_MODE, 0, mode)

    def zoom_to(self, percent: float) -> Command:
        """0 is wide."""
        return self._command(SET_CAMERA_ZOOM, ZOOM_RANGE, percent)

    def focus_to(self, percent: float) -> Command:
        """0 is near."""
        return self._command(SET_CAMERA_FOCUS, FOCUS_RANGE, percent)

    def reset_settings(self) -> Command:
        """All settings to what the maker thought best."""
        return self._command(RESET_CAMERA_SETTINGS, 1)

    def format_storage(self, storage_id: int = 1, *, reset_image_log: bool = False) -> Command:
        """Empties a card; with `reset_image_log`, images are counted from 0 again."""
        if reset_image_log:
            self.images.clear()
            self.capture_status, self._next_index = None, None
            self.refresh()
        return self._command(STORAGE_FORMAT, storage_id, 1, int(reset_image_log))

    def _command(self, number: int, *params: float) -> Command:
        return Command(*self.target, number, params)

    # --- questions --------------------------------------------------------------------------------------------

    def _ask(self, message_id: int, *params: float) -> MessageRequest:
        return MessageRequest(self.target[0], message_id, self.target[1], params)

    def _introduction(self) -> Iterator[MessageRequest]:
        yield self._ask(INFORMATION)
        if self.information is None:
            return
        yield from self._changing()
        if self.information.flags & HAS_VIDEO_STREAM:
            yield self._ask(STREAM_INFORMATION, 0)

    def _changing(self) -> Iterator[MessageRequest]:
        if self.information is not None and self.information.flags & HAS_MODES:
            yield self._ask(SETTINGS)
        yield self._ask(STORAGE, 0)
        yield self._ask(CAPTURE_STATUS)

    def _lost_image(self) -> MessageRequest | None:
        lost = self._next_index
        status = self.capture_status
        if lost is None or status is None:
            return None
        newest = max(status.image_count - 1, max(self.images, default=-1))
        if lost > newest:
            return None
        return MessageRequest(
            self.target[0],
            IMAGE_CAPTURED,
            self.target[1],
            (lost,),
            lambda msg: bool(msg.image_index == lost),
            denied_is_final=True,
        )

    def _answered(self, request: MessageRequest) -> None:
        if request.message_id == INFORMATION and request.message is None:
            self.refusal = request.refusal
        elif request.message_id == IMAGE_CAPTURED and request.message is None and self._next_index is not None:
            self.missed += 1
            self._skip_known(self._next_index + 1)

    # --- what it says -----------------------------------------------------------------------------------------

    def _on_capture_status(self, msg: Any) -> None:
        self.capture_status = msg
        if self._next_index is None:
            self._next_index = msg.image_count
        elif self._next_index > msg.image_count:
            self._next_index = msg.image_count  # the card was emptied
            self.images = {index: image for index, image in self.images.items() if index < msg.image_count}

    def _on_image(self, msg: Any) -> None:
        self.images[msg.image_index] = msg
        if self._next_index is None:
            self._next_index = msg.image_index
        self._skip_known(max(self._next_index, msg.image_index - FORGET_AFTER))

    def _skip_known(self, index: int) -> None:
        while index in self.images:
            index += 1
        self._next_index = index
