"""Pictures of what was found: frames with their detections drawn, beside a companion's events."""

from collections import deque
from collections.abc import Sequence
from pathlib import Path

import cv2

from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.companion import Event
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.inference import Looked

KEPT_FRAMES = 96
"""Of those with detections: a target is confirmed seconds after the frame that showed it best."""
BOX_COLOUR, TEXT_COLOUR, FOUND_COLOUR = (0, 200, 255), (255, 255, 255), (60, 60, 255)
TEXT_SCALE, LINE_PX = 0.5, 18
JPEG_QUALITY = 88


class Album:
    """Keeps the latest frames with detections, and writes those that events name."""

    def __init__(self, folder: Path, name: str) -> None:
        """`folder` takes the pictures; their names begin with `name`."""
        self._folder, self._name = folder, name
        self._kept: deque[Looked] = deque(maxlen=KEPT_FRAMES)

    def keep(self, looked: Looked) -> None:
        """A frame that an event may name."""
        if looked.detections:
            self._kept.append(looked)

    def written(self, event: Event) -> str | None:
        """The picture of the frame that an event names, FOLDER/FILE; None if it names none that is kept."""
        time_us = event.data.get("frame_time_us")
        looked = next((one for one in self._kept if one.frame.time_usec == time_us), None)
        if looked is None:
            return None
        file = f"{self._name}-{looked.frame.time_usec // 1000:07d}-{event.kind}.jpg"
        picture = draw(looked.frame.image, looked.detections, event)
        cv2.imwrite(str(self._folder / file), picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        return f"{self._folder.name}/{file}"


def draw(image: Image, detections: Sequence[Detection], event: Event) -> Image:
    """A copy of a frame with boxes around its detections, the one that the event tells of in red, and its text."""
    drawn = image.copy()
    for found in detections:
        _box(drawn, found.x, found.y, found.w, found.h, BOX_COLOUR, f"{found.label} {found.score:.2f}")
    if "x" in event.data:
        x, y, w, h = (float(event.data[key]) for key in ("x", "y", "w", "h"))
        _box(drawn, x, y, w, h, FOUND_COLOUR, "")
    _write(drawn, f"t = {event.time_us / 1e6:.1f} s  {event.text}"[:80], 6, LINE_PX, TEXT_COLOUR)
    return drawn


def _box(image: Image, x: float, y: float, w: float, h: float, colour: tuple[int, int, int], text: str) -> None:
    left, top, right, bottom = round(x - w / 2), round(y - h / 2), round(x + w / 2), round(y + h / 2)
    cv2.rectangle(image, (left, top), (right, bottom), colour, 2)
    below_px = bottom + LINE_PX if top < 2 * LINE_PX else top - 4
    (width_px, _), _ = cv2.getTextSize(text, 0, TEXT_SCALE, 1)
    _write(image, text, min(left, image.shape[1] - width_px), min(below_px, image.shape[0] - 4), colour)


def _write(image: Image, text: str, left_px: int, below_px: int, colour: tuple[int, int, int]) -> None:
    """A line that can be read on any ground: with a dark rim, of the same thickness moved about, as OpenCV 5 writes
    thicker text wider."""
    rim = [(right, down, (0, 0, 0)) for right in (-1, 0, 1) for down in (-1, 0, 1) if right or down]
    for right, down, ink in (*rim, (0, 0, colour)):
        cv2.putText(image, text, (left_px + right, below_px + down), 0, TEXT_SCALE, ink, 1, cv2.LINE_AA)
