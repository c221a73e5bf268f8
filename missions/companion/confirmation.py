"""From detections of single frames to targets: each found once, placed well, and only if it stays.

A detection joins the track whose target it sees (nearest on the ground, within `GATE_M`) or starts one.
**Consecutive** counts frames in which the track's place lies well inside the picture: a frame that sees it extends the
run, one that should and does not ends it, one that looks elsewhere leaves it alone. A track is *confirmed* by a run of
3 frames whose mean score reaches `CONFIRM_SCORE`. It is *reported*, once, when it is confirmed and settled: its rays
have crossed at 60 degrees, so that its height is known, or it has left the picture; it must then still have been seen
in `HIT_SHARE` of the frames that should have seen it, with a mean score over these frames of `REPORT_SCORE` (a frame
that missed it counts as 0). That throws out what flickers or looks like a target from one side only.
**Label**: each detection votes with its score; the larger sum wins.
**Merging**: a track within `MERGE_M` of another is the same target, seen again from a neighbouring line: its rays join
the older one, and nothing is reported twice.

A pure state machine on frame times: no clock, no sockets. It knows nothing of the field's outline: give it `inside`.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from missions.companion.camera_model import CameraModel, CameraPose, Point, in_view
from missions.companion.detector import Detection
from missions.companion.geolocation import Intersection, Ray, on_level_ground, pixel_ray

GATE_M = 1.8
MERGE_M = 2.5
EDGE_PX = 24.0
"""A target nearer to the picture's edge than this need not be seen."""
CONSECUTIVE = 3
CONFIRM_SCORE = 0.5
REPORT_SCORE = 0.72
HIT_SHARE = 0.7
STILL_SCORE = STILL_HIT_SHARE = 0.6
"""The same for a vehicle that stands before what another has found: few frames, all from one side."""
SETTLED_RAD = math.radians(60.0)
LEAST_SPREAD_RAD = math.radians(20.0)
"""What is seen from one side only, at the picture's edge, is not reported: the next line will see it better."""
GONE_US = 700_000
"""A track that no frame has looked at for this long has left the picture."""


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
    )

    def __init__(self, number: int, time_us: int, detection: Detection, place: Intersection, point: Point) -> None:
        self.id = number
        self.place, self.point = place, point
        self.votes: dict[str, float] = {}
        self.hits = self.expected = self.run = 0
        self.score_sum = self.run_score = 0.0
        self.confirmed = self.reported = False
        self.best, self.best_time_us = detection, time_us
        self.looked_us = time_us

    @property
    def score(self) -> float:
        return self.score_sum / max(self.expected, 1)

    def hit(self, time_us: int, detection: Detection) -> None:
        self.hits += 1
        self.expected += 1
        self.score_sum += detection.score
        self.run += 1
        self.run_score += detection.score
        self.votes[detection.label] = self.votes.get(detection.label, 0.0) + detection.score
        if self.run >= CONSECUTIVE and self.run_score >= CONFIRM_SCORE * self.run:
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
        self.confirmed |= other.confirmed
        self.looked_us = max(self.looked_us, other.looked_us)
        for label, votes in other.votes.items():
            self.votes[label] = self.votes.get(label, 0.0) + votes
        if other.best.score > self.best.score:
            self.best, self.best_time_us = other.best, other.best_time_us

    def target(self) -> Target:
        label = max(self.votes, key=lambda name: self.votes[name])
        return Target(self.id, label, self.score, *self.point, self.hits, self.best_time_us, self.best)


class Confirmation:
    """Feed it every frame's detections with the camera's pose; it returns what is new.

    `ground_down_m` is the prior for the ground's height (home's, down from the poses' origin). `settle` False reports a
    target as soon as 3 frames confirm it, at a lower score: for a vehicle that stands still.
    `inside(north_m, east_m)` tells whether a place is of interest.
    """

    def __init__(
        self,
        camera: CameraModel,
        ground_down_m: float,
        *,
        settle: bool = True,
        inside: Callable[[float, float], bool] | None = None,
    ) -> None:
        self._camera, self.ground_down_m = camera, ground_down_m
        self._settle, self._inside = settle, inside
        self._least_score, self._least_share = (REPORT_SCORE, HIT_SHARE) if settle else (STILL_SCORE, STILL_HIT_SHARE)
        self._tracks: list[_Track] = []
        self._last_id = 0

    @property
    def targets(self) -> list[Target]:
        """All targets reported so far, at their latest estimate."""
        return [track.target() for track in self._tracks if track.reported]

    def update(self, frame_time_us: int, pose: CameraPose, detections: Sequence[Detection]) -> list[Target]:
        """One frame: its time, the camera's pose at that time, all its detections. Returns targets now to report."""
        seen: set[int] = set()
        for detection in sorted(detections, key=lambda d: -d.score):
            ray = pixel_ray(self._camera, pose, detection.x, detection.y)
            track = self._track_of(ray, seen)
            if track is None:
                track = self._start(frame_time_us, ray, detection)
                if track is None:
                    continue
            seen.add(track.id)
            track.place.add(ray, track.point[2])
            track.point = track.place.point()
            track.hit(frame_time_us, detection)
        for track in self._tracks:
            if track.id not in seen and in_view(self._camera, pose, track.point, EDGE_PX):
                track.miss(frame_time_us)
        self._merge()
        return self._report(frame_time_us)

    def finish(self) -> list[Target]:
        """The scan is over: targets to report that had not settled."""
        return self._report(None)

    def _track_of(self, ray: Ray, seen: set[int]) -> _Track | None:
        """The nearest track a ray may belong to, on the ground at the track's own height."""
        nearest, nearest_m = None, GATE_M
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
        for track in sorted(self._tracks, key=lambda t: (not t.reported, t.id)):
            for older in kept:
                if math.hypot(track.point[0] - older.point[0], track.point[1] - older.point[1]) < MERGE_M:
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
            if track.reported:
                kept.append(track)
                continue
            if track.confirmed and (
                not self._settle or track.place.spread_rad >= (LEAST_SPREAD_RAD if gone else SETTLED_RAD)
            ):
                steady = track.hits >= self._least_share * track.expected and track.score >= self._least_score
                if steady and (self._inside is None or self._inside(track.point[0], track.point[1])):
                    track.reported = True
                    new.append(track.target())
            if track.reported or not gone:
                kept.append(track)
        self._tracks = kept
        return new
