"""Arms of a campaign: dotted keys, their values, and what is said of a wrong one."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions import registry
from sitl_emu.run import scenario as scenarios
from sitl_emu.run.campaign.arms import arms_of, changed, short_names, single, variation
from sitl_emu.run.scenario import Scenario, ScenarioError, load

TWO = {
    "name": "two",
    "world": "flat",
    "vehicles": [
        {"name": "uas", "model": "m600", "sensors": {"gps": "m8n"}},
        {"name": "ugv", "model": "rover", "camera": {"rate_hz": 5}},
    ],
}


@pytest.fixture
def two(tmp_path: Path) -> Path:
    path = tmp_path / "two.yaml"
    path.write_text(yaml.safe_dump(TWO))
    return path


def arm_names(path: Path, *vary: str) -> list[str]:
    return [arm.name for arm in arms_of(path, [variation(text) for text in vary])]


def test_without_a_variation_there_is_one_arm_the_scenario_as_it_is(two: Path) -> None:
    (arm,) = arms_of(two, [])
    assert arm.name == "two" and arm.values == {} and arm.scenario == load(two)


def test_several_variations_give_every_combination(two: Path) -> None:
    vary = ("wind.north_m_s=0,4", "peer_radio.loss=0,0.3", "world.options.x={a: 1},{a: 2}")
    assert arm_names(two, *vary[:2]) == [
        "north_m_s=0, loss=0",
        "north_m_s=0, loss=0.3",
        "north_m_s=4, loss=0",
        "north_m_s=4, loss=0.3",
    ]
    assert arm_names(two, vary[2]) == ["x=#1", "x=#2"], "a value that is no scalar has its number"
    arms = arms_of(two, [variation(text) for text in vary])
    assert len({arm.slug for arm in arms}) == 8 and arms[-1].scenario.peer_radio.loss == 0.3
    assert arms[-1].scenario.wind is not None and arms[-1].scenario.wind.north_m_s == 4.0
    assert arms[-1].scenario.world.options == {"x": {"a": 2}}


def test_a_vehicle_is_named_or_numbered_and_a_star_is_all_of_them(two: Path) -> None:
    def rates(key: str) -> list[float | None]:
        (arm,) = arms_of(two, [variation(f"{key}=8")])
        return [one.camera.rate_hz if one.camera is not None else None for one in arm.scenario.vehicles]

    assert rates("vehicles.ugv.camera.rate_hz") == rates("vehicles.1.camera.rate_hz") == [None, 8.0]
    assert rates("vehicles.*.camera.rate_hz") == [8.0, 8.0]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("wind.north_m_s", "give KEY=A,B with a dotted key"),
        ("=3", "give KEY=A,B with a dotted key"),
        ("wind.north_m_s=", "a value is missing"),
        ("wind.north_m_s=1,,2", "the values are no YAML"),
        ("wind.north_m_s=1,[2", "the values are no YAML"),
        ("start_date=2026-13-45", "the values are no YAML"),
        ("wind.north_m_s=1,1", "a value stands there twice"),
        ("seed=1,2", "--runs and --seed say which"),
    ],
)
def test_a_wrong_variation_is_named_with_the_remedy(text: str, wanted: str) -> None:
    with pytest.raises(ScenarioError) as error:
        variation(text)
    assert str(error.value).startswith(f"--vary {text}: ") and wanted in str(error.value)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (
            "winds.north_m_s=1",
            r"--vary winds.north_m_s=1: .*two.yaml: winds: unknown field; allowed here: format, name",
        ),
        ("wind.north_m_s=1,fast", r"--vary wind.north_m_s=fast: .*wind.north_m_s: 'fast': Input should be a valid num"),
        ("vehicles.uav.model=iris", r"vehicles.uav: no such entry; there are: uas, ugv, \*"),
        ("vehicles.2.model=iris", r"vehicles.2: no such entry"),
        ("vehicles.uas.sensors.gps.rate_hz=5", r"vehicles.uas.sensors.gps is 'm8n' there, which holds no fields"),
        ("faults.0.at_s=5", r"faults.0 is .*|faults: .*"),
    ],
)
def test_a_wrong_key_or_value_is_said_as_of_a_scenario(two: Path, text: str, wanted: str) -> None:
    with pytest.raises(ScenarioError, match=wanted):
        arm_names(two, text)


def test_a_key_given_twice_and_too_many_arms_are_refused(two: Path) -> None:
    with pytest.raises(ScenarioError, match="seed_x: this key is given twice"):
        arm_names(two, "world.options.seed_x=1", "world.options.seed_x=2")
    many = ",".join(map(str, range(40)))
    with pytest.raises(ScenarioError, match="1600 arms; at most 1000"):
        arm_names(two, f"wind.north_m_s={many}", f"wind.east_m_s={many}")


def test_a_world_file_and_options_files_are_whole_paths_so_that_an_arm_needs_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    yard = Path(__file__).parents[2] / "examples/own_world/yard.yaml"
    (tmp_path / "yard.yaml").write_text(yard.read_text())
    (tmp_path / "two.yaml").write_text(yaml.safe_dump(TWO | {"world": "yard.yaml"}))
    monkeypatch.chdir(tmp_path)
    (arm,) = arms_of(Path("two.yaml"), [])
    assert arm.scenario.world.kind == str(tmp_path / "yard.yaml")


@pytest.mark.parametrize("name", sorted(registry.scenarios()))
def test_an_arm_as_data_is_the_same_scenario_again(name: str) -> None:
    path = registry.scenarios()[name]
    (arm,) = arms_of(path, [])
    again = yaml.safe_load(yaml.safe_dump(arm.data))
    assert scenarios.checked(again, Path("/elsewhere/arm.yaml")) == arm.scenario


def test_one_run_takes_one_value_of_a_key(two: Path) -> None:
    assert single("vehicles.uas.camera.rate_hz=5") == ("vehicles.uas.camera.rate_hz", 5)
    with pytest.raises(ScenarioError, match=r"--vary wind.north_m_s=1,2: one value, for one run"):
        single("wind.north_m_s=1,2")


def test_the_scenario_of_the_file_stays_as_it_is(two: Path) -> None:
    data = scenarios.read(two)
    before = yaml.safe_dump(data)
    assert changed(data, [("vehicles.uas.start", {"north_m": 1.0, "east_m": 2.0})], two) != Scenario(**TWO)  # type: ignore[arg-type]
    assert yaml.safe_dump(data) == before


FIELDS = st.lists(st.sampled_from(["a", "b", "gps", "options"]), min_size=1, max_size=4).map(".".join)


@given(st.lists(FIELDS, min_size=1, max_size=6, unique=True))
def test_short_names_tell_all_keys_apart_and_end_them(keys: list[str]) -> None:
    names = short_names(keys)
    assert len(set(names.values())) == len(keys)
    assert all(key == name or key.endswith(f".{name}") for key, name in names.items())
