"""A camera that speaks the MAVLink camera protocol v2: component 100, a state machine on simulated time.

https://mavlink.io/en/services/camera.html. An image is its CAMERA_IMAGE_CAPTURED record, with the position and attitude
that the autopilot, asked at that moment, gave (GLOBAL_POSITION_INT, ATTITUDE_QUATERNION). Nothing is rendered here:
where somebody does that (`card`), he is asked for a picture when the shutter opens (`triggers`), and the record, which
then names a file, is told when that is there. So with video: the camera announces, starts and stops what somebody else
sends. Settings, modes, storage and the counting of images behave as on a real camera.

Here are the wire, the commands and what is told when. The state is in modules of its own: `image_capture.py`,
`video_recording.py`, `storage.py`, `camera_settings.py`, `video_stream.py`.
"""

from collections.abc import Callable
from typing import Any

from sitl_emu.components.camera_messages import (
    camera_capture_status,
    camera_fov_status,
    camera_information,
    camera_settings,
    fov_deg,
    storage_information,
)
from sitl_emu.components.camera_settings import Settings
from sitl_emu.components.component import COMMANDS, Command, Component
from sitl_emu.components.geotag import ATTITUDE, GIMBAL_ATTITUDE, POSITION, SYSTEM_TIME, CameraPose
from sitl_emu.components.image_capture import ImageCapture, PictureFiles
from sitl_emu.components.storage import Storage
from sitl_emu.components.video_recording import VideoRecording
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED: int = mavlink.MAV_RESULT_DENIED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
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
BY_THEMSELVES = frozenset({SETTINGS, STORAGE, CAPTURE_STATUS, FOV_STATUS, INFORMATION})
"""Messages that SET_MESSAGE_INTERVAL may ask for."""
ANYBODYS = frozenset({mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL})
"""Commands that, sent to all components, concern the camera only if they are about a message of its own."""
NOTHING_ASKED = Command(0, (0.0, 0.0, 0.0, 0.0), 0, 0, False)
ZOOM_UPDATE_US = 100_000


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
        self._data, self.video = data, video
        self.triggers: list[int] = []
        """Numbers of pictures that are to be drawn as the camera sees now; emptied by who draws them."""
        self._component = Component(system_id, mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_TYPE_CAMERA)
        self._gimbal = gimbal_device_id
        self._wanted = self.WANTED | {GIMBAL_ATTITUDE} if gimbal_device_id else self.WANTED
        self.outbox = self._component.outbox
        self.due_us = 0
        self._pose = CameraPose(data.mount)
        self._settings = Settings()
        self._storage = Storage(data.storage_mib)
        self._images = ImageCapture(data, self._storage, card)
        self._recording = VideoRecording(self._storage, data.video_mib_s)
        self._intervals: dict[int, tuple[int, int]] = {}
        """Messages sent by themselves (SET_MESSAGE_INTERVAL): interval and when they are due."""
        self._messages: dict[int, Callable[[int, Command], Any]] = {
            INFORMATION: lambda now_us, _: self._information(now_us),
            SETTINGS: lambda now_us, _: self._camera_settings(now_us),
            STORAGE: lambda now_us, _: self._storage_information(now_us),
            CAPTURE_STATUS: lambda now_us, _: self._capture_status(now_us),
            IMAGE_CAPTURED: lambda _, command: self._images.record(command.whole(2)),
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
        self._tell(now_us, self._images.picture_taken(number, ok))

    def zoom_percent(self, now_us: int) -> float:
        """How far it has zoomed at a time: 0 is wide; where it can't, too."""
        self._settings.move(now_us)
        return self._settings.zoom.percent

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
        if self._images.is_overdue(now_us):
            self._keep_image(now_us)
        if self._images.is_due(now_us):
            self._take_image(now_us)
        if now_us >= self._recording.full_us:
            self._end_recording(now_us)
        if now_us >= self._recording.status_due_us:
            self._recording.status_told(now_us)
            self._send(self._capture_status(now_us))
        self._settings.move(now_us)
        if self._settings.zoom.percent_s:
            due_us = min(due_us, now_us + ZOOM_UPDATE_US)
        for message_id, (interval_us, at_us) in tuple(self._intervals.items()):
            if now_us >= at_us:
                at_us = now_us + interval_us
                self._intervals[message_id] = (interval_us, at_us)
                self._send(self._messages[message_id](now_us, NOTHING_ASKED))
                if message_id == FOV_STATUS:
                    self._ask_where()
            due_us = min(due_us, at_us)
        self.due_us = min(due_us, self._images.due_us, self._recording.status_due_us, self._recording.full_us)

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
        if message.get_msgId() == ATTITUDE and self._images.waits_for_geotag:
            self._keep_image(now_us)

    # --- images ---------------------------------------------------------------------------------------------

    def _image_start_capture(self, now_us: int, command: Command) -> int:
        result = self._images.start(now_us, command, self._free_mib(now_us))
        if result != ACCEPTED:
            return result
        if self._images.is_due(now_us):
            self._take_image(now_us)
        if command.whole(3) != 1:
            # As when a video begins: clients that poll every few seconds (MAVSDK: 5 s) know of the series at once
            self._send(self._capture_status(now_us))
        return ACCEPTED

    def _image_stop_capture(self, now_us: int, command: Command) -> int:
        went_on = self._images.goes_on
        self._images.stop()
        if went_on:
            self._send(self._capture_status(now_us))
        return ACCEPTED

    def _take_image(self, now_us: int) -> None:
        """Open the shutter, and ask the autopilot where that is."""
        if self._images.waits_for_geotag:
            self._keep_image(now_us)
        if not self._images.open_shutter(now_us, self._free_mib(now_us)):
            self._send(self._capture_status(now_us))
            return
        number = self._images.next_picture()
        if number is not None:
            self.triggers.append(number)
        self._pose.forget()
        self._ask_where()

    def _ask_where(self) -> None:
        if not self._pose.boot_unix_us:
            self._component.ask_autopilot(SYSTEM_TIME)
        self._component.ask_autopilot(POSITION)
        self._component.ask_autopilot(ATTITUDE)

    def _keep_image(self, now_us: int) -> None:
        self._tell(now_us, self._images.keep(self._pose.geotag(), self._pose.boot_unix_us))

    def _tell(self, now_us: int, record: Any) -> None:
        """The record of an image; None: it is not there yet."""
        if record is not None:
            self._send(record)
            self.due_us = now_us

    def _request_image(self, now_us: int, command: Command) -> int:
        image = self._images.record(command.whole(1))
        self._send(image)
        return DENIED if image is None else ACCEPTED

    # --- video ----------------------------------------------------------------------------------------------

    def _video_start_capture(self, now_us: int, command: Command) -> int:
        if self._settings.mode != MODE_VIDEO:
            return DENIED
        result = self._recording.start(now_us, command)
        if result == ACCEPTED and self._recording.status_due_us > now_us:
            self._send(self._capture_status(now_us))
        return result

    def _video_stop_capture(self, now_us: int, command: Command) -> int:
        if self._recording.running:
            self._end_recording(now_us)
        return ACCEPTED

    def _end_recording(self, now_us: int) -> None:
        self._recording.stop(now_us)
        self._send(self._capture_status(now_us))

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
        if self._recording.running or self._images.goes_on:
            return TEMPORARILY_REJECTED
        self._settings.mode = mode
        return self._settings_told(now_us, ACCEPTED)

    def _set_camera_zoom(self, now_us: int, command: Command) -> int:
        if not self.zooms:
            return UNSUPPORTED
        return self._settings_told(now_us, self._settings.zoom.set(now_us, command.whole(1), command.params[1]))

    def _set_camera_focus(self, now_us: int, command: Command) -> int:
        return self._settings_told(now_us, self._settings.set_focus(now_us, command.whole(1), command.params[1]))

    def _reset_camera_settings(self, now_us: int, command: Command) -> int:
        if command.whole(1) != 1:
            return DENIED
        if self._recording.running or self._images.goes_on:
            return TEMPORARILY_REJECTED
        self._settings = Settings()
        return self._settings_told(now_us, ACCEPTED)

    def _settings_told(self, now_us: int, result: int) -> int:
        """The result of a command about the settings; they are told where it was accepted."""
        if result == ACCEPTED:
            self._send(self._camera_settings(now_us))
        return result

    def _storage_format(self, now_us: int, command: Command) -> int:
        if command.whole(1) not in (0, 1) or command.whole(2) != 1:
            return DENIED
        if self._recording.running or self._images.goes_on or self._images.waits:
            return TEMPORARILY_REJECTED
        self._storage.used_mib = 0.0
        self._images.forget(count=command.whole(3) == 1)
        self._send(self._storage_information(now_us))
        return ACCEPTED

    def _free_mib(self, now_us: int) -> float:
        return self._storage.free_mib - self._recording.recorded_mib(now_us)

    # --- messages asked for -----------------------------------------------------------------------------------

    def _request_message(self, now_us: int, command: Command) -> int:
        make = self._messages.get(command.whole(1))
        message = None if make is None else make(now_us, command)
        if message is None:
            return UNSUPPORTED if make is None else DENIED
        self._send(message)
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
        self._settings.move(now_us)
        return camera_settings(now_us, self._data, self._settings)

    def _storage_information(self, now_us: int) -> Any:
        return storage_information(now_us, self._storage, self._recording)

    def _capture_status(self, now_us: int) -> Any:
        return camera_capture_status(now_us, self._images, self._recording, self._storage)

    def _stream_information(self, stream: int) -> Any:
        return None if self.video is None else self.video.information(self._data, self._hfov_deg, stream)

    def _stream_status(self, stream: int) -> Any:
        return None if self.video is None else self.video.status(self._data, self._hfov_deg, stream)

    @property
    def _hfov_deg(self) -> float:
        return fov_deg(self._data, self._settings)[0]

    def _fov_status(self, now_us: int) -> Any:
        return camera_fov_status(now_us, self._data, self._settings, self._pose.geotag())
