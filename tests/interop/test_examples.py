"""The examples run as the README says, side by side, and import of ours `sitl_emu` alone."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.launched import launched

EXAMPLES = Path(__file__).parents[2] / "examples"
ROOMS = {"vehicles", "autopilot", "gcs", "missions"}
FIRST_INSTANCE = 1
LIMIT_S = 270.0
URLS = {
    "mavsdk_takeoff_and_goto": "udpin://0.0.0.0:14541",
    "own_companion": "udpin:0.0.0.0:14542",
    "pymavlink_mission": "udpout:127.0.0.1:18573",
}
"""Each has a vehicle of its own."""
FLOWN_ELSEWHERE = {"ros2_offboard": "test_ros.py", "ros2_detector": "test_ros_detector.py"}


def test_every_example_is_run_here() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(URLS) | set(FLOWN_ELSEWHERE)


def test_every_example_flies_and_lands(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONWARNINGS": "ignore"}
    with launched(f"iris:{len(URLS)}", "--instance", str(FIRST_INSTANCE), "--speed", "4"):
        runs = {}
        for name, url in URLS.items():
            command = [sys.executable, str(EXAMPLES / f"{name}.py"), url]
            with (tmp_path / name).open("w") as output:
                runs[name] = subprocess.Popen(command, env=environment, stdout=output, stderr=subprocess.STDOUT)
        try:
            ended = {name: run.wait(LIMIT_S) for name, run in runs.items()}
        finally:
            for run in runs.values():
                run.kill()
                run.wait()
    for name, status in ended.items():
        said = (tmp_path / name).read_text()
        # MAVSDK's own threads may still log, on the same stream, while the process ends.
        assert (status, said.splitlines().count("landed")) == (0, 1), f"{name}:\n{said[-2000:]}"


@pytest.mark.parametrize("name", sorted((*URLS, *FLOWN_ELSEWHERE)))
def test_an_example_imports_nothing_of_ours_but_sitl_emu(name: str) -> None:
    imported = set[str]()
    for node in ast.walk(ast.parse((EXAMPLES / f"{name}.py").read_text())):
        if isinstance(node, ast.Import):
            imported |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported.add(node.module.split(".")[0])
    assert not imported & ROOMS
