"""The UGV's queue: which targets it was asked to inspect, by whom, and what became of each.

Several scouts share a UGV. What they ask for is identified by place and label: a target that two of them report (or
one of them twice) lies within `SAME_M` of itself and has one label, and is one job with two askers, driven to once.
Jobs are served in the order in which they were first asked for. Whoever asks for a job that was done already, is told
what was found then; only a job that could not be done (the place not reached, the vehicle taken away) is done again.

As a mission (https://mavlink.io/en/services/mission.html) a job has two items: MAV_CMD_NAV_WAYPOINT, where the target
is, and MAV_CMD_SPATIAL_USER_1 at the same place, what it is: param2 the scout's score, param3 the class (index in
`LABELS`). A mission without the second item asks to look for anything.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sitl_emu.gcs.geodesy import distance_m
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.missions.agriculture.report import FRAME_GLOBAL_RELATIVE_ALT, LABELS, SPATIAL_USER_1, Report, Result

NAV_WAYPOINT = 16
SAME_M = 2.5
"""As near as two targets of a scout may not lie (`companion/confirmation.py` merges what is nearer)."""
LASTING = (Result.CONFIRMED, Result.NOT_SEEN, Result.WRONG_LABEL)
"""Results that would be the same if the UGV drove there again."""


class Wanted(NamedTuple):
    """What a scout asks for: a target's place (1e-7 deg), label ("" any) and the scout's score."""

    x: int
    y: int
    label: str
    score: float


class Asker(NamedTuple):
    """Who wants to know: a system, and the place (1e-7 deg) that it knows the target by."""

    system: int
    x: int
    y: int


class Sight(NamedTuple):
    """What was seen where a target should be: label, score, and distance in metres from the vehicle."""

    label: str = ""
    score: float = 0.0
    distance_m: float = math.nan


@dataclass
class Job:
    """A target to inspect."""

    number: int
    """Jobs count from 1 in the order they were first asked for."""
    wanted: Wanted
    askers: list[Asker] = field(default_factory=list)
    result: Result | None = None
    """What became of it; None as long as it is open."""
    sights: list[Sight] = field(default_factory=list)
    """What was seen there, one of each label."""

    @property
    def lat_deg(self) -> float:
        """Latitude of the target."""
        return self.wanted.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude of the target."""
        return self.wanted.y * 1e-7

    @property
    def found(self) -> Result:
        """What its sights say: the label that was asked for, another one, or nothing."""
        labels = {sight.label for sight in self.sights}
        if not labels:
            return Result.NOT_SEEN
        return Result.CONFIRMED if self.wanted.label in ("", *labels) else Result.WRONG_LABEL

    def report_to(self, asker: Asker, result: Result) -> Report:
        """What an asker is told: how the job stands, and the sight that speaks most for it."""
        right = [sight for sight in self.sights if sight.label == self.wanted.label]
        label, score, distance_m = next(iter(right + self.sights), Sight())
        return Report(result, score, label, distance_m, asker.x, asker.y)


class JobQueue:
    """Jobs in the order they came. A plain state machine: no clock, no messages."""

    def __init__(self) -> None:
        self.jobs: list[Job] = []
        """All jobs ever asked for, in order."""
        self.current: Job | None = None

    @property
    def waiting(self) -> list[Job]:
        """Jobs that were asked for and not begun."""
        return [job for job in self.jobs if job.result is None and job is not self.current]

    def ask(self, system: int, wanted: Wanted, same_m: float = SAME_M) -> Job:
        """A system asks for a target. The job is a new one, or that which others have asked for before.

        If its `result` is there already, the asker can be told at once. `same_m`: targets of one label that lie as near
        to each other are the same.
        """
        asker = Asker(system, wanted.x, wanted.y)
        job = next((job for job in self.jobs if _is_same(job, wanted, same_m) and job.result in (None, *LASTING)), None)
        if job is None:
            job = Job(len(self.jobs) + 1, wanted)
            self.jobs.append(job)
        if asker not in job.askers:
            job.askers.append(asker)
        return job

    def begin(self) -> Job | None:
        """The job to do now: the oldest that waits; None if there is none."""
        self.current = next(iter(self.waiting), None)
        return self.current

    def finish(self, result: Result) -> None:
        """The job at hand is done."""
        assert self.current is not None
        self.current.result, self.current = result, None


def _is_same(job: Job, wanted: Wanted, same_m: float) -> bool:
    """Whether a job is for this target: label and place, by any of its askers' estimates."""
    if job.wanted.label != wanted.label:
        return False
    here = wanted.x * 1e-7, wanted.y * 1e-7
    return any(distance_m(asker.x * 1e-7, asker.y * 1e-7, *here) <= same_m for asker in job.askers)


def items_of(wanted: Wanted) -> list[MissionItem]:
    """The mission that asks for a target."""
    place = MissionItem(FRAME_GLOBAL_RELATIVE_ALT, NAV_WAYPOINT, param4=math.nan, x=wanted.x, y=wanted.y)
    label = float(LABELS.index(wanted.label)) if wanted.label in LABELS else -1.0
    what = place._replace(command=SPATIAL_USER_1, param2=wanted.score, param3=label, param4=0.0)
    return [place, what]


def wanted_of(items: Sequence[MissionItem]) -> Wanted | None:
    """What a mission asks for; None if it does not name a place."""
    places = [item for item in items if item.command == NAV_WAYPOINT]
    if not places or abs(places[-1].x) > 900_000_000 or abs(places[-1].y) > 1_800_000_000:
        return None
    what = next((item for item in items if item.command == SPATIAL_USER_1), None)
    known = what is not None and what.param3 in range(len(LABELS))
    score = what.param2 if what is not None and math.isfinite(what.param2) else 0.0
    return Wanted(places[-1].x, places[-1].y, LABELS[int(what.param3)] if known and what is not None else "", score)
