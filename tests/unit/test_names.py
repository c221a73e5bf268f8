"""Names that can't clash: everything of ours is found under sitl_emu, whatever lies beside a user's script."""

import ast
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import setuptools

ROOT = Path(__file__).parents[2]
ROOMS = ("vehicles", "autopilot", "gcs", "missions")
FOLDERS = (*ROOMS, "sitl_emu", "tests", "tools", "examples")
OURS = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
MODULES = ("companion", "mission", "cli", "vehicles", "gcs", "missions.registry", "run.scenario", "autopilot.autopilot")


def test_nothing_of_ours_imports_a_room_by_its_bare_name() -> None:
    """It would be another module than sitl_emu's, with a state of its own, and the user's where the user has one."""
    bare = set[str]()
    for path in OURS:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module and not node.level else []
            bare |= {f"{path.relative_to(ROOT)}: {name}" for name in names if name.split(".")[0] in ROOMS}
    assert not bare


def test_what_is_installed_is_sitl_emu_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    told = dict[str, Any]()
    monkeypatch.setattr(setuptools, "setup", told.update)
    monkeypatch.chdir(ROOT)
    runpy.run_path("setup.py")
    assert {name.split(".")[0] for name in told["packages"]} == {"sitl_emu"}
    assert {f"sitl_emu.{room}": room for room in ROOMS}.items() <= told["package_dir"].items()
    assert {"sitl_emu.autopilot.modes", "sitl_emu.missions.agriculture.scenarios"} <= {*told["packages"]}


def test_a_users_own_files_of_these_names_are_the_users(tmp_path: Path) -> None:
    for name in ("gcs", "vehicles", "autopilot"):
        (tmp_path / f"{name}.py").write_text("OWN = True\n")
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions/__init__.py").write_text("OWN = True\n")
    imports = "".join(f"import sitl_emu.{name}\n" for name in MODULES)
    script = tmp_path / "script.py"
    own = "autopilot, gcs, missions, vehicles"
    script.write_text(f"{imports}import {own}\nprint(all(module.OWN for module in ({own})))\n")
    done = subprocess.run([sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "True", done.stderr
