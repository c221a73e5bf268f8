"""The examples run as the README says, on one vehicle after the other, and import of ours `sitl_emu` alone."""

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.launched import launched

EXAMPLES = Path(__file__).parents[2] / "examples"
ROOMS = {"vehicles", "autopilot", "gcs", "missions"}
INSTANCE = 1
LIMIT_S = 110.0
URLS = {
    "mavsdk_takeoff_and_goto": f"udpin://0.0.0.0:{14540 + INSTANCE}",
    "own_companion": f"udpin:0.0.0.0:{14540 + INSTANCE}",
    "pymavlink_mission": f"udpout:127.0.0.1:{18570 + INSTANCE}",
}


@pytest.fixture(scope="module")
def vehicle() -> Iterator[None]:
    with launched("iris", "--instance", str(INSTANCE), "--speed", "4"):
        yield


def test_every_example_is_run_here() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(URLS)


@pytest.mark.usefixtures("vehicle")
@pytest.mark.parametrize("name", sorted(URLS))
def test_an_example_flies_and_lands(name: str) -> None:
    run = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), URLS[name]],
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    assert run.stdout.splitlines()[-1] == "landed"


@pytest.mark.parametrize("name", sorted(URLS))
def test_an_example_imports_nothing_of_ours_but_sitl_emu(name: str) -> None:
    imported = set[str]()
    for node in ast.walk(ast.parse((EXAMPLES / f"{name}.py").read_text())):
        if isinstance(node, ast.Import):
            imported |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported.add(node.module.split(".")[0])
    assert not imported & ROOMS
