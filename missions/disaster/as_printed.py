"""The flight as the paper prints it, to compare ours with: option `engage: detections`.

Its UAV leaves the line as soon as a box was detected in N frames in a row (`confirmations`, `confirm_score`), flies
"directly over the target using pixel-to-GPS-derived coordinates" (sections 2.3 and 3), "computes a heading-aware nudge
to center over the target" (its Fig. 5) and lets go there; "if the detection proves false", it resumes the scan. So here
the place is the middle of the last of these boxes, as that frame alone places it by `location`. From over that place N
frames in a row have to show a box of the same class again: it goes over the middle of that, until it stands there. No
plain ground is asked for, and the parcel comes to lie in the area, not beside it. What else keeps the parcel on board
are the vehicle's own reasons (`aborts.py`), an uncertain location among them.

Boxes that the picture's edge cuts count as any other, as the paper says nothing of them, though their middles are not
the target's: a target comes into the picture at its upper edge, and three frames in a row may have passed before all
of it is seen.

The height in the equations is the camera's above home, or above the ground as mapped with `altitude: terrain`.
"""

import math
from collections.abc import Callable, Generator, Sequence
from typing import NamedTuple

from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.camera_model import CameraPose
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.onboard import Script
from sitl_emu.missions.disaster import aborts, places
from sitl_emu.missions.disaster.alarms import SAME_M
from sitl_emu.missions.disaster.flight import LOOKED_S, Flight
from sitl_emu.missions.disaster.flying import STANDING_M
from sitl_emu.missions.disaster.places import Place
from sitl_emu.missions.disaster.regions import Grid
from sitl_emu.missions.disaster.sightings import located

Locate = Callable[[Detection], Corner | None]
"""Where a box's middle lies by the frame that shows it; None where it is not on the ground."""
NUDGES = 4
"""So often it goes over the middle of what it sees from above, and lets go in the end; ours, the paper has none."""


class _Run(NamedTuple):
    """Frames in a row that show one thing."""

    label: str
    place_m: Corner
    """By the last of them."""
    frames: int
    score_sum: float


class Runs:
    """Boxes of consecutive frames that are of one thing: each lies within `SAME_M` of where the last one lay."""

    def __init__(self, wanted: Confirming) -> None:
        """`confirmations` and `confirm_score` of it count."""
        self._wanted = wanted
        self._runs: list[_Run] = []

    def update(self, boxes: Sequence[Detection], locate: Locate) -> list[tuple[Detection, Corner]]:
        """A frame; the boxes that complete a run, and where they are, metres north and east (`locate`)."""
        before, self._runs, complete = self._runs, [], []
        for box in sorted(boxes, key=lambda one: -one.score):
            place_m = locate(box)
            if place_m is None:
                continue
            near = [one for one in before if one.label == box.label and math.dist(one.place_m, place_m) <= SAME_M]
            last = min(near, key=lambda one: math.dist(one.place_m, place_m), default=_Run(box.label, place_m, 0, 0.0))
            before = [one for one in before if one is not last]
            run = _Run(box.label, place_m, last.frames + 1, last.score_sum + box.score)
            self._runs.append(run)
            if run.frames >= self._wanted.confirmations and run.score_sum >= self._wanted.confirm_score * run.frames:
                complete.append((box, place_m))
        return complete


class AsPrinted(Flight):
    """The flight that the module describes. Places: metres north and east of home, heights above it (`Flight`)."""

    _runs: Runs | None = None
    _called: tuple[Place, ...] = ()
    """Where a run has called it to, the last one of each."""
    _sought: Place | None = None
    """What it goes to, or stands over."""
    _above: Place | None = None
    """The same, as a run shows it since it stands there."""

    def look(self, pose: CameraPose, boxes: Sequence[Detection], ground_m: Grid | float) -> None:
        """A frame of the scan."""
        assert self.regions is not None
        regions, settings = self.regions, self.settings
        if self._runs is None:
            self._runs = Runs(settings.perception.confirming)

        def locate(box: Detection) -> Corner | None:
            return located(settings.camera, pose, box, regions, ground_m, settings.location)

        shown = [self._place(box, place_m, pose) for box, place_m in self._runs.update(boxes, locate)]
        if (sought := self._sought) is not None:
            same = [one for one in shown if one.label == sought.label]
            self._above = min(same, key=lambda one: math.dist(one.place_m, sought.place_m), default=self._above)
            return
        for place in shown:
            if regions.is_asked(*place.place_m):
                others = [one for one in self._called if math.dist(one.place_m, place.place_m) > SAME_M]
                self._called = (*others, place)

    def _place(self, box: Detection, place_m: Corner, pose: CameraPose) -> Place:
        away_m = math.dist(place_m, (float(pose.position_m[0]), float(pose.position_m[1])))
        m_per_px = self.over_ground_m / self.settings.camera.focal_px
        steepness = away_m / max(self.over_ground_m, 1.0)
        return Place(box.label, box.score, place_m, place_m, steepness, box.w * box.h * m_per_px**2)

    def due(self) -> Place | None:
        """The nearest place that a run has called it to."""
        return self._nearest(self._called) if self._carries else None

    def _look_closer(self) -> Script:
        return
        yield

    @property
    def _lacked_a_place(self) -> bool:
        return False

    def _over(self, place: Place) -> Generator[None, None, Place]:
        """Centres over what called it; the place as it is then. Raises Aborted where it is not seen from above."""
        self._called = tuple(one for one in self._called if math.dist(one.place_m, place.place_m) > SAME_M)
        try:
            for _ in range(NUDGES):
                self._sought = place
                yield from self.travel.to(place.place_m, self._standing_m(place.place_m), STANDING_M)
                self._given_back = self.onboard.given_back
                self._runs, self._above = None, None
                yield from steps.pause(self.onboard, LOOKED_S, until=lambda: self._above is not None)
                self.check()
                if self._above is None:
                    raise aborts.Aborted(aborts.Reason.NOT_PERSISTING, f"{place.label} is not there from above")
                before_m, place = place.place_m, self._above
                if math.dist(before_m, place.place_m) <= STANDING_M:
                    break
        finally:
            self._sought = None
        aborts.check_location(places.sigma_m(place, self.over_ground_m, self.settings.ground_sigma_m))
        return place

    def _down(self, place: Place) -> Generator[None, None, Place]:
        yield from self.descent.down(place.place_m)
        return place
