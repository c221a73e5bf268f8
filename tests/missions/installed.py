"""Missions for tests, found as an installed package's are: by their entry points."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from tests.missions.runs import FIRST_INSTANCE

YARD = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
LIMIT_S = 340.0


def run_in_yard(
    folder: Path,
    module: str,
    vehicle: dict[str, object],
    options: dict[str, object] | None = None,
    status: int = 0,
    arguments: Sequence[str] = (),
    **changes: object,
) -> Path:
    """Run the mission of MODULE.py beside this file in examples/own_world, its option `folder` being this one, or with
    other options. The exit status must be `status`; `arguments` are added to the command's.

    Gives the run's folder.
    """
    program = module.replace("_", "-")
    shutil.copy(Path(__file__).with_name(f"{module}.py"), folder)
    shutil.copy(YARD, folder)
    packed = folder / f"{module}-1.dist-info"
    packed.mkdir()
    (packed / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {program}\nVersion: 1\n")
    (packed / "entry_points.txt").write_text(f"[sitl_emu.missions]\n{program} = {module}:MISSION\n")
    companion = {"mission": program, "options": {"folder": str(folder)} if options is None else options}
    scenario = {
        "name": program,
        "world": "yard.yaml",
        "time_limit_s": 150,
        "vehicles": [vehicle | {"companion": companion}],
    }
    (folder / "scenario.yaml").write_text(yaml.safe_dump(scenario | changes))
    command = ["run", str(folder / "scenario.yaml"), "--speed", "max", "--out", str(folder / "run"), *arguments]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "sitl_emu", *command, "--instance", str(FIRST_INSTANCE)],
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == status, done.stdout + done.stderr
    return folder / "run"
