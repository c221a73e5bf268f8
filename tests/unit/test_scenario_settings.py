"""What a scenario may set: wind, light, sensors' figures, a model of one's own; and what is said of a wrong one."""

import shutil
import statistics
from pathlib import Path

import pytest
import yaml

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import HilGps
from sitl_emu.run import checks, models, worlds
from sitl_emu.run.scenario import Scenario, ScenarioError, load
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator
from tests.typed import present

HERE = Home(47.397742, 8.545594, 489.4, 0.0)
M_PER_1E7_DEG = 0.0111319


def scenario(folder: Path, vehicle: dict[str, object] | None = None, top: dict[str, object] | None = None) -> Scenario:
    uas = {"name": "uas", "model": "iris"} | (vehicle or {})
    path = folder / "own.yaml"
    path.write_text(yaml.safe_dump({"name": "own", "world": {"kind": "corn_field"}, "vehicles": [uas]} | (top or {})))
    read = load(path)
    checks.check(read, 1, path)
    return read


def own_model(folder: Path) -> Path:
    return Path(shutil.copytree(vehicles.FOLDER / "iris", folder / "my_quad"))


def test_wind_and_light_are_the_scenarios(tmp_path: Path) -> None:
    settings = {"wind": {"north_m_s": 5, "east_m_s": -2}, "light": {"elevation_deg": 20, "warmth": 1.4}}
    asked = scenario(tmp_path, top=settings)
    world, before = worlds.build("corn_field", 1, {}, asked.changes), worlds.build("corn_field", 1, {})
    assert world.wind.at(10_000_000) == (5.0, -2.0, 0.0), "where the air moves to"
    light = world.description.light
    assert (light.elevation_deg, light.warmth) == (20.0, 1.4)
    assert light.azimuth_deg == before.description.light.azimuth_deg, "what is left out stays the world's"
    assert before.wind.at(10_000_000) != (0.0, 0.0, 0.0)


def gps_north_m(vehicle: vehicles.Vehicle) -> list[float]:
    simulator = VehicleSimulator(vehicle, HERE, seed=1, terrain=FlatGround())
    seen = [message for _ in range(250 * 60) for message in simulator.tick(None) if isinstance(message, HilGps)]
    return [(fix.lat - HERE.lat_deg * 1e7) * M_PER_1E7_DEG for fix in seen]


def test_a_sensors_figure_reaches_the_simulator(tmp_path: Path) -> None:
    figures = {"gps": {"rate_hz": 5, "noise_horizontal_m": 2.1, "drift_horizontal_m": 0.0, "satellites": 7}}
    changed = models.as_set(scenario(tmp_path, {"sensors": figures}).vehicles[0].model_data)
    seen = gps_north_m(changed)
    assert len(seen) == pytest.approx(60 * 5, abs=2) and statistics.stdev(seen) == pytest.approx(2.1, rel=0.15)
    assert changed.airframe["SIM_GPS_USED"] == 7
    assert changed.sensors.imu == vehicles.load("iris").sensors.imu, "what is not named stays"


def test_a_sensor_that_a_model_lacks_can_be_given_whole() -> None:
    bare = vehicles.with_sensors(vehicles.load("iris"), {})
    assert bare == vehicles.load("iris")
    rover = vehicles.load("sihsim_rover_ackermann")
    lidar = {"min_distance_m": 0.1, "max_distance_m": 10, "noise_m": 0.02, "rate_hz": 20}
    assert vehicles.with_sensors(rover, {"lidar": lidar}).sensors.lidar is not None


def test_a_model_of_ones_own_is_found_beside_the_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_model(tmp_path)
    monkeypatch.chdir("/")
    for written in ("my_quad", "./my_quad"):
        data = scenario(tmp_path, {"model": written}).vehicles[0].model_data
        assert data.model == str(tmp_path / "my_quad") and models.as_set(data).model == "my_quad"


