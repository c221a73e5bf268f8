"""How high over the true ground, or the water on it, a scan was flown: the altitude hold of the paper's section 6."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from sitl_emu.missions.disaster.truth import surface_m
from sitl_emu.missions.scoring import EventLine, RunRecord

SCANNING = "scanning"


def scan_height(record: RunRecord) -> dict[str, Any] | None:
    """Of the first vehicle that told a plan: `wanted_m`, `mean_m`, and `rms_m` of the difference.

    Of the true path in the phase `scanning`, over ground or water, not over what stands there. None where nothing was
    scanned, or no truth is known.
    """
    plan = next((event for event in record.events if event["event"] == "plan"), None)
    if plan is None or record.ground_m is None or plan["vehicle"] not in record.tracks:
        return None
    track, wanted_m = record.tracks[plan["vehicle"]], plan["scan_altitude_m"]
    spans = list(_scanning([event for event in record.events if event["vehicle"] == plan["vehicle"]]))
    if not spans:
        return None
    time_s, north_m, east_m, up_m = np.array(track)
    flown = np.any([(begins_s <= time_s) & (time_s < ends_s) for begins_s, ends_s in spans], axis=0)
    if not flown.any():
        return None
    heights_m = up_m[flown] - surface_m(record.ground_m, record.areas, north_m[flown], east_m[flown])
    rms_m = math.sqrt(float(np.mean((heights_m - wanted_m) ** 2)))
    return {"wanted_m": wanted_m, "mean_m": round(float(heights_m.mean()), 3), "rms_m": round(rms_m, 3)}


def _scanning(events: Sequence[EventLine]) -> Iterator[tuple[float, float]]:
    """From when to when a vehicle flew its lines, and on the way back to one."""
    phases: list[Mapping[str, Any]] = [event for event in events if event["event"] == "phase"]
    for phase, after in pairwise(phases):
        if phase["phase"] == SCANNING:
            yield phase["time_s"], after["time_s"]
