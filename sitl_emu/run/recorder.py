"""What a run writes down while it goes on: events, and where vehicles and loose bodies truly were."""

import csv
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TextIO

from sitl_emu.missions.companion.companion import Event
from sitl_emu.run.messages import EventTold
from sitl_emu.world.obstacles import LoosePose

LOOSE = "loose.csv"
LOOSE_COLUMNS = ("time_s", "name", "north_m", "east_m", "down_m", "qw", "qx", "qy", "qz")
TRUTH_HEADER = "time_s,north_m,east_m,down_m,vn_m_s,ve_m_s,vd_m_s,qw,qx,qy,qz\n"


class RunRecorder:
    """Writes events.jsonl, truth-VEHICLE.csv and, where anything is loose, loose.csv into a run's folder."""

    def __init__(self, folder: Path, vehicles: list[str], listener: Callable[[EventTold], None]) -> None:
        """`listener` hears of every event too."""
        self._listener = listener
        self._loose_path = folder / LOOSE
        self._loose: TextIO | None = None
        self._lay: dict[str, list[str]] = {}
        """Where each loose body was when it was last written down."""
        self._events = (folder / "events.jsonl").open("w")
        self._truth: dict[str, TextIO] = {}
        for name in vehicles:
            # a line at a time: those who look on see it at once
            self._truth[name] = (folder / f"truth-{name}.csv").open("w", buffering=1)
            self._truth[name].write(TRUTH_HEADER)

    def event(self, vehicle: str, event: Event) -> None:
        """Something happened."""
        told = EventTold(event.time_us / 1e6, vehicle, event)
        line = {"time_s": told.time_s, "vehicle": vehicle, **event.line}
        self._events.write(json.dumps(line) + "\n")
        self._events.flush()
        self._listener(told)

    def truth(self, now_us: int, vehicle: str, pose: Any) -> None:
        """Where a vehicle truly is."""
        numbers = (pose.north_m, pose.east_m, pose.down_m, pose.vn_m_s, pose.ve_m_s, pose.vd_m_s)
        row = ",".join(f"{number:.3f}" for number in numbers)
        attitude = ",".join(f"{number:.5f}" for number in pose.q)
        self._truth[vehicle].write(f"{now_us / 1e6:.2f},{row},{attitude}\n")

    def loose(self, now_us: int, poses: Iterable[LoosePose]) -> None:
        """Where loose bodies are: a line for each that is new or has moved."""
        for described, place, q, _ in poses:
            numbers = [f"{metres:.3f}" for metres in place] + [f"{part:.5f}" for part in q]
            if self._lay.get(described.name) == numbers:
                continue
            self._lay[described.name] = numbers
            if self._loose is None:
                self._loose = self._loose_path.open("w", buffering=1, newline="")
                csv.writer(self._loose, lineterminator="\n").writerow(LOOSE_COLUMNS)
            row = (f"{now_us / 1e6:.2f}", described.name, *numbers)
            csv.writer(self._loose, lineterminator="\n").writerow(row)

    def close(self) -> None:
        """Make the files whole."""
        self._events.close()
        if self._loose is not None:
            self._loose.close()
        for file in self._truth.values():
            file.close()
