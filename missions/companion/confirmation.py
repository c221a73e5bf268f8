"""From detections of single frames to targets: each found once, placed well, and only if it stays.

The figures are `Confirming`'s. A detection joins the track whose target it sees (nearest on the ground, within
`gate_m`) or starts one; what lies farther from the camera's axis than `within_deg` is not looked at. **Consecutive**
counts frames in which the track's place lies well inside the picture and that angle: a frame that sees it extends the
run, one that should and does not ends it, one that looks elsewhere leaves it alone. A track is *confirmed* by a run of
`confirmations` frames whose mean score reaches `confirm_score`. It is *reported*, once, when it is confirmed and has
left the picture: its rays must have crossed at `least_spread_deg`, so that its height is known, and it must have been
seen in `hit_share` of the frames that should have seen it, with a mean score over these frames of `report_score` (a
frame that missed it counts as 0). That throws out what flickers or looks like a target from one side only, which is
known when it has been passed, and no sooner. What is narrower than `least_width_m`, over all frames that saw it, is no
target: a plant, not a patch of them. What goes unreported is counted (`unreported`).
**Label**: each detection votes with its score; the larger sum wins.
**Merging**: a track within `merge_m` of another is the same target, seen again from a neighbouring line: its rays join
the older one, and nothing is reported twice.
**Gates** hold for a GNSS receiver that states `GATES_EPH_M` or better of itself. With a worse one the same target comes
to lie farther from itself: they grow by what its error adds (`widened_m`).

A pure state machine on frame times: no clock, no sockets. It knows nothing of the field's outline: give it `inside`.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.missions.companion.camera_model import CameraModel, CameraPose, Point, in_view
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.geolocation import Covariance, Intersection, Ray, on_level_ground, pixel_ray

EDGE_PX = 24.0
"""A target nearer to the picture's edge than this need not be seen."""
GONE_US = 700_000
"""A track that no frame has looked at for this long has left the picture."""
GATES_EPH_M = 0.6
"""What the m600's receiver states of itself (`eph_m` in its data), with which the gates were chosen. A better one does
not narrow them, as the detector's boxes wander too."""
GATE_SIGMAS = 2.0
"""Of the receiver's error that a gate has room for: 95 % of it."""
UNCONFIRMED, ONE_SIDED, UNSTEADY = "unconfirmed", "seen from one side only", "unsteady"
SMALL, OUTSIDE = "too small", "outside the area"
"""Why a track dies unreported."""


class Confirming(NamedTuple):
    """What makes a target of what is detected. The figures are of a survey from 12 to 20 m over relief."""

    confirmations: int = 3
    """Frames in a row that have to see it."""
    confirm_score: float = 0.5
    report_score: float = 0.72
    hit_share: float = 0.7
    least_width_m: float = 0.0
    """Of a target: mean of the longer sides of its boxes, on the ground."""
    gate_m: float = 1.8
    merge_m: float = 2.5
    pass_by: bool = True
    """False reports as soon as it is confirmed, from whichever side: for a vehicle that stands still."""
    least_spread_deg: float = 20.0
    """What is seen from one side only, at the picture's edge, is not reported: the next line will see it better."""
    within_deg: float = 90.0
    """Nothing farther from the camera's axis is looked at. Aslant, plants hide what stands between them, and what lies
    there looks like something else; who flies lines has to fly them close enough for this."""


SURVEYING = Confirming()
STANDING = Confirming(report_score=0.6, hit_share=0.6, pass_by=False)
"""For a vehicle that stands before what another has found: few frames, all from one side."""


def widened_m(gate_m: float, eph_m: float | None) -> float:
    """A gate for a receiver that states `eph_m` of itself (one sigma; None: nothing, and the gate stays)."""
    if eph_m is None or eph_m <= GATES_EPH_M:
        return gate_m
    return math.sqrt(gate_m**2 + GATE_SIGMAS**2 * (eph_m**2 - GATES_EPH_M**2))


