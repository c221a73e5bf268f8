"""A mission of one's own, as the README says: a package outside the checkout, installed, run by its scenario's name."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.missions.runs import FIRST_INSTANCE

ROOT = Path(__file__).parents[2]
LIMIT_S = 300.0


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with examples/own_mission installed in it."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copytree(ROOT / "examples/own_mission", folder / "own_mission")  # pip builds beside the sources
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", str(folder / "site"), str(folder / "own_mission")], check=True)
    shutil.rmtree(folder / "own_mission")
    return folder / "site"


def sitl_emu(site: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Runs `sitl-emu` from outside the checkout, with the package installed."""
    return subprocess.run(
        [sys.executable, "-P", "-m", "sitl_emu", *words],
        cwd=site.parent,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )


def test_the_readme_says_what_is_tested_here() -> None:
    readme = (ROOT / "README.md").read_text()
    assert re.search(r"pip install \./examples/own_mission\n\s+sitl-emu run lookout", readme)


def test_it_is_listed_with_the_others(site: Path) -> None:
    listed = sitl_emu(site, "run").stdout
    assert re.search(r"^lookout +A quadrotor goes up", listed, re.MULTILINE)
    assert re.search(r"^agriculture +", listed, re.MULTILINE)


def test_it_flies_scores_itself_by_the_truth_and_adds_its_page_to_the_report(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    done = sitl_emu(site, "run", "lookout", "--speed", "max", "--instance", str(FIRST_INSTANCE), "--out", str(out))
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((out / "summary.json").read_text())
    assert summary["outcome"] == "success"
    (row,) = summary["lookouts"]
    assert row["vehicle"] == "tower" and 0.0 < row["height_error_m"] < 1.0 and row["drift_m"] < 2.0
    assert f"tower looked out within {row['height_error_m']:.2f} m of its height" in done.stdout
    page = (out / "report.html").read_text()
    assert "<h2>Lookouts</h2>" in page and f"<td>tower</td><td>{row['height_error_m']}</td>" in page


def test_a_wrong_option_is_named_before_anything_starts(site: Path, tmp_path: Path) -> None:
    scenario = (site / "lookout/scenarios/lookout.yaml").read_text().replace("height_m: 12", "height_m: 1200")
    (tmp_path / "high.yaml").write_text(scenario)
    done = sitl_emu(site, "run", str(tmp_path / "high.yaml"))
    assert done.returncode == 2
    wanted = "vehicles.0.companion: mission lookout: option height_m: 1200; allowed: a number from 2 to 100"
    assert wanted in " ".join(done.stderr.split())