def test_a_model_of_ones_own_is_found_from_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_model(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert vehicles.load("my_quad").mass_kg == vehicles.load("./my_quad").mass_kg == vehicles.load("iris").mass_kg


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (
            {"sensors": {"gps": {"rat_hz": 5}}},
            r"vehicles.0.sensors: gps: unknown field 'rat_hz' = 5; allowed are: rate",
        ),
        ({"sensors": {"gps": {"rate_hz": 500}}}, r"sensors: gps: rate_hz = 500 is out of range; allowed is 1 to 50"),
        ({"sensors": {"sonar": {}}}, r"sensors: unknown field 'sonar' = {}; allowed are: imu, magnetometer, baro"),
        ({"sensors": {"gps": 5}}, r"sensors: gps = 5 must be a table"),
        ({"sensors": 5}, r"vehicles.0.sensors: 5: must be a mapping"),
        (
            {"model": "./nowhere"},
            r"vehicles.0.model: .*nowhere/vehicle.toml: No such file .* holds vehicle.toml and air",
        ),
        (
            {"depth": {"fov": 5}},
            r"vehicles.0.depth.fov: unknown field; allowed here: mount, resolution, hfov_deg, reach_m",
        ),
        ({"depth": {"resolution": [4, 48]}}, r"depth.resolution.0: 4: Input should be greater than or equal to 8"),
        ({"depth": {"mount": "nose"}}, r"vehicles.0.depth.mount: 'nose': known: nadir, mast, gimbal, or {forward_m: "),
        ({"lidar": {"range_m": [9, 2]}}, r"vehicles.0.lidar.range_m: \[9, 2\]: the nearest range, then the farthest"),
        (
            {"lidar": {"mount": {"up_m": 2}}},
            r"lidar.mount.up_m: unknown field; allowed here: forward_m, right_m, down_m",
        ),
        ({"model": "irs"}, r"vehicles.0.model: 'irs': there is no such model; known: iris, .* folder of your own"),
    ],
)
def test_a_wrong_vehicle_is_told(tmp_path: Path, wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        scenario(tmp_path, wrong)


def test_a_count_is_so_many_vehicles_at_following_places_and_one_swarm(tmp_path: Path) -> None:
    three = {"count": 3, "model": "responder", "parcel": {}, "camera": {}, "companion": {"mission": "disaster"}}
    world = {"kind": "urban_flood", "options": {"size_m": 100}}
    asked = scenario(tmp_path, three, {"world": world})
    assert [(one.name, one.start) for one in asked.vehicles] == [
        ("uas", "home"), ("uas2", "home2"), ("uas3", "home3")
    ]  # fmt: skip
    assert checks.together(asked, 4) == {name: [5, 6, 7] for name in ("uas", "uas2", "uas3")}
    assert "count" not in asked.model_dump()["vehicles"][0] and asked.vehicles[1].parcel == {}
    (tmp_path / "again.yaml").write_text(yaml.safe_dump(asked.model_dump(mode="json")))
    assert load(tmp_path / "again.yaml") == asked
    asked.vehicles[2].companion.options["margin_m"] = 3  # type: ignore[union-attr]
    assert checks.together(asked) == {"uas": [1, 2], "uas2": [1, 2], "uas3": [3]}, "with options alike"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"count": 0}, r"vehicles.0.count: 0: Input should be greater than or equal to 1"),
        ({"count": 41}, r"vehicles.0.count: 41: Input should be less than or equal to 40"),
        (
            {"count": 2, "start": {"north_m": 1, "east_m": 2}},
            "a `count` above 1 needs a place of the world by its name",
        ),
        ({"count": 2}, r"vehicles.1.start: 'home2': no place of this world; known: home, ugv"),
    ],
)
def test_a_wrong_count_is_told(tmp_path: Path, wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        scenario(tmp_path, wrong)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"wind": {"north": 5}}, r"wind.north: unknown field; allowed here: north_m_s, east_m_s, gust_m_s"),
        ({"wind": {"gust_m_s": -1}}, r"wind.gust_m_s: -1: Input should be greater than or equal to 0"),
        (
            {"light": {"sun": 5}},
            r"light.sun: unknown field; allowed here: .*, warmth, visibility_m",
        ),
        ({"light": {"elevation_deg": 0}}, r"light.elevation_deg: 0: Input should be greater than or equal to 5"),
    ],
)
def test_wrong_wind_and_light_are_told(tmp_path: Path, wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        scenario(tmp_path, top=wrong)


def test_a_parameter_that_px4_does_not_know_is_named(tmp_path: Path) -> None:
    airframe = own_model(tmp_path) / "airframe.json"
    airframe.write_text(airframe.read_text().replace('"MPC_THR_HOVER"', '"MPC_THR_HOOVER"'))
    with pytest.raises(
        ScenarioError, match=r"my_quad/airframe.json: MPC_THR_HOOVER: PX4 v1.18 knows no such parameter"
    ):
        scenario(tmp_path, {"model": "my_quad"})


FEEDS_OF_A_MODEL = """
[depth]
resolution = [32, 24]
reach_m = 4.5
mount = { forward_m = 0.2, depression_deg = 15 }

[lidar]
rows = 4
range_m = [0.3, 30]
"""


def test_a_feed_s_figures_are_the_model_s_where_a_scenario_leaves_them_out(tmp_path: Path) -> None:
    toml = own_model(tmp_path) / "vehicle.toml"
    toml.write_text(toml.read_text() + FEEDS_OF_A_MODEL)
    asked = scenario(tmp_path, {"model": "my_quad", "depth": {"reach_m": 6.0}, "lidar": {}})
    (uas,) = asked.vehicles
    depth, lidar = present(uas.depth_description), present(uas.lidar_description)
    assert (depth.camera.width_px, depth.camera.height_px, depth.reach_m, depth.camera.rate_hz) == (32, 24, 6.0, 5.0)
    assert (depth.camera.place_m, depth.camera.depression_deg) == ((0.2, 0.0, 0.0), 15.0)
    assert (lidar.rows, lidar.columns, lidar.range_m) == (4, 180, (0.3, 30.0))
    as_run = tmp_path / "as_run.yaml"
    as_run.write_text(yaml.safe_dump(asked.model_dump(mode="json")))
    toml.write_text(toml.read_text().replace("rows = 4", "rows = 5"))
    vehicles.load.cache_clear()
    assert present(load(as_run).vehicles[0].lidar_description).rows == 4, "a run's own scenario says all by itself"
    (without,) = scenario(tmp_path, {"model": "my_quad"}).vehicles
    assert without.depth_description is None, "a scenario says whether there is one, as of the camera"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("[depth]\nreach_m = 0", r"my_quad/vehicle.toml: depth.reach_m: Input should be greater than 0"),
        ("[depth]\nfov = 5", r"my_quad/vehicle.toml: depth.fov: Extra inputs are not permitted"),
        ("[lidar]\nrange_m = [9, 2]", r"my_quad/vehicle.toml: lidar.range_m: the nearest range, then the farthest"),
        ("[lidar]\nmount = { up_m = 2 }", r"my_quad/vehicle.toml: lidar.mount.up_m: Extra inputs"),
    ],
)
def test_a_wrong_feed_in_a_model_s_data_is_told_with_the_file(tmp_path: Path, table: str, said: str) -> None:
    toml = own_model(tmp_path) / "vehicle.toml"
    toml.write_text(f"{toml.read_text()}\n{table}\n")
    with pytest.raises(ScenarioError, match=said):
        scenario(tmp_path, {"model": "my_quad", "depth": {}, "lidar": {}})
