"""What is set on a camera: its mode, its zoom and its focus.

https://mavlink.io/en/services/camera.html#camera-modes (SET_CAMERA_MODE, SET_CAMERA_ZOOM, SET_CAMERA_FOCUS). Zoom and
focus are per cent of their ranges: zoom 0 is wide. A zoom to a value, or by a step, is there at once; a continuous one
goes on, at a speed that is ours, to another command or the end of the range. Focus makes no picture sharper.
"""

import math
from dataclasses import dataclass

from sitl_emu.core import dialect as mavlink

ZOOM_STEP_PERCENT = 10.0
ZOOM_PERCENT_S = 20.0
"""Speed of continuous zoom at its full rate."""
ZOOMS = (mavlink.ZOOM_TYPE_STEP, mavlink.ZOOM_TYPE_CONTINUOUS, mavlink.ZOOM_TYPE_RANGE)
AUTOFOCUS = (mavlink.FOCUS_TYPE_AUTO, mavlink.FOCUS_TYPE_AUTO_SINGLE, mavlink.FOCUS_TYPE_AUTO_CONTINUOUS)
"""Accepted, and without effect."""


@dataclass
class Settings:
    """What RESET_CAMERA_SETTINGS puts back."""

    mode: int = mavlink.CAMERA_MODE_IMAGE
    zoom_percent: float = 0.0
    """As of the last `zoom_on`."""
    focus_percent: float = 0.0
    zoom_percent_s: float = 0.0
    """Other than 0 while it zooms."""
    zoomed_us: int = 0

    def set_zoom(self, now_us: int, kind: int, value: float) -> int:
        """SET_CAMERA_ZOOM; the MAV_RESULT."""
        if not math.isfinite(value) or kind not in ZOOMS:
            return mavlink.MAV_RESULT_DENIED
        self.zoom_on(now_us)
        self.zoom_percent_s = 0.0
        if kind == mavlink.ZOOM_TYPE_STEP:
            self._zoom_to(self.zoom_percent + math.copysign(ZOOM_STEP_PERCENT, value))
        elif kind == mavlink.ZOOM_TYPE_RANGE:
            self._zoom_to(value)
        else:
            self.zoom_percent_s = max(-1.0, min(1.0, value)) * ZOOM_PERCENT_S
        return mavlink.MAV_RESULT_ACCEPTED

    def zoom_on(self, now_us: int) -> None:
        """Let a continuous zoom go on since the last look, to the end of the range."""
        wished = self.zoom_percent + self.zoom_percent_s * (now_us - self.zoomed_us) * 1e-6
        self._zoom_to(wished)
        if self.zoom_percent != wished:
            self.zoom_percent_s = 0.0
        self.zoomed_us = now_us

    def set_focus(self, kind: int, value: float) -> int:
        """SET_CAMERA_FOCUS; the MAV_RESULT."""
        if kind == mavlink.FOCUS_TYPE_RANGE and math.isfinite(value):
            self.focus_percent = max(0.0, min(100.0, value))
        elif kind not in AUTOFOCUS:
            return mavlink.MAV_RESULT_DENIED
        return mavlink.MAV_RESULT_ACCEPTED

    def _zoom_to(self, percent: float) -> None:
        self.zoom_percent = max(0.0, min(100.0, percent))
