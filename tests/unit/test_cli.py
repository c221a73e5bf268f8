"""The command line: help that a first-time user understands, and one clear line for every wrong input."""

import errno
import os
import socket
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sitl_emu import vehicles
from sitl_emu.cli import app
from sitl_emu.core import ports

GOOD = """
name: small
world: {kind: corn_field}
vehicles:
  - {name: uas, model: m600, start: home}
"""


def call(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(arguments))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, " ".join(result.output.split())


def test_help_names_every_command_and_where_to_start() -> None:
    status, text = call("--help")
    assert status == 0
    for word in ("run", "launch", "world", "sitl-emu run", "QGroundControl"):
        assert word in text


def test_the_version_is_the_installed_one() -> None:
    assert call("--version") == (0, f"sitl-emu {metadata.version('sitl-emu')}")


def test_the_help_of_launch_names_every_vehicle() -> None:
    text = call("launch", "--help")[1]
    assert [model for model in vehicles.models() if model not in text] == []


@pytest.mark.parametrize("command", ["run", "launch", "world"])
def test_every_command_explains_itself(command: str) -> None:
    status, text = call(command, "--help")
    assert status == 0 and "--speed" in text and "times real time" in text.lower()


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (("run", "agricultur"), "there is no scenario 'agricultur'; missions bring: agriculture"),
        (("run", "nowhere.yaml"), "nowhere.yaml: there is no such scenario file"),
        (("run", "agriculture", "--speed", "fast"), "--speed fast: give a number above 0"),
        (("run", "agriculture", "--speed", "-1"), "--speed -1: give a number above 0"),
        (("run", "agriculture", "--gcs", "host:port"), "--gcs host:port: give HOST or HOST:PORT"),
        (("launch", "iris", "--gcs", "192.168.1..20"), "--gcs 192.168.1..20: there is no host '192.168.1..20'"),
        (("launch", "iris", "--gcs", "host:²"), "--gcs host:²: give HOST or HOST:PORT"),
        (("launch", "iriss"), "unknown vehicle model 'iriss'; there are: iris,"),
        (("launch", "iris:many"), "iris:many: give MODEL or MODEL:COUNT"),
        (("launch", "iris", "--home", "47,8"), "--home 47,8: give LAT,LON,ALT,HEADING"),
        (("launch", "iris", "--home", "147,8,0,0"), "latitude is -90..90"),
        (("launch", "iris", "--home", "47,8,0,inf"), "heading -360..360"),
        (("launch", "iris", "--home", "47,8,0,0", "--world", "flat"), "a world has its own home; give one of them"),
        (("launch", "iris", "--world", "nowhere"), "there is no world 'nowhere'"),
        (("launch", "iris:0"), "iris:0: give MODEL or MODEL:COUNT"),
        (("launch", "iris:3", "rover:2", "--instance", "246"), "the last instance is 249"),
        (("run", "agriculture", "--speed", "0"), "--speed 0: give a number above 0"),
        (("run", "agriculture", "--seed", "-1"), "-1 is not in the range"),
        *(
            ((*command, "--seed", "9007199254740993"), "9007199254740993 is not in the range 0<=x<=9007199254740992")
            for command in (
                ("run", "disaster-together"),
                ("launch", "iris"),
                ("world", "flat", "--vehicle", "iris"),
                ("world", "preview", "flat"),
                ("world", "export", "flat"),
                ("campaign", "disaster-together", "--runs", "1"),
            )
        ),
        (("run", "agriculture", "--instance", "249"), "instances end at 249"),
        (("run", "agriculture", "--instance", "9"), "would share UDP port 14549"),
        (
            ("run", "--seed", "3"),
            "--seed: name a scenario to run; `sitl-emu run` alone lists those that missions bring",
        ),
        (("run", "agriculture", "--isolated", "--instance", "3"), "--isolated and --instance: an isolated run is on"),
        (
            ("world", "export", "flat", "--vehicle", "uas"),
            "--vehicle: for pictures that a vehicle took: name the",
        ),
        (("world", "export", "flat", "--every", "1"), "--every: for pictures that a vehicle took: name the folder of"),
        (
            ("run", "agriculture", "--world", "flat"),
            "--world flat: agriculture does not fit it: world flat has no option 'size_m': only things, which any "
            "world has; its options are for a world of its own: copy ",
        ),
        (("rerun", "nowhere"), "nowhere: there is no such folder; name one that `sitl-emu run` has made"),
        (("detect", "x.mp4", "--model", "field", "--score", "nan"), "--score nan: give a finite number"),
        (("world", "moon", "--vehicle", "iris"), "there is no world 'moon'; known: corn_field, debris_field"),
        (("world", "flat", "--vehicle", "iriss"), "unknown vehicle model 'iriss'"),
    ],
)
def test_wrong_input_gives_one_line_that_says_what_is_allowed(arguments: tuple[str, ...], wanted: str) -> None:
    status, text = call(*arguments)
    assert status == 2
    assert wanted in text
    assert "Traceback" not in text


