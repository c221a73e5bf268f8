"""The MAVLink dialect is what its generator writes, and the generator is the one that the lock names."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_dialect_and_stubs_are_what_their_generator_writes() -> None:
    code = """if True:
        import runpy
        tool = runpy.run_path("tools/make_dialect.py")
        source = tool["made"]()
        print("\\0", source, "\\0", tool["stubs"](source), sep="", end="")"""
    said = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    _, made, stubs = said.split("\0")
    assert made == (ROOT / "sitl_emu/core/dialect.py").read_text(), "run: python tools/make_dialect.py"
    assert stubs == (ROOT / "sitl_emu/core/dialect.pyi").read_text(), "run: python tools/make_dialect.py"


def test_the_generator_is_locked() -> None:
    named = re.search(r'^PYMAVLINK = "(.*)"$', (ROOT / "tools/make_dialect.py").read_text(), re.M)
    assert named is not None
    assert f"pymavlink=={named[1]}" in (ROOT / "requirements-dev.lock").read_text().splitlines()