class Target(NamedTuple):
    """A confirmed target. Position in metres NED from the origin the poses are given in."""

    id: int
    label: str
    score: float
    """Mean score over the frames that should have seen it."""
    north_m: float
    east_m: float
    down_m: float
    sightings: int
    """Detections it rests on."""
    frame_time_us: int
    """The frame that showed it best, and where in it:"""
    detection: Detection
    covariance_m2: Covariance = Covariance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Of the position: what the rays' own noise leaves open, and the receiver's error."""
    residual_m: float = 0.0
    """How far its rays pass by it, root mean square."""


class _Track:
    __slots__ = (
        "best",
        "best_time_us",
        "confirmed",
        "expected",
        "hits",
        "id",
        "looked_us",
        "place",
        "point",
        "reported",
        "run",
        "run_score",
        "score_sum",
        "votes",
        "width_sum_m",
    )

    def __init__(self, number: int, time_us: int, detection: Detection, place: Intersection, point: Point) -> None:
        self.id = number
        self.place, self.point = place, point
        self.votes: dict[str, float] = {}
        self.hits = self.expected = self.run = 0
        self.score_sum = self.run_score = self.width_sum_m = 0.0
        self.confirmed = self.reported = False
        self.best, self.best_time_us = detection, time_us
        self.looked_us = time_us

    @property
    def score(self) -> float:
        return self.score_sum / max(self.expected, 1)

    @property
    def width_m(self) -> float:
        return self.width_sum_m / max(self.hits, 1)

    def hit(self, time_us: int, detection: Detection, m_per_px: float, wanted: Confirming) -> None:
        self.hits += 1
        self.width_sum_m += max(detection.w, detection.h) * m_per_px
        self.expected += 1
        self.score_sum += detection.score
        self.run += 1
        self.run_score += detection.score
        self.votes[detection.label] = self.votes.get(detection.label, 0.0) + detection.score
        if self.run >= wanted.confirmations and self.run_score >= wanted.confirm_score * self.run:
            self.confirmed = True
        if detection.score >= self.best.score:
            self.best, self.best_time_us = detection, time_us
        self.looked_us = time_us

    def miss(self, time_us: int) -> None:
        self.expected += 1
        self.run, self.run_score = 0, 0.0
        self.looked_us = time_us

    def merge(self, other: "_Track") -> None:
        self.place.merge(other.place)
        self.point = self.place.point()
        self.hits += other.hits
        self.expected += other.expected
        self.score_sum += other.score_sum
        self.width_sum_m += other.width_sum_m
        self.confirmed |= other.confirmed
        self.looked_us = max(self.looked_us, other.looked_us)
        for label, votes in other.votes.items():
            self.votes[label] = self.votes.get(label, 0.0) + votes
        if other.best.score > self.best.score:
            self.best, self.best_time_us = other.best, other.best_time_us

    def target(self, accuracy_m: tuple[float, float]) -> Target:
        label = max(self.votes, key=lambda name: self.votes[name])
        covariance = self.place.covariance().with_receiver(*accuracy_m)
        seen = (self.hits, self.best_time_us, self.best)
        return Target(self.id, label, self.score, *self.point, *seen, covariance, self.place.residual_m())


class Confirmation:
    """Feed it every frame's detections with the camera's pose; it returns what is new.

    `ground_down_m` is the prior for the ground's height (home's, down from the poses' origin). `inside(north, east)`
    tells whether a place is of interest. `accuracy_m` is what the GNSS receiver states of itself, horizontally and
    vertically (None: nothing); whoever feeds frames keeps it up to date.
    """

    def __init__(
        self,
        camera: CameraModel,
        ground_down_m: float,
        wanted: Confirming = SURVEYING,
        *,
        inside: Callable[[float, float], bool] | None = None,
    ) -> None:
        self._camera, self.ground_down_m, self.wanted = camera, ground_down_m, wanted
        self._inside = inside
        self.accuracy_m: tuple[float | None, float | None] = (None, None)
        self.unreported = dict.fromkeys((UNCONFIRMED, ONE_SIDED, UNSTEADY, SMALL, OUTSIDE), 0)
        """How many tracks have died unreported, and why."""
        self._tracks: list[_Track] = []
        self._last_id = 0

    @property
    def targets(self) -> list[Target]:
        """All targets reported so far, at their latest estimate."""
        return [track.target(self._stated_m) for track in self._tracks if track.reported]

    @property
    def candidates(self) -> list[Target]:
        """What is seen and not reported yet; it may never be."""
        return [track.target(self._stated_m) for track in self._tracks if not track.reported]

    def update(self, frame_time_us: int, pose: CameraPose, detections: Sequence[Detection]) -> list[Target]:
        """One frame: its time, the camera's pose at that time, all its detections. Returns targets now to report."""
        seen: set[int] = set()
        for detection in sorted(detections, key=lambda d: -d.score):
            ray = pixel_ray(self._camera, pose, detection.x, detection.y)
            if not self._is_near_axis(pose, ray.direction):
                continue
            track = self._track_of(ray, seen)
            if track is None:
                track = self._start(frame_time_us, ray, detection)
                if track is None:
                    continue
            seen.add(track.id)
            track.place.add(ray, track.point[2])
            track.point = track.place.point()
            away_m = float(pose.to_ned[:, 2] @ (np.asarray(track.point) - pose.position_m))
            track.hit(frame_time_us, detection, away_m / self._camera.focal_px, self.wanted)
        for track in self._tracks:
            if track.id not in seen and self._should_see(pose, track.point):
                track.miss(frame_time_us)
        self._merge()
        return self._report(frame_time_us)

    def finish(self) -> list[Target]:
        """The scan is over: targets to report that are in the picture still."""
        return self._report(None)

    def _should_see(self, pose: CameraPose, point: Point) -> bool:
        direction = np.asarray(point) - pose.position_m
        is_near = self._is_near_axis(pose, direction / np.linalg.norm(direction))
        return is_near and in_view(self._camera, pose, point, EDGE_PX)

    def _is_near_axis(self, pose: CameraPose, direction: npt.NDArray[np.float64]) -> bool:
        """Of a direction of length 1, in NED."""
        return float(pose.to_ned[:, 2] @ direction) >= math.cos(math.radians(self.wanted.within_deg))

    def _track_of(self, ray: Ray, seen: set[int]) -> _Track | None:
        """The nearest track a ray may belong to, on the ground at the track's own height."""
        nearest, nearest_m = None, widened_m(self.wanted.gate_m, self.accuracy_m[0])
        for track in self._tracks:
            if track.id in seen:
                continue
            point = on_level_ground(ray, track.point[2])
            if point is None:
                continue
            away = math.hypot(point[0] - track.point[0], point[1] - track.point[1])
            if away < nearest_m:
                nearest, nearest_m = track, away
        return nearest

    def _start(self, time_us: int, ray: Ray, detection: Detection) -> _Track | None:
        point = on_level_ground(ray, self.ground_down_m)
        if point is None:
            return None
        self._last_id += 1
        track = _Track(self._last_id, time_us, detection, Intersection(self.ground_down_m), point)
        self._tracks.append(track)
        return track

    def _merge(self) -> None:
        """Joins tracks that have come to lie together; one that is reported stays, else the older one."""
        kept: list[_Track] = []
        merge_m = widened_m(self.wanted.merge_m, self.accuracy_m[0])
        for track in sorted(self._tracks, key=lambda t: (not t.reported, t.id)):
            for older in kept:
                if math.hypot(track.point[0] - older.point[0], track.point[1] - older.point[1]) < merge_m:
                    older.merge(track)
                    break
            else:
                kept.append(track)
        self._tracks = kept

    def _report(self, now_us: int | None) -> list[Target]:
        new = []
        kept: list[_Track] = []
        for track in self._tracks:
            gone = now_us is None or now_us - track.looked_us > GONE_US
            lacks = "" if track.reported else self._lacks(track)
            if not track.reported and not lacks and (gone or not self.wanted.pass_by):
                track.reported = True
                new.append(track.target(self._stated_m))
            if track.reported or not gone:
                kept.append(track)
            else:
                self.unreported[lacks] += 1
        self._tracks = kept
        return new

    def _lacks(self, track: _Track) -> str:
        """What keeps a track from being reported; "" where nothing does."""
        wanted = self.wanted
        if not track.confirmed:
            return UNCONFIRMED
        if wanted.pass_by and track.place.spread_rad < math.radians(wanted.least_spread_deg):
            return ONE_SIDED
        if track.hits < wanted.hit_share * track.expected or track.score < wanted.report_score:
            return UNSTEADY
        if track.width_m < wanted.least_width_m:
            return SMALL
        if self._inside is not None and not self._inside(track.point[0], track.point[1]):
            return OUTSIDE
        return ""

    @property
    def _stated_m(self) -> tuple[float, float]:
        """The receiver's accuracy as it stated it; one that states none adds nothing to what the rays leave open."""
        eph_m, epv_m = self.accuracy_m
        return eph_m or 0.0, epv_m or 0.0