def test_a_launch_refuses_a_state_folder_that_cannot_hold_files(tmp_path: Path) -> None:
    (tmp_path / "iris-0").write_text("in the way")
    status, text = call("launch", "iris", "--state", str(tmp_path))
    assert status == 2
    assert f"{tmp_path / 'iris-0'}: can't keep files there: File exists; name another folder with --state" in text


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        (("model: m600", "model: m6000"), "vehicles.0.model: 'm6000': there is no such model; known: iris"),
        (("start: home", "start: barn"), "vehicles.0.start: 'barn': no place of this world; known: home"),
        (("start: home", "strat: home"), "vehicles.0.strat: unknown field; allowed here: name, model, start"),
        (("corn_field", "cornfield"), "there is no world 'cornfield'; known: corn_field, debris_field"),
        (("{kind: corn_field}", "{kind: corn_field, options: {siz_m: 1}}"), "no option 'siz_m'; it knows size_m"),
        (("{kind: corn_field}", "{kind: corn_field, options: {size_m: [9, 9]}}"), "must be 60 to 400 m"),
        (("name: small", "seed: -1\nname: small"), "seed: -1: Input should be greater than or equal to 0"),
        (
            ("name: small", "seed: 9007199254740993\nname: small"),
            "seed: 9007199254740993: Input should be less than or equal to 9007199254740992",
        ),
        (
            ("start: home}", "camera: {mount: nadir}, companion: {mission: farming}}"),
            "there is no mission 'farming'; there are:",
        ),
        (
            ("start: home}", "companion: {mission: agriculture-inspect}}"),
            "vehicles.0.companion: mission agriculture-inspect: it looks at",
        ),
        (("start: home}", "companion: {}}"), "companion: (mapping): give either `mission` or `command`"),
        (("start: home}", "camera: {mount: nose}}"), "camera.mount: 'nose': known: nadir, mast"),
        (("{kind: corn_field}", "{kind: corn_field, options: {size_m: [9]}}"), "size_m: [9]; must be two numbers"),
        (("{kind: corn_field}", "{kind: corn_field, options: {targets: many}}"), "targets: 'many'; must be a whole"),
        (("{kind: corn_field}", "[corn_field]"), "['corn_field']: must be a mapping with the fields kind, options"),
        (
            ("{kind: corn_field}", "moon"),
            "world: there is no world 'moon'; known: corn_field, debris_field, flat, urban_flood, wildfire_perimeter",
        ),
        (("{kind: corn_field}", "moon.yaml"), "moon.yaml: No such file or directory"),
        (("start: home", "start: {north: 1}"), "vehicles.0.start.north_m: this field is missing"),
        (("start: home", "start: {north_m: .nan, east_m: 0}"), "start.north_m: nan: Input should be a finite number"),
        (
            ("start: home", "start: [1, 2]"),
            "start: [1, 2]: must be a name, or a mapping with the fields north_m, east_m, heading_deg",
        ),
        (("start: home}", "companion: {command: []}}"), "companion.command: []: List should have at least 1 item"),
        (("start: home}", "companion: {command: ./run.py}}"), "command: './run.py': Input should be a valid list"),
        (("name: small", "name: small\ntime_limit_s: .inf"), "time_limit_s: inf: Input should be a finite number"),
        (("name: small", "name: small\nstart_date: 1900-01-01"), "a date from 1970 to 2199"),
        (("name: small", "name: small\npeer_radio: {outages_s: [[5, 1]]}"), "the end after the start"),
        (
            ("name: small", "name: small\npeer_radio: {shared: often}"),
            "peer_radio.shared: 'often': Input should be a valid boolean",
        ),
        (
            ("name: small", "name: small\npeer_radio: {obstructed_range_m: -1}"),
            "peer_radio.obstructed_range_m: -1: Input should be greater than or equal to 0",
        ),
        (("name: small", "name: [small"), "not YAML"),
        (("name: small", "name: small\nstart_date: 2026-13-45"), "not YAML: month must be in 1..12"),
        ((GOOD, ""), "a scenario is a mapping with the fields format, name"),
        ((GOOD, "- uas"), "a scenario is a mapping with the fields format, name"),
        ((GOOD, "\0"), "not YAML"),
        (("start: home", "start: home, start: home"), "line 5: 'start' stands in line 5 already; give it once"),
        (("vehicles:", "name: big\nvehicles:"), "line 4: 'name' stands in line 2 already; give it once"),
        ((GOOD, 50_000 * "["), "line 1: nested too deeply; at most 100 mappings and lists in each other"),
        (("name: small", "name: small\ntime_limit_s: true"), "time_limit_s: True: must be a number"),
        (("start: home", "start: home, count: yes"), "vehicles.0.count: True: must be a number"),
    ],
)
def test_a_wrong_scenario_names_file_field_value_and_what_is_allowed(
    tmp_path: Path, change: tuple[str, str], wanted: str
) -> None:
    file = tmp_path / "scenario.yaml"
    file.write_text(GOOD.replace(*change))
    status, text = call("run", str(file), "--out", str(tmp_path / "run"))
    assert status == 2
    assert str(file) in text and wanted in text
    assert not (tmp_path / "run").exists()


