"""What a command imports before it does something: the time until a vehicle is heard of is mostly that of imports."""

import gc
import json
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from sitl_emu.run import memory

HEAVY = {
    "cv2",
    "matplotlib",
    "numba",
    "onnxruntime",
    "PIL",
    "pydantic",
    "pybullet",
    "scipy",
    "shapely",
    "trimesh",
    "yaml",
}
"""Libraries that no launch on the plain needs."""
OF_RUNS = {
    "sitl_emu.run.configs",
    "sitl_emu.run.control",
    "sitl_emu.missions",
    "sitl_emu.core.dialect_enums",
    "sitl_emu.world.world",
}
"""What of ours belongs to runs, worlds and tools."""


def imported_by(statements: str) -> set[str]:
    """The names of all modules of a new Python process after these statements."""
    code = f"import json, sys\n{statements}\nprint(json.dumps(list(sys.modules)))"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    return set(json.loads(said))


def test_help_and_version_import_the_command_line_alone() -> None:
    imported = imported_by("import sitl_emu.cli")
    ours = {name for name in imported if name.startswith("sitl_emu")}
    assert ours - {"sitl_emu", "sitl_emu.compiled"} == {
        f"sitl_emu.cli{part}" for part in ("", "_campaign", "_words", "_world")
    }
    assert not imported & {"numpy", "hashlib", "tempfile", *HEAVY}


def test_numpy_starts_no_threads_in_a_vehicle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    (tmp_path / "file").touch()
    imported = imported_by(f"""
import contextlib, math, os, pathlib
from sitl_emu.run import launch
from sitl_emu.run.trouble import Trouble
assert "numpy" not in sys.modules
options = launch.Options(math.inf, launch.PX4_HOME, None, pathlib.Path({str(tmp_path / "file")!r}), False)
with contextlib.suppress(Trouble):
    launch.launch([launch.Wanted("iris", 0)], options, print)
assert len(os.listdir("/proc/self/task")) == 1""")
    assert "numpy" in imported


def test_a_launch_imports_nothing_of_runs_and_worlds() -> None:
    imported = imported_by("import sitl_emu.run.launch, sitl_emu.run.launched")
    assert "sitl_emu.autopilot.autopilot" in imported
    assert not imported & (HEAVY | OF_RUNS)


def test_the_garbage_collector_rests_while_a_process_is_set_up(monkeypatch: pytest.MonkeyPatch) -> None:
    frozen = list[None]()
    monkeypatch.setattr(gc, "freeze", lambda: frozen.append(None))
    with memory.all_stays():
        assert not gc.isenabled()
    assert gc.isenabled() and len(frozen) == 1
    with pytest.raises(ZeroDivisionError), memory.all_stays():
        raise ZeroDivisionError
    assert gc.isenabled()


GIVEN_BACK = """
import re, sys
from pathlib import Path
import numpy as np
from sitl_emu.run.memory import large_goes_back

def given_back_kib():
    large, above = np.ones(2 << 20), np.ones(1000)
    before_kib = resident_kib()
    del large
    return before_kib - resident_kib()

def resident_kib():
    return int(re.search(r"VmRSS:\\s+(\\d+)", Path("/proc/self/status").read_text())[1])

np.ones(3 << 20)  # freed: glibc takes 24 MiB for small from now on
if sys.argv[1] == "left alone":
    print(given_back_kib())
else:
    with large_goes_back():
        print(given_back_kib())
    print(given_back_kib())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="glibc's own options")
def test_large_arrays_are_given_back_while_a_scene_is_built_and_kept_later() -> None:
    def given_back_kib(how: str) -> list[int]:
        """In a process of its own: into room that was left in the heap, large arrays are put again."""
        done = subprocess.run([sys.executable, "-c", GIVEN_BACK, how], capture_output=True, text=True, check=True)
        return [int(line) for line in done.stdout.split()]

    meanwhile, later = given_back_kib("built")
    assert meanwhile > 15 * 1024
    assert given_back_kib("left alone")[0] < 1024 and later < 1024
