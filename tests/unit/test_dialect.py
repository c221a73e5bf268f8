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
        for path, text in tool["files"](tool["made"]()).items():
            print("\\0", path, "\\0", text, sep="", end="")"""
    said = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    _, *written = said.split("\0")
    paths = [Path(path) for path in written[::2]]
    assert {path.name for path in paths} == {"dialect.py", "dialect_enums.py", "dialect.pyi"}
    for path, text in zip(paths, written[1::2], strict=True):
        assert text == path.read_text(), "run: python tools/make_dialect.py"


def test_the_generator_is_locked() -> None:
    named = re.search(r'^PYMAVLINK = "(.*)"$', (ROOT / "tools/make_dialect.py").read_text(), re.M)
    assert named is not None
    assert f"pymavlink=={named[1]}" in (ROOT / "requirements-dev.lock").read_text().splitlines()
