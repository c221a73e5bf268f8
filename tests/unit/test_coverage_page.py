"""The coverage page says what the code does: it is generated, and this test holds it to date."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def generated() -> str:
    """The page as the code has it now; a process of its own, because tools/ is no package of ours."""
    code = "import runpy; print(runpy.run_path('tools/make_coverage.py')['page'](), end='')"
    plain = {**os.environ, "SITL_EMU_PURE": "1"}  # compiled modules do not tell who reads a parameter
    command = [sys.executable, "-c", code]
    return subprocess.run(command, cwd=ROOT, env=plain, check=True, capture_output=True, text=True).stdout


def test_the_page_is_up_to_date() -> None:
    page = (ROOT / "docs/coverage.md").read_text()
    assert page == generated(), "run: python tools/make_coverage.py"


def test_the_page_knows_who_reads_what_and_what_nobody_reads() -> None:
    page = (ROOT / "docs/coverage.md").read_text()
    wired, _, unread = page.partition("## Parameters")[2].partition(
        "Announced, as PX4's modules use them, but not read"
    )
    readers = {line.split("|")[1].strip(): line for line in wired.splitlines() if line.startswith("| `")}
    assert "MPC_XY_CRUISE" in readers["`autopilot/modes/auto.py`"]
    assert "RO_SPEED_LIM" in readers["`autopilot/control/rover_parameters.py`"]
    assert "SIH_WIND_N" in readers["`sitl_emu/run/simulated_parameters.py`"]
    for name in ("MC_ROLLRATE_P", "CA_ROTOR*n*_PX"):
        assert name in wired and name not in unread
    assert "FD_EXT_ATS_EN" in unread and "FD_EXT_ATS_EN" not in wired
