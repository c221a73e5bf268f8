"""What is set on a camera: its mode, its zoom and its focus.

https://mavlink.io/en/services/camera.html#camera-modes (SET_CAMERA_MODE, SET_CAMERA_ZOOM, SET_CAMERA_FOCUS). Zoom and
focus are per cent of their ranges: zoom 0 is wide, focus 0 is near. One to a value, or by a step, is there at once; a
continuous one goes on, at a speed that is ours, to another command or the end of the range. Focus makes no picture
sharper.
"""

import math
from dataclasses import dataclass, field

from sitl_emu.core import dialect as mavlink

STEP_PERCENT = 10.0
PERCENT_S = 20.0
"""Speed of a continuous zoom or focus at its full rate."""
STEP, CONTINUOUS, RANGE = mavlink.ZOOM_TYPE_STEP, mavlink.ZOOM_TYPE_CONTINUOUS, mavlink.ZOOM_TYPE_RANGE
"""FOCUS_TYPE's first three are the same numbers. -1 goes to wide and near, 1 to tele and far."""
AUTOFOCUS = (mavlink.FOCUS_TYPE_AUTO, mavlink.FOCUS_TYPE_AUTO_SINGLE, mavlink.FOCUS_TYPE_AUTO_CONTINUOUS)
"""Accepted, and without effect but that a continuous focus ends."""


@dataclass
class Drive:
    """What moves a zoom or a focus through its range."""

    percent: float = 0.0
    """As of the last `move`."""
    percent_s: float = 0.0
    """Other than 0 while it goes on."""
    moved_us: int = 0

    def set(self, now_us: int, kind: int, value: float) -> int:
        """By a step, continuously (0 stops it) or to a value; the MAV_RESULT."""
        if not math.isfinite(value) or kind not in (STEP, CONTINUOUS, RANGE):
            return mavlink.MAV_RESULT_DENIED
        self.stop(now_us)
        if kind == STEP:
            self._go_to(self.percent + math.copysign(STEP_PERCENT, value))
        elif kind == RANGE:
            self._go_to(value)
        else:
            self.percent_s = max(-1.0, min(1.0, value)) * PERCENT_S
        return mavlink.MAV_RESULT_ACCEPTED

    def stop(self, now_us: int) -> None:
        """Where it is now."""
        self.move(now_us)
        self.percent_s = 0.0

    def move(self, now_us: int) -> None:
        """Let it go on since the last look, to the end of its range."""
        wished = self.percent + self.percent_s * (now_us - self.moved_us) * 1e-6
        self._go_to(wished)
        if self.percent != wished:
            self.percent_s = 0.0
        self.moved_us = now_us

    def _go_to(self, percent: float) -> None:
        self.percent = max(0.0, min(100.0, percent))


@dataclass
class Settings:
    """What RESET_CAMERA_SETTINGS puts back."""

    mode: int = mavlink.CAMERA_MODE_IMAGE
    zoom: Drive = field(default_factory=Drive)
    focus: Drive = field(default_factory=Drive)

    def set_focus(self, now_us: int, kind: int, value: float) -> int:
        """SET_CAMERA_FOCUS; the MAV_RESULT."""
        if kind in AUTOFOCUS:
            self.focus.stop(now_us)
            return mavlink.MAV_RESULT_ACCEPTED
        return self.focus.set(now_us, kind, value)

    def move(self, now_us: int) -> None:
        """Let both go on."""
        self.zoom.move(now_us)
        self.focus.move(now_us)
