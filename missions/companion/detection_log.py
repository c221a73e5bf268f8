"""What the detector found in each frame, and what might become a target: a line of JSON a frame.

    {"time_s": 35.668, "found": [["car", 0.945, 417.1, 368.8, 34.8, 43.5]], "candidates": [...]}

`time_s`: when the frame was taken, in the vehicle's boot time. `found`: label, score, and the box's centre and size in
pixels. `candidates`, at most once a second: label, score, latitude and longitude in degrees, horizontal standard
deviation in metres, in how many frames it was seen.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from sitl_emu.missions.companion.companion import Candidate
from sitl_emu.missions.companion.inference import Looked
from sitl_emu.missions.companion.logs import Log

CANDIDATES_EVERY_US = 1_000_000


class DetectionLog:
    """Writes them into a file, until that fails."""

    def __init__(self, path: Path) -> None:
        """Raises OSError where it can't be written."""
        self._log = Log(path, path.open("w", buffering=1))
        self._due_us = 0

    @property
    def error(self) -> str:
        """Why it has ended, a line for people; "" while it has not."""
        return self._log.error

    def wants_candidates(self, looked: Looked) -> bool:
        """Whether it is time for them."""
        return looked.frame.time_usec >= self._due_us

    def add(self, looked: Looked, candidates: Sequence[Candidate] | None = None) -> None:
        """A frame that was looked at; `candidates` if they were wanted."""
        found = [
            [one.label, round(one.score, 3), *(round(each, 1) for each in (one.x, one.y, one.w, one.h))]
            for one in looked.detections
        ]
        line: dict[str, object] = {"time_s": looked.frame.time_usec / 1e6, "found": found}
        if candidates is not None:
            self._due_us = looked.frame.time_usec + CANDIDATES_EVERY_US
            line["candidates"] = [_rounded(one) for one in candidates]
        self._log.write(lambda file: file.write(json.dumps(line) + "\n"))

    def close(self) -> None:
        """Make it whole."""
        self._log.close()


def _rounded(one: Candidate) -> list[object]:
    place = round(one.lat_deg, 7), round(one.lon_deg, 7)
    return [one.label, round(one.score, 3), *place, round(one.sigma_m, 3), one.sightings]
