"""What the line would be left for if detections alone counted, as in the paper: after one frame, after three in a row.

The paper's UAV flies to what consecutive frames detect (its section 2.3), and its Table 5 counts how often that was for
nothing, with and without N = 3. Ours asks for more: a region that lasts and has a place for a parcel (`flight.py`). So
that the two can be compared, what the boxes of its scan would have called it to is told when it has ended, by
`companion/confirmation.py`. Nothing is decided by it.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose
from sitl_emu.missions.companion.confirmation import Confirmation, Confirming
from sitl_emu.missions.companion.detector import Detection

FRAMES = (1, 3)
"""In a row: without and with the paper's confirmation."""
SAME_M = 5.0
"""Boxes whose middles lie so near to one another are of one thing: the paper's radius of delivery."""


class Alarm(NamedTuple):
    """A place that the line would be left for."""

    frames: int
    """In a row that have seen something there."""
    time_us: int
    label: str
    place_m: Corner
    """Metres north and east of home."""


class Alarms:
    """Of one flight."""

    def __init__(self, camera: CameraModel, confirm_score: float, inside: Callable[[float, float], bool]) -> None:
        """`confirm_score`: the least mean score. `inside`(north, east): whether a place is to be scanned."""
        self._by_frames = {
            frames: Confirmation(camera, 0.0, _confirming(frames, confirm_score), inside=inside) for frames in FRAMES
        }
        self.all: list[Alarm] = []

    def update(self, now_us: int, frame_time_us: int, pose: CameraPose, boxes: Sequence[Detection]) -> None:
        """A frame of the scan. The pose counts from home, whose ground is at height 0."""
        for frames, confirmation in self._by_frames.items():
            for one in confirmation.update(frame_time_us, pose, boxes):
                self.all.append(Alarm(frames, now_us, one.label, (one.north_m, one.east_m)))


def _confirming(frames: int, score: float) -> Confirming:
    """What is reported is confirmed, and nothing else is asked of it."""
    return Confirming(frames, score, report_score=0.0, hit_share=0.0, gate_m=SAME_M, merge_m=SAME_M, pass_by=False)
