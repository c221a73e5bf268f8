"""Runs of `sitl-emu run` for tests: started as a user does, looked at from outside."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import yaml

from sitl_emu.run.scenario import find

FIRST_INSTANCE = int(os.environ.get("SITL_EMU_TEST_INSTANCE", "5"))
"""Away from the ports of a run that somebody has going on this machine. At most four vehicles
fly: instance 8 is the last with an offboard port of its own; to that of 9 vehicles of other tests send, too."""


def short_scenario(folder: Path, limit_s: float, **changes: object) -> Path:
    """The agriculture scenario, ending after so much simulated time."""
    scenario = yaml.safe_load(find("agriculture").read_text())
    scenario |= {"time_limit_s": limit_s, **changes}
    path = folder / "short.yaml"
    path.write_text(yaml.safe_dump(scenario))
    return path


REPORT_LIMIT_S = 60.0
"""So long a run that is stopped may take to write its report on a busy machine."""


class Run:
    """A run under way."""

    def __init__(self, scenario: Path, out: Path, *arguments: str, cwd: Path | None = None) -> None:
        self.out, self.log = out, out.with_suffix(".txt")
        command = [sys.executable, "-P", "-m", "sitl_emu", "run", str(scenario), "--out", str(out)]
        with self.log.open("wb") as output:
            self.process = subprocess.Popen(
                [*command, "--instance", str(FIRST_INSTANCE), *arguments],
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=cwd,
            )

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            self.process.wait(REPORT_LIMIT_S)
        for pid in self.children().values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    @property
    def text(self) -> str:
        return self.log.read_text()

    def wait(self, limit_s: float) -> int:
        return self.process.wait(limit_s)

    def wait_until_flying(self, limit_s: float = 60.0) -> None:
        """Until a second has been simulated: all have spoken by then."""
        events = self.out / "events.jsonl"
        self.wait_until(lambda: events.is_file() and self._has_reached(1.0, events), limit_s)

    def wait_until(self, condition: Callable[[], bool], limit_s: float = 60.0) -> None:
        """Until it holds; the run must not end before."""
        until = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < until and self.process.poll() is None, self.text
            time.sleep(0.05)

    @staticmethod
    def _has_reached(time_s: float, events: Path) -> bool:
        *whole, _ = events.read_text().split("\n")
        return any(json.loads(line)["time_s"] >= time_s for line in whole)

    def children(self) -> dict[str, int]:
        """Processes of this run that are there now, by what they are ("camera_process uas"): pid."""
        found = dict[str, int]()
        for folder in Path("/proc").iterdir():
            if folder.name.isdigit():
                with contextlib.suppress(OSError):
                    words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
                    if len(words) > 6 and words[3].startswith("sitl_emu.run.") and str(self.out) in words[6]:
                        _, _, name = words[5].partition(" ")
                        found[f"{words[3].removeprefix('sitl_emu.run.')} {name}".strip()] = int(folder.name)
        return found
