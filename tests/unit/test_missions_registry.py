"""Missions are found by entry points: ours in any checkout, anybody's once installed; a broken one harms no other."""

import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sitl_emu.missions import registry
from sitl_emu.missions.mission import Setting
from sitl_emu.missions.registry import MissionError

ROOT = Path(__file__).parents[2]
GOOD = """
    from pathlib import Path
    from sitl_emu.missions.agriculture.inspect import Inspect
    from sitl_emu.missions.mission import Mission, Program

    MISSION = Mission({"garden": Program(Inspect.from_options)}, scenarios=Path(__file__).parent)
"""
Install = Callable[[str, str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs a package of one module, `garden`, as pip would: the module, and metadata with its entry point."""

    def install(source: str, value: str) -> None:
        (tmp_path / "garden.py").write_text(textwrap.dedent(source))
        info = tmp_path / "garden-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: garden\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[sitl_emu.missions]\ngarden = {value}\n")
        forget()

    def forget() -> None:
        registry.found.cache_clear()
        registry.mission.cache_clear()
        sys.modules.pop("garden", None)

    monkeypatch.syspath_prepend(tmp_path)
    yield install
    forget()


def test_a_mission_of_an_installed_package_is_one_of_them_and_so_is_its_scenario(
    install: Install, tmp_path: Path
) -> None:
    (tmp_path / "my-garden.yaml").write_text("name: my-garden\n")
    install(GOOD, "garden:MISSION")
    assert registry.make_companion("garden", {"look_s": 5}).status.phase == "connecting"
    assert registry.scenarios()["my-garden"] == tmp_path / "my-garden.yaml"
    assert {"garden", "agriculture-scout", "agriculture-inspect"} <= set(registry.programs())
    assert registry.broken() == []


def test_ours_are_found_in_a_checkout_whose_installation_knows_no_entry_points_yet(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(registry, "entry_points", lambda group: [])
    registry.found.cache_clear()
    assert "agriculture" in registry.found()
    assert {"agriculture", "agriculture-three-scouts"} <= set(registry.scenarios())
    registry.found.cache_clear()


@pytest.mark.parametrize(
    ("source", "value", "wanted"),
    [
        ("import no_such_thing", "garden:MISSION", "can't load garden:MISSION: ModuleNotFoundError: No module named"),
        ("1 / 0", "garden:MISSION", "can't load garden:MISSION: ZeroDivisionError"),
        ("", "garden:MISSION", "can't load garden:MISSION: AttributeError"),
        ("MISSION = 7", "garden:MISSION", "garden:MISSION is no Mission, but a int"),
    ],
)
def test_a_package_that_cannot_be_loaded_is_named_and_the_others_fly(
    install: Install, source: str, value: str, wanted: str
) -> None:
    install(source, value)
    with pytest.raises(MissionError, match=f"mission garden: {re.escape(wanted)}"):
        registry.make_companion("garden-scout", {})
    assert wanted in " ".join(registry.broken())
    assert registry.make_companion("agriculture-inspect", {}).status.done


def test_options_are_checked_by_name_type_and_range() -> None:
    for options, wanted in (
        ({"look_s": "long"}, "mission agriculture-inspect: option look_s: 'long'; allowed: a number from 0.5 to 60"),
        ({"look_s": 0.1}, "option look_s: 0.1; allowed: a number from 0.5 to 60"),
        ({"lok_s": 1}, "option lok_s: unknown; allowed: .*look_s"),
    ):
        with pytest.raises(MissionError, match=wanted):
            registry.make_companion("agriculture-inspect", options)


def test_what_a_program_needs_of_its_vehicle_is_checked_before_a_run(tmp_path: Path) -> None:
    blind = Setting("ugv", None, "flat", (0.0, 0.0, 0.0), (), tmp_path)
    with pytest.raises(MissionError, match="mission agriculture-inspect: it looks at camera frames; give its vehicle"):
        registry.prepare("agriculture-inspect", {}, blind)
    seeing = blind._replace(calibration=Path("camera.yaml"))
    assert registry.prepare("agriculture-inspect", {"look_s": 5}, seeing) == {"look_s": 5, "calibration": "camera.yaml"}


def test_nothing_that_serves_all_missions_knows_one_of_them() -> None:
    generic = [
        path for folder in ("sitl_emu/run", "missions/companion", "tools") for path in (ROOT / folder).glob("*.py")
    ]
    generic += [ROOT / "sitl_emu/cli.py", *(ROOT / "missions").glob("*.py")]
    words = re.compile(r"agriculture|\bweed|disease|scout|\bcorn\b", re.IGNORECASE)
    knowing = [path.relative_to(ROOT).as_posix() for path in generic if words.search(path.read_text())]
    assert not knowing
