"""What a campaign's runs read beside their scenarios: a campaign goes on only while it is the same."""

import contextlib
import json
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from sitl_emu.cli import app
from sitl_emu.missions import registry
from sitl_emu.run import checks
from sitl_emu.run.campaign import inputs, pools, store
from sitl_emu.run.campaign.arms import Arm, arms_of
from sitl_emu.run.campaign.flight import Job, Result
from sitl_emu.run.campaign.pools import Pool
from sitl_emu.run.trouble import Trouble

EXAMPLES = Path(__file__).parents[2] / "examples"
MESH = """v 0 0 0
v 0 1 0
v 1 0 0
v 0 0 1
f 1 2 3
f 1 2 4
f 1 3 4
f 2 3 4
"""
GAZEBO = """<sdf version="1.9"><world name="yard"><include><uri>model://hut</uri></include></world></sdf>"""
HUT = """<sdf version="1.9"><model name="hut"><static>true</static><link name="l"><collision name="c">
<pose>20 20 1 0 0 0</pose><geometry><box><size>2 2 %d</size></box></geometry></collision></link></model></sdf>"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A scenario that names a file of each kind."""
    shutil.copytree(EXAMPLES / "own_vehicle", tmp_path / "vehicle")
    (model,) = (path.parent for path in (tmp_path / "vehicle").rglob("vehicle.toml"))
    (tmp_path / "rock.obj").write_text(MESH)
    (tmp_path / "hut").mkdir()
    (tmp_path / "hut/model.sdf").write_text(HUT % 2)
    (tmp_path / "gazebo.sdf").write_text(GAZEBO)
    rock = {"name": "rock", "mesh": {"file": "rock.obj"}, "north_m": 10.0, "east_m": 10.0}
    (tmp_path / "yard.yaml").write_text(
        yaml.safe_dump({"format": 1, "name": "yard", "sdf": "gazebo.sdf", "solids": [rock]})
    )
    (tmp_path / "script.py").write_text("print(1)\n")
    (tmp_path / "aside.txt").write_text("1")
    vehicle = {"name": "uas", "model": str(model), "companion": {"command": ["{python}", "script.py", "nothing.py"]}}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump({"name": "own", "world": "yard.yaml", "vehicles": [vehicle]}))
    return tmp_path


def read(site: Path) -> tuple[list[Arm], dict[str, str]]:
    arms = arms_of(site / "own.yaml", [])
    world = checks.check(arms[0].scenario.model_copy(deep=True), 1, site / "own.yaml")
    return arms, inputs.contents(inputs.files_of(arms[0].scenario, world), inputs.programs_of(arms[0].scenario))


def edited(name: str, old: str, new: str) -> Callable[[Path], None]:
    def edit(site: Path) -> None:
        (path,) = site.rglob(name)
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return edit


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (edited("yard.yaml", "north_m: 10.0", "north_m: 12.0"), "yard.yaml"),
        (edited("model.sdf", "2 2 2", "2 2 3"), "yard.yaml"),
        (edited("rock.obj", "v 0 0 1", "v 0 0 2"), "rock.obj"),
        (edited("vehicle.toml", "mass_kg = ", "mass_kg = 1"), "vehicle.toml"),
        (edited("airframe.json", "}", " }"), "airframe.json"),
        (edited("script.py", "1", "2"), "script.py"),
        (edited("aside.txt", "1", "2"), ""),
        (edited("yard.yaml", "format", "# a comment\nformat"), ""),
    ],
)
def test_a_campaign_whose_files_were_edited_is_refused_with_the_one_that_was(
    site: Path, edit: Callable[[Path], None], named: str
) -> None:
    arms, before = read(site)
    folder = site / "c"
    with store.opened(folder, store.identity_of("own", 1, arms, before), arms) as kept:
        kept.keep(Result(arms[0].name, 1, {"outcome": "success"}))
    edit(site)
    _, after = read(site)
    again = store.identity_of("own", 1, arms, after)
    assert again.digest == store.identity_of("own", 1, arms, before).digest, "its folder is found, and says so"
    if not named:
        with store.opened(folder, again, arms) as kept:
            assert kept.doubt == ""
        return
    wanted = rf"/{named} has changed since its runs were flown: put back what was, or name a new folder with --out"
    with pytest.raises(Trouble, match=wanted):
        store.opened(folder, again, arms).__enter__()


