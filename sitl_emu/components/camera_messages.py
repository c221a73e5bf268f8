"""What a camera says of itself, as messages, from its data and its state (https://mavlink.io/en/services/camera.html)."""

import math
from typing import Any

from sitl_emu.components.camera_settings import Settings
from sitl_emu.components.component import text
from sitl_emu.components.geotag import Geotag
from sitl_emu.components.image_capture import ImageCapture
from sitl_emu.components.storage import Storage
from sitl_emu.components.video_recording import VideoRecording
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData
from sitl_emu.vehicles.description import zoomed

CAPABILITIES = (
    mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    | mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    | mavlink.CAMERA_CAP_FLAGS_HAS_MODES
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
    | mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_FOCUS
)
FIRMWARE_VERSION = 1
UNKNOWN = 0x7FFFFFFF
IMAGE_IN_PROGRESS, INTERVAL_SET = 1, 2
"""Bits of CAMERA_CAPTURE_STATUS.image_status."""


def camera_information(now_us: int, data: CameraData, gimbal_device_id: int, *, streams: bool) -> Any:
    """CAMERA_INFORMATION; `streams`: whether it has a video stream."""
    zooms = mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM if data.zoom_max > 1.0 else 0
    stream = mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM if streams else 0
    return mavlink.MAVLink_camera_information_message(
        now_us // 1000,
        _padded(data.vendor, 32),
        _padded(data.model, 32),
        FIRMWARE_VERSION,
        data.focal_length_mm,
        data.sensor_width_mm,
        data.sensor_height_mm,
        data.resolution_h_px,
        data.resolution_v_px,
        0,
        CAPABILITIES | zooms | stream,
        0,
        b"",
        gimbal_device_id,
    )


def camera_settings(now_us: int, data: CameraData, settings: Settings) -> Any:
    """CAMERA_SETTINGS."""
    zoom = settings.zoom.percent if data.zoom_max > 1.0 else math.nan
    return mavlink.MAVLink_camera_settings_message(now_us // 1000, settings.mode, zoom, settings.focus.percent)


def camera_capture_status(now_us: int, images: ImageCapture, recording: VideoRecording, storage: Storage) -> Any:
    """CAMERA_CAPTURE_STATUS."""
    return mavlink.MAVLink_camera_capture_status_message(
        now_us // 1000,
        IMAGE_IN_PROGRESS * images.waits_for_geotag + INTERVAL_SET * images.goes_on,
        int(recording.running),
        images.interval_s,
        recording.recorded_ms(now_us),
        max(storage.free_mib - recording.recorded_mib(now_us), 0.0),
        images.count,
    )


def storage_information(now_us: int, storage: Storage, recording: VideoRecording) -> Any:
    """STORAGE_INFORMATION."""
    used_mib = storage.used_mib + recording.recorded_mib(now_us)
    usage = mavlink.STORAGE_USAGE_FLAG_SET | mavlink.STORAGE_USAGE_FLAG_PHOTO | mavlink.STORAGE_USAGE_FLAG_VIDEO
    return mavlink.MAVLink_storage_information_message(
        now_us // 1000,
        1,
        1,
        mavlink.STORAGE_STATUS_READY,
        storage.size_mib,
        used_mib,
        storage.size_mib - used_mib,
        math.nan,
        math.nan,
        mavlink.STORAGE_TYPE_SD,
        text("camera", 32),
        usage,
    )


def camera_fov_status(now_us: int, data: CameraData, settings: Settings, tag: Geotag) -> Any:
    """CAMERA_FOV_STATUS: where the camera is and looks; what lies in the middle of its image is not known here."""
    return mavlink.MAVLink_camera_fov_status_message(
        now_us // 1000, tag.lat, tag.lon, tag.alt, UNKNOWN, UNKNOWN, UNKNOWN, tag.q, *fov_deg(data, settings)
    )


def fov_deg(data: CameraData, settings: Settings) -> tuple[float, float]:
    """Horizontal and vertical field of view at the zoom that is set."""
    focal_length_mm = data.focal_length_mm * zoomed(data.zoom_max, settings.zoom.percent)
    horizontal, vertical = (
        math.degrees(2.0 * math.atan(size_mm / 2.0 / focal_length_mm))
        for size_mm in (data.sensor_width_mm, data.sensor_height_mm)
    )
    return horizontal, vertical


def _padded(value: str, size: int) -> list[int]:
    """A uint8[] field that holds text."""
    return list(text(value, size).ljust(size, b"\0"))
