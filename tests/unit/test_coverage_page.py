"""The coverage page says what the code does: it is generated, and this test holds it to date."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def generated() -> str:
    """The page as the code has it now; a process of its own, because tools/ is no package of ours."""
    code = "import runpy; print(runpy.run_path('tools/make_coverage.py')['page'](), end='')"
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def test_the_page_is_up_to_date() -> None:
    page = (ROOT / "docs/coverage.md").read_text()
    assert page == generated(), "run: python tools/make_coverage.py"


def test_the_page_knows_what_is_wired_and_what_is_not() -> None:
    page = (ROOT / "docs/coverage.md").read_text()
    wired = page.partition("## Parameters")[2]
    for name in ("MPC_XY_CRUISE", "MC_ROLLRATE_P", "CA_ROTOR*n*_PX", "RO_SPEED_LIM"):
        assert name in wired
    assert "EKF2_DRAG_CTRL" not in wired  # served, but no wind is estimated from drag
