"""What a run writes down while it goes on: events, and where the vehicles truly were."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from sitl_emu.missions.companion.companion import Event
from sitl_emu.run.messages import EventTold

TRUTH_HEADER = "time_s,north_m,east_m,down_m,vn_m_s,ve_m_s,vd_m_s,qw,qx,qy,qz\n"


class RunRecorder:
    """Writes events.jsonl and truth-VEHICLE.csv into a run's folder."""

    def __init__(self, folder: Path, vehicles: list[str], listener: Callable[[EventTold], None]) -> None:
        """`listener` hears of every event too."""
        self._listener = listener
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

    def close(self) -> None:
        """Make the files whole."""
        self._events.close()
        for file in self._truth.values():
            file.close()
