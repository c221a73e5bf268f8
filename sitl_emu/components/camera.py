"""A camera that speaks the MAVLink camera protocol v2: component 100, a state machine on simulated time.

https://mavlink.io/en/services/camera.html. An image is its CAMERA_IMAGE_CAPTURED record, with the position and attitude
that the autopilot, asked at that moment, gave (GLOBAL_POSITION_INT, ATTITUDE_QUATERNION). Nothing is rendered here:
where somebody does that (`card`), he is asked for a picture when the shutter opens (`triggers`), and the record, which
then names a file, is told when that is there. So with video: the camera announces, starts and stops what somebody else
sends. Settings, modes, storage and the counting of images behave as on a real camera; a command that is repeated with
the same sequence number takes no second image.
"""

import math
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from sitl_emu.components.camera_messages import (
    Settings,
    camera_fov_status,
    camera_information,
    camera_settings,
    fov_deg,
    storage_information,
)
from sitl_emu.components.component import COMMANDS, Command, Component
from sitl_emu.components.geotag import ATTITUDE, GIMBAL_ATTITUDE, POSITION, SYSTEM_TIME, CameraPose, Geotag
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED: int = mavlink.MAV_RESULT_DENIED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
FAILED: int = mavlink.MAV_RESULT_FAILED
MODE_IMAGE: int = mavlink.CAMERA_MODE_IMAGE
MODE_VIDEO: int = mavlink.CAMERA_MODE_VIDEO

INFORMATION = mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION
SETTINGS = mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS
STORAGE = mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION
CAPTURE_STATUS = mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS
IMAGE_CAPTURED = mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED
STREAM_INFORMATION = mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
STREAM_STATUS = mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS
FOV_STATUS = mavlink.MAVLINK_MSG_ID_CAMERA_FOV_STATUS

CAPTURED, NOT_CAPTURED = 1, 0
NO_FILE = b""
KEPT_IMAGES = 1000
"""Records of the newest images, for who asks again (MAV_CMD_REQUEST_MESSAGE with their index)."""
GEOTAG_LIMIT_US = 200_000
"""An autopilot that has not answered by then gives no geotag."""
ZOOM_STEP_PERCENT = 10.0
ZOOM_PERCENT_S = 20.0
"""Speed of continuous zoom at its full rate."""
ZOOM_UPDATE_US = 100_000
NEVER_US = 1 << 62


class PictureFiles(Protocol):
    """A card (`card.Card`)."""

    def next_number(self) -> int: ...  # noqa: D102
    def url(self, number: int) -> bytes: ...  # noqa: D102
    def tag(self, number: int, tag: Geotag, utc_us: int) -> None: ...  # noqa: D102