def test_code_is_looked_at_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """sitl-emu's version does not move between commits; a mission's package need not have any."""
    (tmp_path / "own_mission_xyz").mkdir()
    code, cache = tmp_path / "own_mission_xyz/__init__.py", tmp_path / "own_mission_xyz/__pycache__/x.py"
    code.write_text("A = 1\n")
    cache.parent.mkdir()
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(registry, "modules_of", lambda _names: ["own_mission_xyz.mission", "sitl_emu.missions.x"])
    before = inputs.contents(set(), {"xyz"})
    assert list(before) == ["sitl-emu's own code", "the code of own_mission_xyz"]
    cache.write_text("no code of anybody's")
    assert inputs.contents(set(), {"xyz"}) == before
    code.write_text("A = 2\n")
    assert [name for name, now in inputs.contents(set(), {"xyz"}).items() if now != before[name]] == [
        "the code of own_mission_xyz"
    ]


def test_sitl_emus_own_code_is_all_that_runs_are_made_of() -> None:
    names = {name for module in inputs.OURS for name, _ in inputs._sources(module)}
    wanted = {"sitl_emu/run/world_process.py", "sitl_emu.vehicles/m600/vehicle.toml", "sitl_emu.gcs/__init__.py"}
    assert wanted <= names
    assert any(name.endswith("/field.onnx") for name in names)
    assert not any("/campaign/" in name or name.endswith(".pyc") for name in names)


def test_the_modules_of_missions_are_found_by_their_programs() -> None:
    (module,) = registry.modules_of({"agriculture-scout"})
    assert module.startswith("sitl_emu.missions.agriculture")


def test_a_folder_from_before_hashes_were_kept_goes_on_with_a_word_of_doubt(site: Path) -> None:
    arms, contents = read(site)
    identity, folder = store.identity_of("own", 1, arms, contents), site / "c"
    with store.opened(folder, identity, arms) as kept:
        kept.keep(Result(arms[0].name, 1, {"outcome": "success"}))
    there = json.loads((folder / store.IDENTITY).read_text())
    del there[store.CONTENTS]
    (folder / store.IDENTITY).write_text(json.dumps(there))
    with store.opened(folder, identity, arms) as kept:
        assert "kept no hashes: whether files have changed since can't be told" in kept.doubt
        assert kept.kept(arms[0].name, 1) is not None
    with store.opened(folder, identity, arms) as kept:
        assert kept.doubt == ""


def test_what_changes_before_a_run_is_there_changes_nothing(site: Path) -> None:
    arms, before = read(site)
    for contents in (before, {**before, "sitl-emu's own code": "another"}):
        with store.opened(site / "c", store.identity_of("own", 1, arms, contents), arms) as kept:
            assert kept.doubt == ""


def campaign(site: Path, monkeypatch: pytest.MonkeyPatch, runs: int, during: Callable[[], None]) -> tuple[int, str]:
    """Exit status and what is said of a campaign whose runs come to something at once; `during`: each."""

    @contextlib.contextmanager
    def opened(_workers: int) -> Iterator[Pool]:
        def submit(job: Job) -> "Future[Result]":
            future = Future[Result]()
            during()
            future.set_result(Result(job.arm, job.seed, {"outcome": "success"}))
            return future

        yield Pool(submit, lambda: None, 1, "far away")

    monkeypatch.setattr(pools, "here", opened)
    monkeypatch.chdir(site)
    vehicle = {"name": "uas", "model": "iris"}
    Path("own.yaml").write_text(yaml.safe_dump({"name": "own", "world": "yard.yaml", "vehicles": [vehicle]}))
    done = CliRunner().invoke(app, ["campaign", "own.yaml", "--runs", str(runs)])
    return done.exit_code, " ".join(done.output.split())


def test_the_command_itself_says_so_before_anything_is_flown(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert campaign(site, monkeypatch, 1, lambda: None)[0] == 0
    edited("rock.obj", "v 0 0 1", "v 0 0 2")(site)
    status, text = campaign(site, monkeypatch, 2, lambda: pytest.fail("flown"))
    assert status == 2 and "rock.obj has changed since its runs were flown" in text
    edited("rock.obj", "v 0 0 2", "v 0 0 1")(site)
    assert campaign(site, monkeypatch, 2, lambda: None)[0] == 0


def test_what_changes_while_runs_are_flown_is_said_at_the_end(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status, text = campaign(site, monkeypatch, 1, lambda: edited("rock.obj", "v 0 0 1", "v 0 0 2")(site))
    assert status == 1 and "1 of 1 runs are there" in text
    assert "rock.obj has changed while runs were flown, which have read the one or the other: begin again" in text
