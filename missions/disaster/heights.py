"""How high over the true ground a scan was flown: the altitude hold of the paper's section 6."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from sitl_emu.missions.scoring import EventLine, RunRecord

SCANNING = "scanning"


def scan_height(record: RunRecord) -> dict[str, Any] | None:
    """Of the first vehicle that told a plan: `wanted_m`, `mean_m`, and `rms_m` of the difference.

    Of the true path in the phase `scanning`, over the ground, not over what stands on it. None where nothing was
    scanned, or no truth is known.
    """
    plan = next((event for event in record.events if event["event"] == "plan"), None)
    if plan is None or record.ground_m is None or plan["vehicle"] not in record.tracks:
        return None
    track, wanted_m = record.tracks[plan["vehicle"]], plan["scan_altitude_m"]
    spans = list(_scanning([event for event in record.events if event["vehicle"] == plan["vehicle"]]))
    heights_m = [
        up_m - record.ground_m(north_m, east_m)
        for time_s, north_m, east_m, up_m in zip(*track, strict=True)
        if any(begins_s <= time_s < ends_s for begins_s, ends_s in spans)
    ]
    if not heights_m:
        return None
    mean_m = math.fsum(heights_m) / len(heights_m)
    rms_m = math.sqrt(math.fsum((height_m - wanted_m) ** 2 for height_m in heights_m) / len(heights_m))
    return {"wanted_m": wanted_m, "mean_m": round(mean_m, 3), "rms_m": round(rms_m, 3)}


def _scanning(events: Sequence[EventLine]) -> Iterator[tuple[float, float]]:
    """From when to when a vehicle flew its lines, and on the way back to one."""
    phases: list[Mapping[str, Any]] = [event for event in events if event["event"] == "phase"]
    for phase, after in pairwise(phases):
        if phase["phase"] == SCANNING:
            yield phase["time_s"], after["time_s"]