def test_a_scenario_that_can_not_start_leaves_no_folder(tmp_path: Path) -> None:
    file, out = tmp_path / "scenario.yaml", tmp_path / "run"
    file.write_text(GOOD.replace("start: home}", "companion: {command: [./no-such-program]}}"))
    status, text = call("run", str(file), "--out", str(out), "--instance", "100")
    assert status == 2 and "companion uas: can't start './no-such-program': there is no such program" in text
    file.write_text(GOOD)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", ports.payload(100).local))
        assert call("run", str(file), "--out", str(out), "--instance", "100")[0] == 2
    assert not out.exists()


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text(GOOD)
    status, text = call("run", str(tmp_path / "scenario.yaml"), "--out", str(tmp_path), "--instance", "100")
    assert status == 2 and "is not empty" in text


@pytest.mark.parametrize("command", [("preview",), ("export", "--format", "geojson")])
def test_a_world_is_not_written_over_what_a_folder_has(tmp_path: Path, command: tuple[str, ...]) -> None:
    mine = tmp_path / "world.yaml"
    mine.write_text("# my own\nname: plain\n")
    status, text = call("world", *command, str(mine), "--out", str(tmp_path))
    assert status == 2 and text == f"sitl-emu: --out {tmp_path}: this folder is not empty; name a new one"
    assert mine.read_text() == "# my own\nname: plain\n" and len(list(tmp_path.iterdir())) == 1