class Camera:
    """The camera of one vehicle."""

    WANTED = COMMANDS | {POSITION, ATTITUDE, SYSTEM_TIME}

    def __init__(
        self,
        data: CameraData,
        system_id: int,
        gimbal_device_id: int = 0,
        card: PictureFiles | None = None,
        video: VideoStream | None = None,
    ) -> None:
        """`system_id` is the vehicle's; `gimbal_device_id` is the gimbal that carries it, 0 for none.

        `card`: where pictures are kept; None: there are none. `video`: its stream; None: it has none.
        """
        self._data, self._card, self.video = data, card, video
        self.triggers: list[int] = []
        """Numbers of pictures that are to be drawn as the camera sees now; emptied by who draws them."""
        self._exposed = 0
        """The number of the picture whose record is in the making, 0 for none."""
        self._drawn: dict[int, bool] = {}
        """Pictures that are there (or could not be drawn) before their records."""
        self._undrawn: dict[int, tuple[Any, Geotag]] = {}
        """Records that wait for their pictures."""
        self._component = Component(system_id, mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_TYPE_CAMERA)
        self._gimbal = gimbal_device_id
        self._wanted = self.WANTED | {GIMBAL_ATTITUDE} if gimbal_device_id else self.WANTED
        self.outbox = self._component.outbox
        self.due_us = 0
        self._settings = Settings()
        self._zoom_rate = 0.0
        self._zoomed_us = 0
        self._used_mib = 0.0
        self._image_count = 0
        self._images: deque[Any] = deque(maxlen=KEPT_IMAGES)
        self._interval_s = 0.0
        self._left: int | None = 0
        """Images still to be taken at the interval; None is without end."""
        self._next_us = NEVER_US
        self._last_numbered = (0, 0, 0)
        """Who asked for the last numbered image, and its number."""
        self._asked_us = NEVER_US
        """When the autopilot was asked where the image in the making is taken."""
        self._ready_us = 0
        self._recording_since_us: int | None = None
        self._status_every_us = 0
        self._status_us = NEVER_US
        self._pose = CameraPose(data.mount)
        self._intervals: dict[int, tuple[int, int]] = {}
        """Messages sent by themselves (SET_MESSAGE_INTERVAL): interval and when they are due."""
        self._messages: dict[int, Callable[[int, Command], Any]] = {
            INFORMATION: lambda now_us, _: self._information(now_us),
            SETTINGS: lambda now_us, _: self._camera_settings(now_us),
            STORAGE: lambda now_us, _: self._storage(now_us),
            CAPTURE_STATUS: lambda now_us, _: self._capture_status(now_us),
            IMAGE_CAPTURED: lambda _, command: self._image(command.whole(2)),
            STREAM_INFORMATION: lambda _, command: self._stream_information(command.whole(2)),
            STREAM_STATUS: lambda _, command: self._stream_status(command.whole(2)),
            FOV_STATUS: lambda now_us, _: self._fov_status(now_us),
        }
        self._commands: dict[int, Callable[[int, Command], int]] = {
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_message_interval,
            mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: self._old_request(INFORMATION, 1),
            mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS: self._old_request(SETTINGS, 1),
            mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION: self._old_request(STORAGE, 2),
            mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: self._old_request(CAPTURE_STATUS, 1),
            mavlink.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE: self._request_image,
            mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION: self._request_stream,
            mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS: self._request_stream,
            mavlink.MAV_CMD_RESET_CAMERA_SETTINGS: self._reset_camera_settings,
            mavlink.MAV_CMD_STORAGE_FORMAT: self._storage_format,
            mavlink.MAV_CMD_SET_CAMERA_MODE: self._set_camera_mode,
            mavlink.MAV_CMD_SET_CAMERA_ZOOM: self._set_camera_zoom,
            mavlink.MAV_CMD_SET_CAMERA_FOCUS: self._set_camera_focus,
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._image_start_capture,
            mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: self._image_stop_capture,
            mavlink.MAV_CMD_VIDEO_START_CAPTURE: self._video_start_capture,
            mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: self._video_stop_capture,
            mavlink.MAV_CMD_VIDEO_START_STREAMING: self._set_streaming,
            mavlink.MAV_CMD_VIDEO_STOP_STREAMING: self._set_streaming,
        }

    # --- the wire -------------------------------------------------------------------------------------------

    def on_datagram(self, now_us: int, data: bytes) -> None:
        """What came from the autopilot's end of the wire."""
        for message in self._component.messages(data, self._wanted):
            message_id = message.get_msgId()
            if message_id in COMMANDS:
                self._on_command(now_us, message)
            elif message_id == GIMBAL_ATTITUDE:
                self._pose.on_message(message)
            elif message.get_srcComponent() == mavlink.MAV_COMP_ID_AUTOPILOT1:
                self._on_autopilot(now_us, message)

    def picture_taken(self, now_us: int, number: int, ok: bool) -> None:
        """A picture that was asked for is on the card; or not `ok`: there will be none. Raises OSError."""
        if number in self._undrawn:
            self._tell(now_us, *self._undrawn.pop(number), number, ok)
        elif number == self._exposed:
            self._drawn[number] = ok

    def zoom_percent(self, now_us: int) -> float:
        """How far it has zoomed at a time: 0 is wide; where it can't, too."""
        if self._zoom_rate:
            self._zoom_on(now_us)
        return self._settings.zoom_percent

    @property
    def zooms(self) -> bool:
        """Whether it can."""
        return self._data.zoom_max > 1.0

    def keep_alive(self, clock_s: float) -> None:
        """See Component.keep_alive."""
        self._component.keep_alive(clock_s)

    def on_time(self, now_us: int) -> None:
        """Heartbeat, and what is due."""
        due_us = self._component.beat(now_us)
        if now_us - self._asked_us >= GEOTAG_LIMIT_US:
            self._keep_image(now_us)
        if now_us >= self._next_us:
            self._take_next(now_us)
        if now_us >= self._status_us:
            self._status_us = now_us + self._status_every_us
            self._send(self._capture_status(now_us))
        if self._zoom_rate:
            self._zoom_on(now_us)
            due_us = min(due_us, now_us + ZOOM_UPDATE_US)
        for message_id, (interval_us, at_us) in tuple(self._intervals.items()):
            if now_us >= at_us:
                at_us = now_us + interval_us
                self._intervals[message_id] = (interval_us, at_us)
                self._send(self._messages[message_id](now_us, NOTHING_ASKED))
                if message_id == FOV_STATUS:
                    self._ask_where()
            due_us = min(due_us, at_us)
        waiting_us = self._asked_us + GEOTAG_LIMIT_US if self._asked_us != NEVER_US else NEVER_US
        self.due_us = min(due_us, self._next_us, self._status_us, waiting_us)

    def _send(self, message: Any) -> None:
        if message is not None:
            self._component.send(message)

    def _on_command(self, now_us: int, message: Any) -> None:
        command = self._component.command(message)
        if command is None:
            return
        handler = self._commands.get(command.number)
        if handler is None:
            if command.addressed:
                self._component.acknowledge(command, UNSUPPORTED)
            return
        if not command.addressed and command.number in ANYBODYS and command.whole(1) not in self._messages:
            return
        # The answer first, and then what it brings about
        before = len(self.outbox)
        result = handler(now_us, command)
        brought_about = self.outbox[before:]
        del self.outbox[before:]
        self._component.acknowledge(command, result)
        self.outbox.extend(brought_about)
        self.due_us = now_us

    def _on_autopilot(self, now_us: int, message: Any) -> None:
        self._pose.on_message(message)
        # The attitude is asked for last, so now everything is there
        if message.get_msgId() == ATTITUDE and self._asked_us != NEVER_US:
            self._keep_image(now_us)

    # --- images ---------------------------------------------------------------------------------------------

    def _image_start_capture(self, now_us: int, command: Command) -> int:
        interval_s = command.params[1] if math.isfinite(command.params[1]) else 0.0
        count, sequence = command.whole(3), command.whole(4)
        if count < 0 or interval_s < 0.0:
            return DENIED
        numbered = (command.source_system, command.source_component, sequence if count == 1 else 0)
        if numbered[2] > 0 and numbered == self._last_numbered:
            return ACCEPTED
        if self._taking or (count == 1 and now_us < self._ready_us):
            return TEMPORARILY_REJECTED
        if self._free_mib < self._data.image_mib:
            return FAILED
        if count != 1:
            self._interval_s = max(interval_s, self._data.interval_min_s)
        self._last_numbered = numbered
        self._left = count or None
        if now_us < self._ready_us:
            self._next_us = self._ready_us
        else:
            self._take_next(now_us)
        if count != 1:
            # As when a video begins: clients that poll every few seconds (MAVSDK: 5 s) know of the series at once
            self._send(self._capture_status(now_us))
        return ACCEPTED

    def _image_stop_capture(self, now_us: int, command: Command) -> int:
        was_taking = self._next_us != NEVER_US
        self._stop_interval()
        if was_taking:
            self._send(self._capture_status(now_us))
        return ACCEPTED

    @property
    def _taking(self) -> bool:
        return self._next_us != NEVER_US or self._asked_us != NEVER_US

    def _stop_interval(self) -> None:
        self._next_us, self._interval_s, self._left = NEVER_US, 0.0, 0

    def _take_next(self, now_us: int) -> None:
        """Open the shutter, and ask the autopilot where that is."""
        if self._asked_us != NEVER_US:
            self._keep_image(now_us)
        if self._free_mib < self._data.image_mib:
            self._stop_interval()
            self._send(self._capture_status(now_us))
            return
        if self._left is not None:
            self._left -= 1
        self._next_us = NEVER_US if self._left == 0 else now_us + round(self._interval_s * 1e6)
        if self._left == 0:
            self._interval_s = 0.0
        self._pose.forget()
        if self._card is not None:
            self._exposed = self._card.next_number()
            self.triggers.append(self._exposed)
        self._asked_us = now_us
        self._ready_us = now_us + round(self._data.interval_min_s * 1e6)
        self._ask_where()

    def _ask_where(self) -> None:
        if not self._pose.boot_unix_us:
            self._component.ask_autopilot(SYSTEM_TIME)
        self._component.ask_autopilot(POSITION)
        self._component.ask_autopilot(ATTITUDE)

    def _keep_image(self, now_us: int) -> None:
        """The image is there: count it, keep its record and tell it."""
        taken_us, self._asked_us = self._asked_us, NEVER_US
        self._used_mib += self._data.image_mib
        self._image_count += 1
        tag, boot_unix_us = self._pose.geotag(), self._pose.boot_unix_us
        utc_us = boot_unix_us + taken_us if boot_unix_us else 0
        time_ms, index = taken_us // 1000, self._image_count - 1
        number = self._exposed
        url = NO_FILE if self._card is None else self._card.url(number)
        image = mavlink.MAVLink_camera_image_captured_message(time_ms, utc_us, 0, *tag, index, CAPTURED, url)
        if self._card is not None and number not in self._drawn:
            self._undrawn[number] = (image, tag)
        else:
            self._tell(now_us, image, tag, number, self._drawn.pop(number, True))

    def _tell(self, now_us: int, image: Any, tag: Geotag, number: int, ok: bool) -> None:
        """The record of an image whose picture is there, or which has none."""
        if not ok:
            index, where = image.image_index, (image.lat, image.lon, image.alt, image.relative_alt, image.q)
            image = mavlink.MAVLink_camera_image_captured_message(
                image.time_boot_ms, image.time_utc, 0, *where, index, NOT_CAPTURED, NO_FILE
            )
        elif self._card is not None:
            self._card.tag(number, tag, image.time_utc)
        self._images.append(image)
        self._send(image)
        self.due_us = now_us

    def _image(self, index: int) -> Any:
        if not self._images:
            return None
        at = index - self._images[0].image_index
        return self._images[at] if 0 <= at < len(self._images) else None

    def _request_image(self, now_us: int, command: Command) -> int:
        image = self._image(command.whole(1))
        self._send(image)
        return DENIED if image is None else ACCEPTED

    # --- video ----------------------------------------------------------------------------------------------

    def _video_start_capture(self, now_us: int, command: Command) -> int:
        if self._settings.mode != MODE_VIDEO:
            return DENIED
        if self._recording_since_us is not None:
            return TEMPORARILY_REJECTED
        if self._free_mib <= 0.0:
            return FAILED
        self._recording_since_us = now_us
        every_hz = command.params[1]
        if math.isfinite(every_hz) and every_hz > 0.0:
            self._status_every_us = max(round(1e6 / every_hz), 1)
            self._status_us = now_us
        else:
            self._send(self._capture_status(now_us))
        return ACCEPTED

    def _video_stop_capture(self, now_us: int, command: Command) -> int:
        if self._recording_since_us is not None:
            self._used_mib += min(self._recorded_mib(now_us), self._free_mib)
            self._recording_since_us = None
            self._status_us = NEVER_US
            self._send(self._capture_status(now_us))
        return ACCEPTED

    def _recorded_mib(self, now_us: int) -> float:
        since_us = self._recording_since_us
        return 0.0 if since_us is None else (now_us - since_us) * 1e-6 * self._data.video_mib_s

    def _set_streaming(self, now_us: int, command: Command) -> int:
        if self.video is None:
            return UNSUPPORTED
        starts = command.number == mavlink.MAV_CMD_VIDEO_START_STREAMING
        result = self.video.set_running(command.whole(1), starts)
        if result == ACCEPTED:
            self._send(self._stream_status(0))
        return result

    # --- settings and storage -------------------------------------------------------------------------------

    def _set_camera_mode(self, now_us: int, command: Command) -> int:
        mode = command.whole(2)
        if mode not in (MODE_IMAGE, MODE_VIDEO):
            return DENIED
        if self._recording_since_us is not None or self._next_us != NEVER_US:
            return TEMPORARILY_REJECTED
        self._settings.mode = mode
        self._send(self._camera_settings(now_us))
        return ACCEPTED

    def _set_camera_zoom(self, now_us: int, command: Command) -> int:
        if not self.zooms:
            return UNSUPPORTED
        kind, value = command.whole(1), command.params[1]
        if not math.isfinite(value):
            return DENIED
        self._zoom_on(now_us)
        self._zoom_rate = 0.0
        if kind == mavlink.ZOOM_TYPE_STEP:
            self._zoom_to(self._settings.zoom_percent + math.copysign(ZOOM_STEP_PERCENT, value))
        elif kind == mavlink.ZOOM_TYPE_CONTINUOUS:
            self._zoom_rate = max(-1.0, min(1.0, value)) * ZOOM_PERCENT_S
        elif kind == mavlink.ZOOM_TYPE_RANGE:
            self._zoom_to(value)
        else:
            return DENIED
        self._send(self._camera_settings(now_us))
        return ACCEPTED

    def _zoom_on(self, now_us: int) -> None:
        self._zoom_to(self._settings.zoom_percent + self._zoom_rate * (now_us - self._zoomed_us) * 1e-6)
        self._zoomed_us = now_us

    def _zoom_to(self, percent: float) -> None:
        self._settings.zoom_percent = max(0.0, min(100.0, percent))

    def _set_camera_focus(self, now_us: int, command: Command) -> int:
        kind, value = command.whole(1), command.params[1]
        if kind == mavlink.FOCUS_TYPE_RANGE and math.isfinite(value):
            self._settings.focus_percent = max(0.0, min(100.0, value))
        elif kind not in (mavlink.FOCUS_TYPE_AUTO, mavlink.FOCUS_TYPE_AUTO_SINGLE, mavlink.FOCUS_TYPE_AUTO_CONTINUOUS):
            return DENIED
        self._send(self._camera_settings(now_us))
        return ACCEPTED

    def _reset_camera_settings(self, now_us: int, command: Command) -> int:
        if command.whole(1) != 1:
            return DENIED
        if self._recording_since_us is not None or self._next_us != NEVER_US:
            return TEMPORARILY_REJECTED
        self._settings, self._zoom_rate = Settings(), 0.0
        self._send(self._camera_settings(now_us))
        return ACCEPTED

    def _storage_format(self, now_us: int, command: Command) -> int:
        if command.whole(1) not in (0, 1) or command.whole(2) != 1:
            return DENIED
        if self._recording_since_us is not None or self._taking:
            return TEMPORARILY_REJECTED
        self._used_mib = 0.0
        if command.whole(3) == 1:
            self._image_count = 0
        self._images.clear()
        self._send(self._storage(now_us))
        return ACCEPTED

    @property
    def _free_mib(self) -> float:
        return self._data.storage_mib - self._used_mib

    # --- messages asked for -----------------------------------------------------------------------------------

    def _request_message(self, now_us: int, command: Command) -> int:
        make = self._messages.get(command.whole(1))
        message = None if make is None else make(now_us, command)
        if message is None:
            return UNSUPPORTED if make is None else DENIED
        for each in message if isinstance(message, list) else [message]:
            self._send(each)
        return ACCEPTED

    def _set_message_interval(self, now_us: int, command: Command) -> int:
        message_id, interval_us = command.whole(1), command.whole(2)
        if message_id not in BY_THEMSELVES:
            return UNSUPPORTED
        if interval_us > 0:
            self._intervals[message_id] = (interval_us, now_us)
        else:
            self._intervals.pop(message_id, None)
        return ACCEPTED

    def _old_request(self, message_id: int, asks: int) -> Callable[[int, Command], int]:
        """The command that asked for a message before REQUEST_MESSAGE did: parameter `asks` must be 1."""

        def handle(now_us: int, command: Command) -> int:
            if command.whole(asks) == 1:
                self._send(self._messages[message_id](now_us, command))
            return ACCEPTED

        return handle

    def _request_stream(self, now_us: int, command: Command) -> int:
        make = self._stream_information
        if command.number == mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS:
            make = self._stream_status
        message = make(command.whole(1))
        self._send(message)
        return DENIED if message is None else ACCEPTED

    # --- messages ---------------------------------------------------------------------------------------------

    def _information(self, now_us: int) -> Any:
        return camera_information(now_us, self._data, self._gimbal, streams=self.video is not None)

    def _camera_settings(self, now_us: int) -> Any:
        if self._zoom_rate:
            self._zoom_on(now_us)
        return camera_settings(now_us, self._data, self._settings)

    def _storage(self, now_us: int) -> Any:
        used_mib = self._used_mib + min(self._recorded_mib(now_us), self._free_mib)
        return storage_information(now_us, self._data, used_mib)

    def _capture_status(self, now_us: int) -> Any:
        recording_ms = 0 if self._recording_since_us is None else (now_us - self._recording_since_us) // 1000
        image_status = (self._asked_us != NEVER_US) + 2 * (self._next_us != NEVER_US)
        return mavlink.MAVLink_camera_capture_status_message(
            now_us // 1000,
            image_status,
            int(self._recording_since_us is not None),
            self._interval_s,
            recording_ms,
            max(self._free_mib - self._recorded_mib(now_us), 0.0),
            self._image_count,
        )

    def _stream_information(self, stream: int) -> Any:
        return None if self.video is None else self.video.information(self._data, self._hfov_deg, stream)

    def _stream_status(self, stream: int) -> Any:
        return None if self.video is None else self.video.status(self._data, self._hfov_deg, stream)

    @property
    def _hfov_deg(self) -> float:
        return fov_deg(self._data, self._settings)[0]

    def _fov_status(self, now_us: int) -> Any:
        return camera_fov_status(now_us, self._data, self._settings, self._pose.geotag())


BY_THEMSELVES = frozenset({SETTINGS, STORAGE, CAPTURE_STATUS, FOV_STATUS, INFORMATION})
ANYBODYS = frozenset({mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL})
"""Commands that, sent to all components, concern the camera only if they are about a message of its own."""
NOTHING_ASKED = Command(0, (0.0, 0.0, 0.0, 0.0), 0, 0, False)