def test_a_vehicle_that_would_start_in_something_is_told_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "town.yaml").write_text(
        "name: town\nsolids: [{name: shed, north_m: 0, east_m: 0, box: {size_m: [6, 6, 4]}}]\n"
    )
    file = tmp_path / "scenario.yaml"
    file.write_text(GOOD.replace("{kind: corn_field}", "town.yaml"))
    status, text = call("run", str(file), "--isolated", "--out", str(tmp_path / "run"))
    assert status == 2 and f"{file}: vehicles: uas would start in shed, 0.0 m north, 0.0 m east of the world's" in text
    free = "--instance", "180"  # the suites beside this one hold the first ones' ports
    state = "--state", str(tmp_path / "state")
    status, text = call("launch", "iris", "--world", str(tmp_path / "town.yaml"), *state, *free)
    assert status == 2 and "iris (instance 180) would start in shed" in text and "a world with room" in text


def test_an_area_that_is_too_large_for_a_map_is_told_and_leaves_no_folder(tmp_path: Path) -> None:
    mine = tmp_path / "world.yaml"
    mine.write_text(
        "name: wide\narea_m: [[-100000, -100000], [-100000, 100000], [100000, 100000], [100000, -100000]]\n"
    )
    status, text = call("world", "preview", str(mine), "--out", str(tmp_path / "seen"))
    assert status == 2 and "area_m: a map of 200000 x 200000 m can't be drawn; at most 4 km²" in text
    assert not (tmp_path / "seen").exists()


def test_a_place_that_can_not_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text(GOOD)
    file = tmp_path / "scenario.yaml"
    status, text = call("run", str(file), "--out", str(file / "run"), "--instance", "100")
    assert status == 2 and "can't write there" in text and "--out" in text


def test_a_disk_that_is_full_at_once_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, *_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))

    (tmp_path / "scenario.yaml").write_text(GOOD)
    monkeypatch.setattr(Path, "write_text", full)
    status, text = call("run", str(tmp_path / "scenario.yaml"), "--out", str(tmp_path / "run"), "--instance", "100")
    assert status == 2
    assert f"can't write {tmp_path / 'run/scenario.yaml'}: No space left on device; name another place" in text


@pytest.mark.parametrize(
    ("kind", "port", "user"),
    [
        (socket.SOCK_DGRAM, ports.gcs(100).local, "ground station link"),
        (socket.SOCK_DGRAM, ports.onboard(100).local, "offboard link"),
        (socket.SOCK_DGRAM, ports.payload(100).local, "payload link"),
        (socket.SOCK_DGRAM, ports.gimbal(100).local, "gimbal link"),
        (socket.SOCK_STREAM, ports.simulator(100), "simulator"),
    ],
)
def test_every_port_in_use_is_named_with_who_needs_it(
    tmp_path: Path, kind: socket.SocketKind, port: int, user: str
) -> None:
    (tmp_path / "scenario.yaml").write_text(GOOD.replace("corn_field", "flat"))
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", port))
        if kind == socket.SOCK_STREAM:
            taken.listen()
        status, text = call("run", str(tmp_path / "scenario.yaml"), "--out", str(tmp_path / "run"), "--instance", "100")
        assert status == 2 and f"port {port}, which the {user} of vehicle uas (instance 100) needs, is in use" in text
        if kind == socket.SOCK_STREAM:
            status, text = call("world", "flat", "--vehicle", "iris", "--instance", "100")
            assert status == 2 and f"sitl-emu: TCP port {port} is in use" in text and "another instance" in text


def test_a_launch_that_cannot_begin_says_why_and_nothing_else(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", ports.payload(101).local))
        command = [sys.executable, "-m", "sitl_emu", "launch", "iris:2", "--instance", "100", "--state", str(tmp_path)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    assert ended.stdout == ""
    (line,) = ended.stderr.splitlines()
    assert line.startswith(f"sitl-emu: iris (instance 101): UDP port {ports.payload(101).local}")
